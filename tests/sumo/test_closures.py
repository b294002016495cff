"""What a closure changed, counted again from the events of its run, one event after the other."""

from __future__ import annotations

from math import isnan
from pathlib import Path
from statistics import median
from typing import Any

import pandas as pd
import pytest

from loopgate import Scenario, read_run
from loopgate.analysis import compute_blocked, compute_delayed, compute_stop_phases
from loopgate.network import RoadNetwork
from loopgate.report.page import write_report
from loopgate.runs.results import read_results
from loopgate.runs.run import Run
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
NETWORK = str(ROOT / "networks/grid5-priority.net.xml")
CLOSED = '[[closures]]\nedge = "C2C1"\nfrom = 200\nto = 500\n'
LINE = (
    '<routes><route id="a" edges="B2C2 C2C1 C1B1 B1B2" cycleTime="120">'
    '<stop lane="C2C1_0" endPos="40" duration="5" until="60"/></route>'
    '<vehicle id="x" route="a" depart="0"/><vehicle id="y" route="a" depart="0"/></routes>'
)


def ran(folder: Path, **more: Any) -> Run:  # noqa: ANN401  fields of a scenario
    """Run with the closure; return the folder."""
    (folder / "closed.toml").write_text(CLOSED, encoding="utf-8")
    files: dict[str, Any] = {"incidents": str(folder / "closed.toml"), "duration_s": 900.0, **more}
    simulate(Scenario(network=NETWORK, **files), folder / "run")
    return read_run(folder / "run")


def delayed(run: Run) -> pd.DataFrame:
    """Return the table of the report."""
    assert run.streets is not None
    return compute_delayed(
        events=run.events,
        vehicles=run.vehicles,
        loops=run.loops,
        streets=run.streets,
        blocked=compute_blocked(summary=run.summary),
        end_s=900.0,
    )


def rounds(run: Run, vehicle: str, own: list[str]) -> list[tuple[float, float, float, float]]:
    """Return of each way round the metres driven and replaced, the time, and the usual time of that part."""
    told = run.events[run.events["event"].isin(["edge", "reroute"])]
    length_m = {edge: one.lanes[0].length_m for edge, one in RoadNetwork.open(NETWORK).edges.items()}
    walks: dict[str, list[list[tuple[float, str]]]] = {}
    found = []
    loop = run.vehicles.set_index("vehicle")["loop"]
    for other in loop[loop == loop[vehicle]].index:
        walk: list[tuple[float, str]] = []
        walks[other] = [walk]
        for _, row in told[told["vehicle"] == other].iterrows():
            if row["event"] == "edge":
                if walk and own[(own.index(walk[-1][1]) + 1) % len(own)] != row["place"]:
                    walk = []
                    walks[other].append(walk)
                if row["place"] in own:
                    walk.append((row["time_s"], row["place"]))

    def usual(first: str, last: str) -> float:
        steps = (own.index(last) - own.index(first)) % len(own)
        times = [
            walk[k + steps][0] - walk[k][0]
            for some in walks.values()
            for walk in some
            for k in range(len(walk) - steps)
            if walk[k][1] == first and (walk[k + steps][0] <= 200.0 or walk[k][0] >= 500.0)
        ]
        return median(times) if times else float("nan")

    edges = [
        (row["time_s"], row["place"])
        for _, row in told[told["vehicle"] == vehicle].iterrows()
        if row["event"] == "edge"
    ]
    k = 0
    while k + 1 < len(edges):
        since_s, first = edges[k]
        if edges[k + 1][1] == own[(own.index(first) + 1) % len(own)]:
            k += 1
            continue
        back = next((n for n in range(k + 1, len(edges)) if edges[n][1] in own), len(edges))
        if back == len(edges):
            found.append((float("nan"),) * 4)
            break
        last = edges[back][1]
        steps = (own.index(last) - own.index(first)) % len(own)
        replaced = sum(length_m[own[(own.index(first) + n) % len(own)]] for n in range(steps))
        driven = sum(length_m[edge] for _, edge in edges[k:back])
        found.append((driven, replaced, edges[back][0] - since_s, usual(first, last) if steps else 0.0))
        k = back
    return found


def test_ways_round_are_as_long_as_their_edges_and_take_as_long_as_their_times_say(tmp_path: Path) -> None:
    """Of every vehicle of a full grid; nobody else is in the table."""
    run = ran(tmp_path, routes=str(ROOT / "routes/grid5.rou.xml"), vehicles=60)
    made = delayed(run).set_index("vehicle")
    loops = {loop: part["edge"].tolist() for loop, part in run.loops.groupby("loop")}
    led = 0
    for vehicle, loop in zip(run.vehicles["vehicle"], run.vehicles["loop"], strict=True):
        own = loops[loop]
        if len(set(own)) < len(own):
            continue
        ways = rounds(run, vehicle, own)
        assert len(ways) == (made["led_round"].get(vehicle, 0))
        led += len(ways)
        if ways:
            longer = sum(way[0] - way[1] for way in ways)
            later = sum(way[2] - way[3] for way in ways)
            assert made["longer_m"][vehicle] == pytest.approx(longer, nan_ok=True)
            assert made["later_s"][vehicle] == pytest.approx(later, nan_ok=True)
    assert led > 10
    assert led == made["led_round"].sum()
    assert not isnan(made["later_s"].mean())
    assert run.summary["standing"]["led_round"] == (made["led_round"] > 0).sum()


def test_waits_before_a_closed_street_and_the_stops_before_during_and_after_it(tmp_path: Path) -> None:
    """Two buses must stop on the street: one waits before it, one behind; nobody is on time after it."""
    (tmp_path / "line.rou.xml").write_text(LINE, encoding="utf-8")
    run = ran(tmp_path, routes=str(tmp_path / "line.rou.xml"))
    waits = {"x": 0.0, "y": 0.0}
    since: dict[str, float] = {}
    for _, row in run.events.iterrows():
        if row["event"] == "refuse" and row["reason"] == "closed":
            since[row["vehicle"]] = row["time_s"]
        elif row["vehicle"] in since and row["event"] in {"refuse", "grant"}:
            waits[row["vehicle"]] += row["time_s"] - since.pop(row["vehicle"])
    made = delayed(run).set_index("vehicle")
    assert made["waited_s"].to_dict() == {v: waits[v] for v in made.index}
    first, second = sorted(waits, key=lambda vehicle: -waits[vehicle])
    entered = run.events.query(f"vehicle == '{second}' and event == 'enter' and place == 'B2C2_0'")["time_s"]
    come = entered[(entered > 200.0) & (entered < 500.0)].item()
    assert made["behind_s"][second] == pytest.approx(500.0 - max(come, 500.0 - waits[first]), abs=5.0)
    assert made["led_round"].sum() == 0

    phases = compute_stop_phases(visits=run.visits, blocked=compute_blocked(summary=run.summary))
    assert phases["phase"].tolist() == ["before", "during", "after"]
    for phase, begin, end in (("before", 0.0, 200.0), ("during", 200.0, 500.0), ("after", 500.0, 901.0)):
        some = run.visits[(run.visits["went_on_s"] >= begin) & (run.visits["went_on_s"] < end)]
        row = phases[phases["phase"] == phase].iloc[0]
        assert row["visits"] == len(some)
        worst = (some["went_on_s"] - some["due_s"]).max()
        assert row["worst_late_s"] == pytest.approx(worst, nan_ok=True)
    page = write_report(read_results(tmp_path / "run"), tmp_path / "r.html").page.read_text("utf-8")
    assert f"waited before it ({first} longest, {waits[first]:.0f} s)" in page
    assert "Stops before, during and after what was closed or stood." in page
