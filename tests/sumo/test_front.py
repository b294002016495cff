"""What a notebook gets of a run: figures, tables, pictures, and gates of its own."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from loopgate import Run, Scenario, read_run, run
from loopgate.gates.collision import CollisionGate
from loopgate.model import Configuration
from loopgate.negotiation.simple import OldestFirst
from loopgate.results.columns import EDGE_COLUMNS, EVENT_COLUMNS, VEHICLE_COLUMNS

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
ROADS = {
    "network": str(ROOT / "networks" / "order2.net.xml"),
    "routes": str(ROOT / "routes" / "order2.rou.xml"),
}
SCENARIO = Scenario(**ROADS, abstraction="segments", gate="one-step", duration_s=300)  # type: ignore[arg-type]


class Counting(CollisionGate):
    """Counts the moves that it is told of."""

    moves = 0

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Count one more."""
        Counting.moves += 1
        super().moved(configuration, robot)


def test_a_run_without_a_folder_has_everything() -> None:
    """Tables, summary and figures are there although no file is."""
    made = run(SCENARIO)
    assert made.folder is None
    assert set(EVENT_COLUMNS) <= set(made.events.columns)
    assert set(VEHICLE_COLUMNS) <= set(made.vehicles.columns)
    assert set(EDGE_COLUMNS) <= set(made.edges.columns)
    assert made.summary["laps"] == made.vehicles["laps"].sum() > 0
    assert set(made.figures) == {"over-time", "laps", "standing", "idleness", "seen", "unwatched"}


def test_a_run_with_a_folder_is_what_the_folder_holds(tmp_path: Path) -> None:
    """What is returned is what anybody else would read."""
    made = run(SCENARIO, tmp_path / "r")
    read = read_run(tmp_path / "r")
    assert read.events.equals(made.events)
    assert read.summary == made.summary
    assert read.scenario["gate"] == "one-step"


def test_a_notebook_shows_figures_in_words_and_pictures() -> None:
    """Without a gate nothing is said of holds; a name from outside is text."""
    shown = run(SCENARIO)._repr_html_() or ""
    assert "<th style='text-align:left'>throughput</th>" in shown
    assert shown.count("<img ") == 6
    free = run(Scenario(**ROADS, gate="open", duration_s=60))  # type: ignore[arg-type]
    assert "hold time" not in (free._repr_html_() or "hold time")
    named = Run({**free.summary, "network": "<b>"}, free.events, free.vehicles, free.edges, free.scenario)
    assert "&lt;b&gt;" in (named._repr_html_() or "")
    known = {key: value for key, value in free.summary.items() if key != "idleness_s"}
    assert Run(known, free.events, free.vehicles, free.edges, free.scenario)._repr_html_() is None


def test_a_gate_of_the_notebook_rules() -> None:
    """The class itself is asked and told; the summary names it."""
    Counting.moves = 0
    made = run(SCENARIO, gate=Counting)
    assert Counting.moves > 10
    assert made.summary["gate"].endswith("test_front.py:Counting")
    assert run(SCENARIO, gate=partial(Counting)).events.equals(made.events)


def test_a_negotiation_of_the_notebook_orders() -> None:
    """One that is made already, such as one that has learned, is asked as it is."""
    asked = []

    class Learned(OldestFirst):
        def order(self, requests, view, now_s):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
            asked.append(now_s)
            return super().order(requests, view, now_s)

    from random import Random  # noqa: PLC0415

    run(SCENARIO, negotiation=Learned(Random(1)))
    assert asked
