"""Runs of all kinds under gates: what they write, and that nobody waits needlessly."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import heart  # in analysis/
import pandas as pd
import pytest
from full_ring import write_full_ring

from loopgate.errors import PluginError
from loopgate.results.recorder import read_events
from loopgate.simulation import run as runs
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.start import start_traffic
from loopgate.simulation.watching.window import COLOURS
from loopgate.traffic.sumo import SumoTraffic

GRID = str(Path(__file__).resolve().parents[2] / "networks" / "grid5-priority.net.xml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where runs are kept for the whole module."""
    return tmp_path_factory.mktemp("runs")


@cache
def run(folder: Path, **given: Any) -> tuple[dict[str, Any], Path]:  # noqa: ANN401  of a scenario
    """Run a scenario; return its summary, and its folder."""
    out = folder / f"run{len(list(folder.iterdir()))}"
    made = Scenario(positions=True, on_deadlock="continue", **given)
    return simulate(made, out), out


ON_GRID: dict[str, Any] = {
    "network": GRID,
    "vehicles": 150,
    "loops": 40,
    "duration_s": 200.0,
    "warmup_s": 20.0,
}


IN_TOWN: dict[str, Any] = {"network": "sumo:DRT", "loops": 20, "vehicles": 120, "duration_s": 150.0}


@pytest.mark.parametrize(("given", "least_km"), [(ON_GRID, 145.0), (IN_TOWN, 135.0)], ids=["grid", "town"])
def test_a_gated_run_is_clean_and_drives_far(folder: Path, given: dict[str, Any], least_km: float) -> None:
    """Clean by positions, with events of all kinds."""
    summary, of = run(folder, **given)
    assert summary["clean"]
    assert summary["audit"] == "clean"
    assert set(summary["audited"]) >= {"crossings", "bodies"}
    assert summary["distance_km"] > least_km
    kinds = set(read_events(of / "events.parquet")["event"])
    assert kinds >= {"start", "edge", "lap", "enter", "leave", "grant", "refuse", "hold", "go"}


def test_trips_depart_and_arrive(folder: Path, tmp_path: Path) -> None:
    """The figures of their trips are there."""
    ends = [("A0B0", "D4E4"), ("E4D4", "B0A0"), ("A4A3", "E1E0"), ("E0E1", "A3A4")]
    rows = [
        f'<trip id="t{n}" depart="{n}" from="{ends[n % 4][0]}" to="{ends[n % 4][1]}"/>' for n in range(60)
    ]
    file = tmp_path / "trips.rou.xml"
    file.write_text(f"<routes>{''.join(rows)}</routes>")
    given: dict[str, Any] = {"network": GRID, "routes": str(file), "duration_s": 120.0}
    mine, of = run(folder, **given)
    assert mine["clean"]
    assert mine["arrived"] > 5
    assert pd.read_parquet(of / "vehicles.parquet")["arrived"].sum() == mine["arrived"]


def test_loops_that_depart_later_leave_room_for_trips(folder: Path, tmp_path: Path) -> None:
    """More would go round one block than it holds: some wait, and trips pass it."""
    given: dict[str, Any] = {**write_full_ring(tmp_path), "duration_s": 500.0}
    mine, _ = run(folder, **given)
    assert mine["clean"]
    assert mine["waiting_to_depart"] > 0
    assert (mine["arrived"], mine["unfinished"]) == (2, 0)


@pytest.mark.parametrize("gate", ["banker", "one-step", "certified:promise=somebody"])
def test_vehicles_depart_later_under_any_gate(folder: Path, tmp_path: Path, gate: str) -> None:
    """Loops and trips; a gate that knows the vehicles at its start only is made anew for all."""
    ends = [("A0B0", "D4E4"), ("E4D4", "B0A0"), ("A4A3", "E1E0"), ("E0E1", "A3A4")]
    rows = [f'<trip id="t{n}" depart="{4 * n}" from="{ends[n][0]}" to="{ends[n][1]}"/>' for n in range(4)]
    ring = ["B1C1", "C1C2", "C2B2", "B2B1"]
    rows += [
        f'<vehicle id="l{n}" depart="{9 * n}"><route edges="{edges}" repeat="9"/></vehicle>'
        for n in range(3)
        for edges in (" ".join(ring[n:] + ring[:n]),)
    ]
    file = tmp_path / "later.rou.xml"
    file.write_text(f"<routes>{''.join(rows)}</routes>")
    given: dict[str, Any] = {"network": GRID, "routes": str(file), "duration_s": 200.0, "gate": gate}
    mine, _ = run(folder, **given)
    assert mine["clean"]
    assert mine["departed"] >= 6
    assert mine["arrived"] >= 3


def test_vehicles_stop_and_are_spaced(folder: Path, tmp_path: Path) -> None:
    """On one ring: stops are made, and vehicles are held to be spaced."""
    file = tmp_path / "ring.rou.xml"
    file.write_text(
        '<routes><route id="ring" edges="B2C2 C2C1 C1B1 B1B2">'
        '<stop lane="C2C1_0" startPos="40" endPos="60" duration="8"/></route>'
        + "".join(f'<vehicle id="r{n}" route="ring" depart="0"/>' for n in range(4))
        + "</routes>"
    )
    given: dict[str, Any] = {"network": GRID, "routes": str(file), "duration_s": 400.0, "spacing": "hold"}
    mine, _ = run(folder, **given)
    assert mine["clean"]
    assert mine["stops"]["served"] > 10
    assert "spacing" in mine["refusals"]


def test_loops_drive_among_ordinary_traffic(folder: Path, tmp_path: Path) -> None:
    """Clean by positions."""
    trips = tmp_path / "ordinary.rou.xml"
    heart.draw_trips(GRID, 3.0, 150.0, 1, trips)
    given: dict[str, Any] = {
        "network": GRID, "vehicles": 60, "loops": 30, "traffic": str(trips), "duration_s": 150.0
    }  # fmt: skip
    mine, _ = run(folder, **given)
    assert mine["clean"]
    assert mine["collisions"] == mine["collisions_by_others"] == mine["trespasses"] == 0


@pytest.mark.parametrize(
    "given",
    [
        {"gate": "banker", "vehicles": 12},
        {"gate": "algorithm2", "abstraction": "segments", "vehicles": 6, "loops": 6},
        {"negotiation": "oldest"},
        {"negotiation": "pressure:crowded=0.3,patience=50", "serve_after_s": 0.0},
    ],
    ids=["banker", "segments", "oldest", "pressure"],
)
def test_other_gates_and_negotiations_decide(folder: Path, given: dict[str, Any]) -> None:
    """Clean by positions under each."""
    every: dict[str, Any] = {"network": GRID, "vehicles": 40, "loops": 20, "duration_s": 120.0} | given
    mine, _ = run(folder, **every)
    assert mine["clean"]
    assert mine["audit"] == "clean"


def test_a_gate_of_the_users_that_fails_ends_the_run_and_is_named(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from loopgate.gates import Decision, Reason\n"
        "class Mine:\n"
        "    def __init__(self, system): self.moves = 0\n"
        "    def decide(self, configuration, robot):\n"
        "        return Decision(True, Reason.FREE) if self.moves < 9 else 1\n"
        "    def moved(self, configuration, robot): self.moves += 1\n"
    )
    with pytest.raises(PluginError, match="Mine: decide returned"):
        run(folder, network=GRID, vehicles=20, loops=10, gate=f"{file}:Mine", duration_s=60.0)


def test_vehicles_are_painted_in_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of them, those that drive in another colour than those that stand."""
    painted: dict[str, set[tuple[int, int, int]]] = {}
    shown: list[Any] = []

    def start(*options: Any, **settings: Any) -> SumoTraffic:  # noqa: ANN401  of `start_traffic`
        return start_traffic(*options, **settings | {"backend": "libsumo"})

    def paint(_: SumoTraffic, vehicle: str, colour: tuple[int, int, int]) -> None:
        painted.setdefault(vehicle, set()).add(colour)

    monkeypatch.setattr(runs, "start_traffic", start)
    monkeypatch.setattr(SumoTraffic, "show", lambda _, low, high: shown.append((low, high)))
    monkeypatch.setattr(SumoTraffic, "paint", paint)
    monkeypatch.setenv("DISPLAY", ":0")
    made = Scenario(network=GRID, vehicles=20, loops=10, duration_s=30.0)
    assert simulate(made, backend="gui")["clean"]
    assert len(shown) == 1
    assert sorted(painted) == sorted(f"v{number}" for number in range(1, 21))
    assert all(colours >= {COLOURS[0], COLOURS[2]} for colours in painted.values())


def test_what_observers_write_fits_together(folder: Path) -> None:
    """Vehicles, edges, flow and fronts of a run say the same as its summary."""
    summary, of = run(folder, **ON_GRID)
    vehicles, edges, flow, fronts = (
        pd.read_parquet(of / f"{n}.parquet") for n in ("vehicles", "edges", "flow", "fronts")
    )
    assert vehicles["distance_m"].sum() / 1000.0 == pytest.approx(summary["distance_km"])
    assert edges["stood_s"].sum() == pytest.approx(vehicles["stood_s"].sum())
    assert edges["hold_s"].sum() == pytest.approx(vehicles["hold_s"].sum(), rel=0.02)
    measured = flow[flow["time_s"] > summary["begins_s"] + 21.0]
    assert measured["distance_m"].sum() / 1000.0 == pytest.approx(summary["distance_km"], rel=0.001)
    assert measured["laps"].sum() == summary["laps"]
    last = fronts.groupby("vehicle", observed=True)["front_dm"].agg(["first", "last"])
    assert (last["last"] - last["first"]).sum() / 10_000.0 == pytest.approx(
        flow["distance_m"].sum() / 1000.0, rel=0.01
    )
