"""What in additional files leads vehicles off their loops is refused by name."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from loopgate.errors import ScenarioError
from loopgate.simulation.sumo.leading_off import refuse_what_leads_off

LOOP: Any = SimpleNamespace(id="loop3", edges=("a", "b"))


def refuse(folder: Path, text: str) -> None:
    """Write an additional file, and look at it."""
    file = folder / "x.add.xml"
    file.write_text(f"<additional>{text}</additional>")
    refuse_what_leads_off([file], [LOOP])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('<rerouter id="r"><i><closingReroute id="{}"/></i></rerouter>', "closes a"),
        (
            '<rerouter id="r"><i><closingLaneReroute id="{}_1"/></i></rerouter>',
            "--avoid",
        ),
        (
            '<rerouter id="r" edges="c {}"><routeProbReroute id="x"/></rerouter>',
            "vTypes",
        ),
        ('<calibrator id="r" edge="{}"/>', "takes vehicles out on a, which is on loop loop3"),
        ('<calibrator id="r" lane="{}_0"/>', "takes vehicles out"),
    ],
)
def test_what_leads_off_loops_is_refused(tmp_path: Path, text: str, says: str) -> None:
    """On roads of loops; elsewhere it is not."""
    refuse(tmp_path, text.format("d"))
    with pytest.raises(ScenarioError, match=f" r .*{says}"):
        refuse(tmp_path, text.format("a"))


@pytest.mark.parametrize(
    "text",
    [
        '<rerouter id="r" edges="a" vTypes="t"><interval><routeProbReroute id="x"/></interval></rerouter>',
        '<rerouter id="r" edges="a"><interval><parkingAreaReroute id="p"/></interval></rerouter>',
        '<calibrator id="r" edge="a" vTypes="t"/>',
    ],
)
def test_what_is_for_others_is_taken(tmp_path: Path, text: str) -> None:
    """For types of their own, or for those that want to park."""
    refuse(tmp_path, text)
