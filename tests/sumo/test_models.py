"""Car-following models under a gate: they stop at their lines, or are refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_networks import netgenerate

from loopgate.errors import ScenarioError
from loopgate.network import RoadNetwork, VehicleType, generate_loops
from loopgate.simulation.braking_trial import why_overruns
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo


def soft(model: str, decel: float) -> VehicleType:
    """Return a type that brakes gently."""
    return VehicleType("t", attributes={"carFollowModel": model, "decel": f"{decel}"})


@pytest.mark.parametrize(
    ("model", "decel", "top_mps", "step_s", "stops"),
    [
        ("Krauss", 0.8, 48.0, 0.1, True),
        ("Wiedemann", 0.8, 48.0, 1.0, True),
        ("ACC", 1.5, 20.0, 0.5, True),
        ("IDM", 1.5, 10.0, 1.0, True),
        ("IDM", 1.5, 20.0, 1.0, False),
        ("EIDM", 1.5, 14.0, 1.0, False),
        ("EIDM", 4.5, 14.0, 0.1, True),
    ],
)
def test_a_trial_finds_the_types_that_do_not_stop(
    model: str, decel: float, top_mps: float, step_s: float, *, stops: bool
) -> None:
    """As in the runs below; IDM with its textbook deceleration stops on slow roads only."""
    why = why_overruns(soft(model, decel), decel, top_mps, step_s)
    assert (why == "") is stops
    assert stops or f"decel {decel:g} is too soft to stop at a line" in why


@pytest.mark.parametrize(("model", "decel"), [("ACC", 0.8), ("Wiedemann", 1.0), ("EIDM", 4.5), ("IDM", 1.5)])
def test_who_is_taken_stops_on_fast_roads(model: str, decel: float, tmp_path: Path) -> None:
    """Behind a vehicle that stands at the line too, for which these models brake late."""
    options = "--grid --grid.number=4 --grid.length=200 --default.speed=20"
    roads = netgenerate(options, tmp_path / "fast.net.xml")
    attributes = " ".join(f'{name}="{text}"' for name, text in soft(model, decel).attributes.items())
    lines = [f'<vType id="t" accel="4" {attributes}/>']
    for loop in generate_loops(RoadNetwork.open(str(roads)), 8, length_m=(800.0, 2000.0)):
        lines.append(f'<route id="{loop.id}" edges="{" ".join(loop.edges)}"/>')
        lines += [f'<vehicle id="{loop.id}.{k}" type="t" route="{loop.id}" depart="0"/>' for k in range(4)]
    routes = tmp_path / "soft.rou.xml"
    routes.write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    scenario = Scenario(network=str(roads), routes=str(routes), duration_s=120.0, step_s=0.5, seed=3)
    if model == "IDM":
        with pytest.raises(ScenarioError, match=r"vType t: carFollowModel IDM with decel 1\.5 is too soft"):
            simulate(scenario, tmp_path / "run")
        return
    summary = simulate(scenario, tmp_path / "run")
    assert (summary["collisions"], summary["overruns"], summary["audit"]) == (0, 0, "clean")
