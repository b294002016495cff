"""Posts and vehicles beside Algorithm 2 by messages: one grows as the circuits, the other as the places."""

from __future__ import annotations

import re
from pathlib import Path

import beside_zhou
from vehicles_alone import WRONG

from loopgate.research.agents import decide_by_messages
from loopgate.research.theory.instances import instance

ROOT = Path(__file__).resolve().parents[3]


def test_a_layer_more_doubles_the_messages_of_one_and_adds_one_to_the_other() -> None:
    """Of Algorithm 2 twice as many robots are visited in each layer; a probe passes one place in each."""
    asked = [
        sum(decide_by_messages(one, one.initial, 0).messages.values())
        for one in map(beside_zhou.layers, range(1, 6))
    ]
    assert asked == [2 ** (depth + 2) - 4 for depth in range(1, 6)]
    assert [beside_zhou.last_slot(depth) for depth in range(1, 6)] == [5, 6, 7, 8, 9]


def test_places_of_two_let_all_go_round_where_algorithm_2_stops_everyone() -> None:
    """On the same paths, with as many robots and with twice as many."""
    system = instance("blocked_n5")
    found = beside_zhou.by_agents(system, 5)
    assert (found.done, found.runs) == (4, 5)
    for copies in (1, 2):
        run = beside_zhou.by_posts(beside_zhou.wide(system, copies), 5)
        assert run.done == run.runs == 5
        assert run.moves >= 5 * copies * sum(len(path) for path in system.paths)
        assert 5 <= run.decided / run.moves < 9


def test_the_page_gives_rows_of_the_table() -> None:
    """So that the table is the one place where figures are made."""
    page = (ROOT / "docs/studies/beside-zhou.md").read_text(encoding="utf-8")
    table = (ROOT / "analysis/tables/beside-zhou.md").read_text(encoding="utf-8").splitlines()
    runs = [row for row in page.splitlines() if " of 20 |" in row]
    assert len(runs) > 12
    for row in runs:
        assert row in table


def test_posts_grant_nothing_that_closes_a_circle_whatever_is_lost() -> None:
    """On a system of five where Algorithm 2 admits unsafe moves, with ten vehicles."""
    found = beside_zhou.decided(beside_zhou.wide(instance("unsound_n5"), 2), 2)
    assert found["grants"] > 50
    assert found["lost"] > 50
    assert {key: found[key] for key in WRONG} == dict.fromkeys(WRONG, 0)


def test_the_page_sums_the_decisions_of_the_table() -> None:
    """Grants, and refusals of safe moves by reason."""
    page = (ROOT / "docs/studies/beside-zhou.md").read_text(encoding="utf-8")
    table = (ROOT / "analysis/tables/beside-zhou.md").read_text(encoding="utf-8")
    part = table.split("## Decisions beside the central chain rule")[1].split("##")[0]
    rows = [row.strip("| ").split(" | ")[2:] for row in part.splitlines() if row.startswith("| ")][1:]
    grants, *rest = (sum(int(cell.replace(",", "")) for cell in column) for column in zip(*rows, strict=True))
    wrong, refused = rest[: len(WRONG)], rest[len(WRONG) :]
    assert f"in {grants:,} grants" in page
    assert not any(wrong)
    for why, many in zip(beside_zhou.REASONS, refused, strict=True):
        assert re.search(rf"`{why}` {many:,}\b", page), why
