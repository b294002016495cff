"""Holds hold: where somebody must not change lanes, and beside stops that are not the gate's."""

from __future__ import annotations

from pathlib import Path

import libsumo
import pytest
from made_networks import netgenerate

from loopgate.cli.main import EXIT_UNCLEAN
from loopgate.cli.run import exit_code
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

GRID = Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml"


def prohibiting(folder: Path) -> str:
    """Make a grid of two lanes on which only the authorities may change them."""
    file = netgenerate("--grid --grid.number=4 --grid.length=120 -L 2", folder / "p.net.xml")
    text = file.read_text(encoding="utf-8")
    lane = '<lane id="{}" index="{}" '
    for name in ("A", "B", "C", "D"):
        for index in (0, 1):
            for begin in sorted({part.split('"')[0] for part in text.split(f'<lane id="{name}')[1:]}):
                old = lane.format(f"{name}{begin}", index)
                text = text.replace(old, old + 'changeLeft="authority" changeRight="authority" ')
    assert 'changeLeft="authority"' in text
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_they_hold_where_somebody_must_not_change_lanes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SUMO's other way to set a stop puts it a lap later there: overruns are seen, and are no success."""
    scenario = Scenario(
        network=prohibiting(tmp_path), loops=20, vehicles=80, duration_s=240.0, on_deadlock="continue"
    )
    summary = simulate(scenario)
    assert (summary["overruns"], summary["trespasses"], summary["collisions"]) == (0, 0, 0)
    assert summary["clean"]
    assert exit_code(summary) == 0
    monkeypatch.setattr(SumoTraffic, "_may_insert", lambda *_: True)
    summary = simulate(scenario)
    assert summary["overruns"] > 0
    assert not summary["clean"]
    assert exit_code(summary) == EXIT_UNCLEAN
    assert any("could not brake for their line" in line for line in summary["warnings"])


def test_the_exit_code_of_an_unclean_run_is_its_own() -> None:
    """Interrupted before unclean, unclean before a deadlock; nothing is unclean under no gate."""
    assert exit_code({"outcome": "deadlock", "clean": False}) == EXIT_UNCLEAN
    assert exit_code({"outcome": "deadlock", "clean": None}) == 3
    assert exit_code({"outcome": "interrupted", "clean": False}) == 130
    assert exit_code({"outcome": "done", "clean": True}) == 0


def test_a_release_takes_its_own_stop_and_no_other() -> None:
    """A bus stop before the line stays when the hold behind it is dropped, and the other way round."""
    libsumo.start(["sumo", "-n", str(GRID), "--no-step-log", "--no-warnings"])
    try:
        libsumo.route.add("r", ["A0A1", "A1A2", "A2A3"])
        libsumo.vehicle.add("v", "r", departSpeed="0")
        traffic = SumoTraffic(libsumo, libsumo.TraCIException)
        traffic.step()
        libsumo.vehicle.setStop("v", "A0A1", pos=40.0, laneIndex=0, duration=5.0)
        assert traffic.hold("v", "A0A1", 0, 70.0)
        assert [stop.endPos for stop in libsumo.vehicle.getStops("v", 0)] == [40.0, 70.0]
        traffic.release("v")
        assert [stop.endPos for stop in libsumo.vehicle.getStops("v", 0)] == [40.0]
        traffic.release("v")
        assert len(libsumo.vehicle.getStops("v", 0)) == 1
    finally:
        libsumo.close()


def test_one_on_another_lane_is_not_held_but_told() -> None:
    """The drive leads it back then."""
    libsumo.start(["sumo", "-n", str(GRID), "--no-step-log", "--no-warnings"])
    try:
        libsumo.route.add("r", ["A0A1", "A1A2"])
        libsumo.vehicle.add("v", "r")
        traffic = SumoTraffic(libsumo, libsumo.TraCIException)
        traffic.step()
        assert not traffic.hold("v", "A0A1", 1, 70.0)
        assert not libsumo.vehicle.getStops("v", 0)
    finally:
        libsumo.close()
