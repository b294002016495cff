"""What SUMO really does where loops change lanes: when, where, and on which lanes vehicles are otherwise."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import sumo

from loopgate.abstraction.queue_layout import lay_out_queues
from loopgate.network import LaneSpan
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.assembly import assemble
from loopgate.simulation.drive import Drive
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

LENGTH_M = 5.0


def test_vehicles_change_lanes_in_the_stretches_and_nowhere_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """60 vehicles on a grid whose turns demand changes, five minutes, looked at after every step.

    A vehicle that changes had its rear out of the place before and its front not in the one behind; and on
    every edge each vehicle is on the lane on which its loop enters it or on that on which it leaves it.
    """
    net = tmp_path / "turns.net.xml"
    tool = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    options = "--grid --grid.number=4 --grid.length=150 -L 2 --turn-lanes 1 --turn-lanes.length 40"
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([str(tool), *options.split(), "-o", str(net)], check=True, env=environment)
    scenario = Scenario(network=str(net), loops=40, vehicles=60, duration_s=300)
    assembly = assemble(scenario)
    layout = lay_out_queues(assembly.network, [(loop, DEFAULT_TYPE) for loop in assembly.loops])
    spans: dict[tuple[str, str], LaneSpan] = {
        (loop.id, span.edge): span for loop in assembly.loops for span in loop.spans if not span.internal
    }
    loop_of = {start.vehicle: start.loop.id for start in assembly.starts}
    seen: dict[str, tuple[str, float]] = {}
    changes: list[str] = []
    step = Drive.step

    def look(self: Drive) -> None:
        step(self)
        for driver in self.vehicles:
            lane, position = self._traffic.lane(driver.name)
            edge, _, index = lane.rpartition("_")
            before = seen.get(driver.name, ("", 0.0))
            seen[driver.name] = (lane, position)
            if edge.startswith(":"):
                continue
            span = spans[loop_of[driver.name], edge]
            assert int(index) in {span.lane_in, span.lane}
            if before[0].rpartition("_")[0] == edge and before[0] != lane:
                stretch = layout.stretches[edge]
                # SUMO changes lanes after it has moved, so both lie at this position.
                assert stretch.begin_m + LENGTH_M <= position <= stretch.end_m
                changes.append(driver.name)

    monkeypatch.setattr(Drive, "step", look)
    summary = simulate(scenario)
    assert (summary["collisions"], summary["trespasses"], summary["audit"]) == (0, 0, "clean")
    assert len(changes) > 60
