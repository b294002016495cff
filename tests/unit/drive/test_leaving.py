"""Vehicles that go while they ask."""

import pytest
import service_cases


@pytest.mark.parametrize("leaving", [(0,), (1,), (0, 1)])
def test_who_goes_before_it_is_answered_is_looked_at_no_more(leaving: tuple[int, ...]) -> None:
    """All others are, whether they asked before or after; also in a step that has been decided before."""
    books = service_cases.books({"a": "p s", "b": "q s", "c": "r s"}, dict.fromkeys("pqrs", 3))
    assert books.decide(5.0) == []
    for robot in (0, 1, 2):
        books.asks(robot, 5.0)
    for robot in leaving:
        books.leaves(robot)
    assert (books.run["waiting"][0], books.run["fresh"][0]) == (3 - len(leaving),) * 2
    assert sorted(books.decide(5.0)) == [(robot, True, "free") for robot in (0, 1, 2) if robot not in leaving]
    assert books.decide(5.0) == []
