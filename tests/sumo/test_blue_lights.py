"""Vehicles with blue lights: under a gate nobody leaves a lane to make way for them."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from made_networks import netgenerate

from loopgate import Scenario
from loopgate.errors import ScenarioError
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

AMBULANCE = '<vType id="a" vClass="emergency"><param key="has.bluelight.device" value="true"/>{}</vType>'
CALLS = (
    '<trip id="a{0}" type="a" depart="{0}" from="A0B0" to="C2D2"/>'
    '<trip id="b{0}" type="a" depart="{0}" from="D3C3" to="A1A0"/>'
)
CARS = (
    '<flow id="c" begin="0" end="120" period="3" from="A0B0" to="C2D2" departLane="random"/>'
    '<flow id="d" begin="0" end="120" period="3" from="D3C3" to="A1A0" departLane="random"/>'
)


def files(folder: Path, *, gated: bool, said: str = "") -> dict[str, Any]:
    """Make two-lane roads, and ambulances among cars: under the gate too, or ordinary ones."""
    options = "--grid --grid.number 4 --grid.length 150 --default.lanenumber 2 --no-turnarounds"
    netgenerate(options, folder / "n.net.xml")
    calls = AMBULANCE.format(said) + "".join(CALLS.format(at_s) for at_s in range(10, 120, 10))
    (folder / "c.rou.xml").write_text(f"<routes>{calls if gated else ''}{CARS}</routes>")
    (folder / "o.rou.xml").write_text(f"<routes>{calls}</routes>")
    made: dict[str, Any] = {"network": str(folder / "n.net.xml"), "routes": str(folder / "c.rou.xml")}
    return made if gated else {**made, "traffic": str(folder / "o.rou.xml")}


@pytest.mark.parametrize("gated", [True, False])
def test_nobody_makes_way(tmp_path: Path, *, gated: bool) -> None:
    """Otherwise SUMO takes gated vehicles near an ambulance to lanes where they have no grant.

    An ordinary ambulance may change lanes into another vehicle at the end of its road.
    """
    scenario = Scenario(**files(tmp_path, gated=gated), duration_s=180.0, positions=True)
    summary = simulate(scenario, tmp_path / "run")
    assert summary["trespasses"] == 0
    verdicts = summary["others"]["verdicts"] if not gated else []
    told = [] if summary["audit"] == "clean" else [float(one.split(" s:")[0]) for one in summary["audit"]]
    assert told == [one["at_s"] for one in verdicts]
    assert {one["erred"] for one in verdicts} <= {"ordinary"}
    events = pd.read_parquet(tmp_path / "run" / "events.parquet")
    assert "stray" not in set(events["event"])
    assert sum("bluelight" in one or "blue lights" in one for one in summary["warnings"]) == 1


def test_a_distance_of_its_own_is_refused(tmp_path: Path) -> None:
    """A vehicle's parameter goes before SUMO's option."""
    given = files(tmp_path, gated=False, said='<param key="device.bluelight.reactiondist" value="30"/>')
    with pytest.raises(ScenarioError, match=r"o\.rou\.xml: device\.bluelight\.reactiondist does not go with"):
        simulate(Scenario(**given, duration_s=180.0), tmp_path / "run")
