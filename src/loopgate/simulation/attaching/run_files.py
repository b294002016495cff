"""The run folder of an attached gate: what `loopgate replay` and `loopgate report` read of a run."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import pandas as pd

from loopgate.analysis.trips import compute_vehicle_holds
from loopgate.disk import writing
from loopgate.network import Loop, RoadNetwork
from loopgate.results.columns import (
    EVENT,
    FLOW_EVERY_S,
    HOLD,
    LAPS,
    LONGEST_WAIT,
    NOT_AUDITED,
    OF_AN_OWNER,
    TIME,
    VEHICLE,
    Event,
)
from loopgate.results.recorder import Recorder
from loopgate.simulation import run_folder
from loopgate.simulation.drive import Drive
from loopgate.simulation.fcd.film import Film
from loopgate.simulation.fcd.folder import Reel, tally, write_tables
from loopgate.simulation.fcd.frames import SeenVehicle
from loopgate.simulation.loop_run import RunCourse
from loopgate.simulation.run_folder import Folder
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.flow import loop_table
from loopgate.traffic.running import RunningSumo

_OF_TALLIES = "vehicles", "laps", "distance_km", "hold_s", "longest_stood_s", "longest_wait_s"


class RunFiles:
    """Writes the positions of all vehicles while the simulation goes on, and the tables at its end.

    Parameters
    ----------
    path, overwrite
        The run folder; whether results in it may be replaced.
    settings
        Gate, negotiation, lights and seed, as keys of a scenario.
    """

    def __init__(
        self,
        path: Path,
        network: RoadNetwork,
        sumo: RunningSumo,
        settings: Mapping[str, Any],
        *,
        overwrite: bool,
    ) -> None:
        self._network, self._sumo, self._settings = network, sumo, settings
        self._began = perf_counter()
        self.stack = ExitStack()
        self._folder = self.stack.enter_context(Folder(path, overwrite=overwrite))
        self._net_file = Path(str(sumo.setting("net-file"))).resolve()  # who ends SUMO early takes it away
        step_s = sumo.traffic.step_s
        self._begin_s = sumo.traffic.now_s
        self._film = Film(network, step_s)
        positions = self._folder / run_folder.POSITIONS
        self._table = self.stack.enter_context(ExitStack())
        self._table.enter_context(writing(positions))
        table = self._table.enter_context(gzip.open(positions, "wt", 5))  # noqa: SIM115  the stack closes it
        self._reel = Reel(self._film, table, self._begin_s)

    def look(self) -> None:
        """Write where all vehicles are after a step."""
        time_s = self._sumo.traffic.now_s - self._film.step_s  # SUMO's own output names the begin of a step
        self._reel.take(time_s, [SeenVehicle(*one) for one in self._sumo.seen()])

    def write(
        self, events: pd.DataFrame, figures: Mapping[str, Any], drive: Drive, loops: Mapping[str, Loop]
    ) -> None:
        """Write the tables and the summary.

        `loops`: the loop of each vehicle that came under the gate.
        """
        self._table.close()
        folder, film = self._folder, self._film
        recorder = Recorder(folder / run_folder.EVENTS)
        for time_s, vehicle, event, place, reason, stage in events.itertuples(index=False):
            recorder.note(time_s, vehicle, Event(event), place, reason, stage)
        recorder.close()
        course = RunCourse(begin_s=self._begin_s)
        course.end_s = film.now_s
        course.total_s = perf_counter() - self._began
        scenario = Scenario(
            network=str(self._net_file),
            step_s=film.step_s,
            duration_s=max(film.step_s, course.end_s - course.begin_s),
            **self._settings,
        )
        with writing(folder / run_folder.SCENARIO):
            scenario.write(folder / run_folder.SCENARIO)
        holds = compute_vehicle_holds(events=events, end_s=max(course.end_s, self._begin_s + film.step_s))
        by_vehicle = holds.set_index(VEHICLE)
        tallies = []
        for vehicle in sorted(loops.keys() & film.courses.keys()):
            seen, loop = tally(vehicle, film), loops[vehicle]
            if vehicle in by_vehicle.index:
                row = by_vehicle.loc[[vehicle]].iloc[0]
                seen = replace(
                    seen,
                    laps=int(row[LAPS]),
                    hold_s=float(row[HOLD]),
                    longest_wait_s=float(row[LONGEST_WAIT]),
                )
            tallies.append(replace(seen, loop=loop.id, loop_length_m=loop.lap_m))
        every = {loop.id: loop for loop in loops.values()}
        ways = {loop.id: [(span.begin_m, span.edge) for span in loop.roads] for loop in every.values()}
        folder.write_table(loop_table(ways), run_folder.LOOPS)
        of: dict[str, Any] = {"loops": len(ways), "folder": folder, "gated": drive}
        laps = events.loc[events[EVENT] == Event.LAP, TIME].to_numpy()
        rows = [
            (*row[:4], int(((laps > row[0] - FLOW_EVERY_S) & (laps <= row[0])).sum()))
            for row in self._reel.rows
        ]
        summary = run_folder.summary(scenario, course, tallies, **of)
        summary |= write_tables(folder, film, course, rows, self._network, tallies)
        told: dict[str, Any] = {
            "audit": NOT_AUDITED,
            "command": OF_AN_OWNER,
            "teleports": None,
        }
        # Tables and figures are of the time since the gate was attached, and of all that came under it.
        figures = {name: value for name, value in figures.items() if name not in _OF_TALLIES}
        folder.write_summary(summary | figures | told)
