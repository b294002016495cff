"""What in additional files leads vehicles off their loops is refused by name."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from loopgate.errors import ScenarioError
from loopgate.simulation.sumo.devices import idle_rerouters, led_off, refuse_what_leads_off

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


@pytest.mark.parametrize(
    ("rerouter", "found"),
    [
        ('edges="a"><i><routeProbReroute id="lap"/></i>', {"r": "loop3"}),
        ('edges="a b"><i><routeProbReroute id="loop3"/></i>', {"r": "loop3"}),
        ('edges="b"><i><routeProbReroute id="lap"/><routeProbReroute id="off"/></i>', {}),
        ('edges="b"><i><routeProbReroute id="lap"/><closingReroute id="c"/></i>', {}),
        ('edges="a"><i><destProbReroute id="b"/></i>', {}),
        ('edges="c"><i><routeProbReroute id="lap"/></i>', {}),
        ('edges="a" vTypes="t"><i><routeProbReroute id="lap"/></i>', {}),
    ],
)
def test_a_rerouter_that_only_leads_round_the_loop_is_idle(
    tmp_path: Path, rerouter: str, found: dict[str, str]
) -> None:
    """All its routes are rounds of the loop, from anywhere, written once or several times; nothing else."""
    file = tmp_path / "x.add.xml"
    routes = '<route id="lap" edges="b a b a b"/><route id="off" edges="b c"/>'
    file.write_text(f'<additional>{routes}<rerouter id="r" {rerouter}</rerouter></additional>')
    assert idle_rerouters([file], [LOOP]) == found
    if found:
        refuse_what_leads_off([file], [LOOP], found)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('edges="c b"><i><destProbReroute id="x"/></i>', "leads it off its way at b"),
        ('edges="a" vTypes="t"><i><routeProbReroute id="x"/></i>', "leads it off its way at a"),
        ('edges="a"><i><closingReroute id="b"/></i>', "closes b on its way"),
        ('edges="a,c"><i><closingLaneReroute id="b_1"/></i>', "closes b on its way"),
        ('edges="b"><i><closingReroute id="a"/></i>', ""),
        ('edges="a"><i><closingReroute id="c"/></i>', ""),
        ('edges="a" vTypes="u"><i><destProbReroute id="x"/></i>', ""),
        ('edges="before"><i><destProbReroute id="x"/></i>', ""),
    ],
)
def test_trips_that_sumo_leads_off_are_told(tmp_path: Path, text: str, why: str) -> None:
    """By name, with the rerouter; those on loops are none of them."""
    file = tmp_path / "x.add.xml"
    file.write_text(f'<additional><rerouter id="r" {text}</rerouter></additional>')
    way = {"edges": ("before", "a", "b")}
    trip: Any = SimpleNamespace(
        id="v", edge=1, loop=SimpleNamespace(closed=False, **way), type=SimpleNamespace(id="t")
    )
    loop: Any = SimpleNamespace(id="w", edge=1, loop=SimpleNamespace(closed=True, **way), type=trip.type)
    found = led_off([file], [trip, loop])
    assert list(found) == (["v"] if why else [])
    assert found.get("v", "").startswith(f"rerouter r {why}" if why else "")
