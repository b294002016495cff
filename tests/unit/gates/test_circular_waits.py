"""Circular waits in the wait-for graph."""

import pytest

from loopgate.gates.deadlocks import circular_wait, deadlocked


def test_a_circle_is_stuck() -> None:
    """Each waits for the next and the last for the first: nobody can ever move."""
    waits = {"a": [["b"]], "b": [["c"]], "c": [["a"]]}
    assert deadlocked(waits) == {"a", "b", "c"}
    assert circular_wait(waits, {"a", "b", "c"}) == ["a", "b", "c"]


def test_who_waits_for_a_circle_is_stuck_too_but_not_in_it() -> None:
    """A follower of a circle never moves again; the circle is named without it."""
    waits = {"z": [["a"]], "a": [["b"]], "b": [["a"]]}
    assert deadlocked(waits) == {"a", "b", "z"}
    assert circular_wait(waits, {"a", "b", "z"}) == ["a", "b"]


def test_a_chain_to_a_moving_vehicle_is_not_stuck() -> None:
    """The head of the chain waits for someone who is no key: it moves, and the others after it."""
    assert deadlocked({"a": [["b"]], "b": [["c"]]}) == set()


def test_of_every_set_some_vehicle_must_move() -> None:
    """An alternative frees; a second set that is stuck does not let go."""
    circle = {"a": [["b"]], "b": [["a"]]}
    assert deadlocked({**circle, "x": [["a", "free"]]}) == {"a", "b"}
    assert deadlocked({**circle, "x": [["a", "free"], ["b"]]}) == {"a", "b", "x"}


def test_nobody_to_wait_for_is_no_deadlock() -> None:
    """A vehicle that stands without a reason counts as able to go on."""
    assert deadlocked({"a": []}) == set()


@pytest.mark.parametrize("order", [["a", "b", "c"], ["c", "b", "a"], ["b", "c", "a"]])
def test_the_circle_does_not_depend_on_the_order_of_the_keys(order: list[str]) -> None:
    """Ties go to the smallest id."""
    edges = {"a": [["b", "c"]], "b": [["a"]], "c": [["a"]]}
    waits = {vehicle: edges[vehicle] for vehicle in order}
    assert circular_wait(waits, deadlocked(waits)) == ["a", "b"]
