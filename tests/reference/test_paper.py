"""The reproduction of Section 5: what must agree does, and what cannot is explained."""

from __future__ import annotations

from pathlib import Path

import pytest

from loopgate.errors import SystemModelError
from loopgate.gates import make_gate
from loopgate.research.paper import reproduce
from loopgate.research.paper.section5 import at_states, table1
from loopgate.research.runs.counting import count_runs
from loopgate.research.theory.instances import TABLE1_STARTS, instance


def test_quick_reproduction(tmp_path: Path) -> None:
    """Every row is there, figures are drawn, and rows without a reason agree."""
    data = reproduce(tmp_path, quick=True)
    rows = {row["what"]: row for row in data["rows"]}
    assert {file.name for file in tmp_path.iterdir()} == {
        "fig11.png",
        "fig12.png",
        "live_rounds.png",
        "table.json",
        "table.md",
    }
    assert rows["rounds that deadlock under Algorithm 2"]["ours"] == "0 of 100"
    assert rows["transitions of a round under Algorithm 2"]["ours"] == "27 to 27"
    assert rows["configurations under Algorithm 2: all, stuck, not live"]["ours"] == "6496, 0, 0"
    for what, row in rows.items():
        if what.startswith(("who may move", "configuration of", "order of", "moves of")):
            assert row["printed"] == row["ours"], what


def test_live_probability_is_exact() -> None:
    """About 0.30, and within the spread of the printed 3017.65 of 10000."""
    system = instance("fig10")
    runs = count_runs(system, make_gate("collision", system))
    assert runs.live_probability == pytest.approx(0.301084, abs=1e-6)
    spread = (10_000 * runs.live_probability * (1 - runs.live_probability) / 100) ** 0.5
    assert abs(3017.65 - 10_000 * runs.live_probability) < 3 * spread
    gated = count_runs(system, make_gate("algorithm2", system))
    assert gated.live_probability == pytest.approx(1.0)
    assert gated.transitions == pytest.approx(27.0)


def test_vbanker_agrees_with_the_last_column_of_table1() -> None:
    """To the digit: 1187 configurations and 316 routes."""
    system = instance("fig8")
    runs = count_runs(system, make_gate("banker", system), at_states(system, TABLE1_STARTS[4]))
    assert (runs.sequences, runs.routes) == (1187, 316)


def test_table1_is_counted_by_brute_force_too() -> None:
    """The tree of all sequences from the smallest start, walked node by node."""
    system = instance("fig8")
    gate = make_gate("algorithm2", system)
    nodes = leaves = 0
    stack = [at_states(system, TABLE1_STARTS[4])]
    while stack:
        here = stack.pop()
        after = [system.move(here, i) for i in range(4) if gate.decide(here, i).admitted]
        nodes += len(after)
        leaves += not after
        stack.extend(after)
    assert (nodes, leaves) == (4860, 1368)
    assert table1()[8].ours == "4860, 1368"


def test_table1_starts_one_and_three_are_alike() -> None:
    """Exact counts from them are equal, the printed ones are not: those are samples."""
    rows = table1()
    assert rows[0].ours == rows[4].ours
    assert rows[0].printed != rows[4].printed


def test_closed_paths_have_no_runs_to_count() -> None:
    """A clear error."""
    system = instance("unsound_n5")
    with pytest.raises(SystemModelError, match="its path is closed"):
        count_runs(system, make_gate("collision", system))
