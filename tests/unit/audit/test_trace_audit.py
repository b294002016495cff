"""The audit: every rule, broken once."""

import pandas as pd
import pytest

from builders import system
from loopgate.audit import audit_events
from loopgate.model import Robot, RobotId, System
from loopgate.results.columns import EVENT_COLUMNS

SYSTEM = system({"r1": "p a", "r2": "q a"})
"""Two robots that share the state a, of capacity 1."""

Row = tuple[float, str, str, str]

START: list[Row] = [(0.0, "r1", "start", "p"), (0.0, "r2", "start", "q")]
ROUND: list[Row] = [
    (1.0, "r1", "grant", "a"),
    (2.0, "r1", "enter", "a"),
    (3.0, "r1", "leave", "p"),
    (4.0, "r1", "grant", "p"),
    (5.0, "r1", "enter", "p"),
    (6.0, "r1", "leave", "a"),
    (7.0, "r2", "grant", "a"),
]


def trace(rows: list[Row]) -> pd.DataFrame:
    """Make an event table; reasons do not matter."""
    return pd.DataFrame([(*row, "") for row in rows], columns=list(EVENT_COLUMNS[:5]))


def rules(rows: list[Row], **more: object) -> set[str]:
    """Return the rules that the audit finds broken."""
    return {finding.rule for finding in audit_events(trace(rows), SYSTEM, **more)}  # type: ignore[arg-type]


def test_a_correct_trace_is_clean() -> None:
    """One robot goes round, the other follows into the state it left."""
    assert rules(START + ROUND, laps={"r1": 1}) == set()


@pytest.mark.parametrize(
    ("rows", "rule"),
    [
        ([*START, ROUND[0], (1.0, "r2", "grant", "a")], "capacity"),
        ([*START, *ROUND[:5], (6.0, "r2", "grant", "a")], "capacity"),  # the rear has not left yet
        ([*START, (1.0, "r1", "grant", "q")], "path"),
        ([(0.0, "r1", "start", "a"), START[1]], "path"),
        ([*START, (1.0, "r1", "enter", "a")], "trespass"),
        ([*START, (1.0, "r1", "leave", "p")], "release"),
        ([*START, ROUND[0], (2.0, "r1", "leave", "a")], "release"),
        ([START[0]], "start"),
        ([*START, (1.0, "r1", "collision", "lane")], "collision"),
        ([*START, (1.0, "r1", "teleport", "lane")], "teleport"),
    ],
)
def test_each_rule_is_found_broken(rows: list[Row], rule: str) -> None:
    """A trace with one thing wrong breaks the rule that says so."""
    assert rule in rules(rows)


def test_more_laps_than_grants_allow() -> None:
    """A lap takes as many grants as the path has states."""
    assert rules(START + ROUND, laps={"r1": 3}) == {"laps"}


def test_starvation_is_found_when_asked_for() -> None:
    """r2 is granted nothing before 7 s."""
    assert rules(START + ROUND, starved_after_s=6.0) == {"progress"}
    assert rules(START + ROUND, starved_after_s=7.0) == set()


def test_fifo_order() -> None:
    """Of two in a FIFO state, the one that came second may not be granted the way out first."""
    queue = system({"r1": "f x", "r2": "f y"}, capacity={"f": 2}, fifo=("f",))
    rows = [(0.0, "r1", "start", "f"), (0.0, "r2", "start", "f"), (1.0, "r2", "grant", "y")]
    assert [finding.rule for finding in audit_events(trace(rows), queue)] == ["order"]


ROAD = system({"r1": "f g away", "r2": "f g away"}, capacity={"f": 2, "g": 1, "away": 9}, fifo=("f", "g"))
"""Two that drive once over two places."""

COMES: list[Row] = [(0.0, "r1", "start", "f"), (1.0, "r2", "start", "f")]
TO_G: list[Row] = [(2.0, "r1", "grant", "g"), (3.0, "r1", "enter", "g"), (4.0, "r1", "leave", "f")]
OFF: Row = (5.0, "r1", "end", "g")


def on_road(rows: list[Row], **more: object) -> list[str]:
    """Return the rules that are broken by those who drive once, one after another."""
    once = System(
        (Robot(one.id, one.path, closed=False, start=one.start) for one in ROAD.robots),
        ROAD.capacity,
        ROAD.fifo,
    )
    return [finding.rule for finding in audit_events(trace(rows), once, **more)]  # type: ignore[arg-type]


def test_who_comes_and_arrives_in_order_is_clean() -> None:
    """The place of the first is free for the second as soon as it has gone."""
    assert on_road([*COMES, *TO_G, OFF, (6.0, "r2", "grant", "g")]) == []


@pytest.mark.parametrize(
    ("rows", "broken"),
    [
        ([*COMES, (2.0, "r1", "end", "f")], ["exit"]),  # not at the end of its way
        ([*COMES, *TO_G, (5.0, "r1", "end", "f")], ["release"]),  # from where it is no longer
        ([*COMES, *TO_G[:2], (5.0, "r1", "end", "g")], ["release"]),  # its rear is in the place before still
        ([*COMES, *TO_G, OFF, (6.0, "r1", "leave", "g")], ["release"]),  # it had gone
        ([*COMES, *TO_G, OFF, (6.0, "r1", "enter", "g")], ["trespass"]),
        ([*COMES, *TO_G, OFF, (6.0, "r1", "grant", "away")], ["start"]),
        ([*COMES, *TO_G, OFF, (6.0, "r1", "start", "f")], ["entry"]),  # once is once
        ([*COMES, (2.0, "r1", "start", "f")], ["entry"]),
        ([(0.0, "r1", "start", "g"), COMES[1]], ["path"]),  # not where its way begins
        ([COMES[1], COMES[0], (2.0, "r1", "grant", "g")], ["order"]),  # the other was there before it
        ([*COMES, *TO_G, (5.0, "r2", "grant", "g")], ["capacity"]),  # nobody has gone yet
    ],
)
def test_who_comes_or_goes_otherwise_is_found(rows: list[Row], broken: list[str]) -> None:
    """One thing wrong, one finding."""
    assert on_road(rows) == broken


def test_who_has_a_grant_to_leave_a_queue_takes_no_slot_there() -> None:
    """In a state for one it takes the slot until its rear has left."""
    ways = system(
        dict.fromkeys(("r1", "r2", "r3"), "f g h"),
        capacity={"f": 3, "g": 2, "h": 3},
        fifo=("f", "g", "h"),
    )
    rows: list[Row] = [(0.0, name, "start", "f") for name in ("r1", "r2", "r3")]
    rows += [(1.0, "r1", "grant", "g"), (2.0, "r2", "grant", "g")]
    assert [one.rule for one in audit_events(trace([*rows, (3.0, "r3", "grant", "g")]), ways)] == ["capacity"]
    rows.append((3.0, "r1", "grant", "h"))
    assert audit_events(trace([*rows, (4.0, "r3", "grant", "g")]), ways) == []


def test_who_comes_into_a_full_place_is_found() -> None:
    """Those that join are judged by the rooms of a run; the third in a place of two is one too many."""
    third = Robot(RobotId("r3"), ROAD.robots[0].path, closed=False)
    rows: list[Row] = [*COMES, (1.0, "r3", "start", "f")]
    room = {str(state): most for state, most in ROAD.capacity.items()}
    assert on_road(rows, joined=[third], room=room) == ["capacity"]
    assert on_road([*COMES, *TO_G, (4.0, "r3", "start", "f")], joined=[third], room=room) == []
