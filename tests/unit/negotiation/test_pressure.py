"""Pressure: longest queue first, and room kept where it is crowded, for a while."""

from random import Random

import pytest

from loopgate.errors import ScenarioError
from loopgate.negotiation.base import Request
from loopgate.negotiation.registry import make_negotiation


class Road:
    """States that hold ten each."""

    def __init__(self, *held: int) -> None:
        self._held = held

    def held(self, state: int) -> int:
        """As given."""
        return self._held[state]

    def room(self, state: int) -> int:
        """Ten less those."""
        return 10 - self._held[state]


def order(road: Road, *requests: Request, now_s: float = 0.0) -> list[int]:
    made = make_negotiation("pressure", Random(1)).order(requests, road, now_s)
    return [request.robot for request in made]


def test_the_longest_queue_behind_the_emptiest_place_goes_first() -> None:
    """5 - 1 before 3 - 1; 25 s of waiting count as five vehicles."""
    road = Road(3, 5, 1)
    assert order(road, Request(0, 0, 2, 0.0), Request(1, 1, 2, 0.0)) == [1, 0]
    assert order(road, Request(0, 0, 2, 0.0), Request(1, 1, 2, 25.0), now_s=25.0) == [0, 1]


def test_nobody_drives_into_a_crowded_place_that_is_fuller_than_its_own() -> None:
    """6 of 10 is crowded: from 7 one may, from 6 and 2 not yet."""
    road = Road(7, 6, 2, 6)
    assert order(road, Request(0, 0, 3, 0.0), Request(1, 1, 3, 0.0), Request(2, 2, 3, 0.0)) == [0]


def test_the_reserve_yields() -> None:
    """A difference of four vehicles is waited out after 400 s, not before."""
    road = Road(2, 6)
    assert order(road, Request(0, 0, 1, 0.0), now_s=399.0) == []
    assert order(road, Request(0, 0, 1, 0.0), now_s=401.0) == [0]


def test_options_without_meaning_are_refused() -> None:
    """All three are positive."""
    with pytest.raises(ScenarioError, match="patience=0"):
        make_negotiation("pressure:patience=0", Random(1))
