"""Pressure: fullest place first, and room kept where it is crowded, for a while."""

from random import Random

import pytest

from loopgate.errors import ScenarioError
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.negotiation.base import InformedNegotiation, Request
from loopgate.negotiation.registry import make_negotiation


class Road:
    """States that hold ten each, unless said otherwise."""

    def __init__(self, *held: int, slots: tuple[int, ...] = ()) -> None:
        self._held = held
        self._slots = slots or (10,) * len(held)

    def held(self, state: int) -> int:
        """As given."""
        return self._held[state]

    def room(self, state: int) -> int:
        """Their slots less those."""
        return self._slots[state] - self._held[state]


def order(road: Road, *requests: Request, now_s: float = 0.0) -> list[int]:
    made = make_negotiation("pressure:crowded=0.6", Random(1)).order(requests, road, now_s)
    return [request.robot for request in made]


def test_the_fullest_place_before_the_emptiest_goes_first() -> None:
    """0.5 - 0.1 before 0.3 - 0.1; a wait of 25 s counts as 0.4 of a place."""
    road = Road(3, 5, 1)
    assert order(road, Request(0, 0, 2, 0.0), Request(1, 1, 2, 0.0)) == [1, 0]
    assert order(road, Request(0, 0, 2, 0.0), Request(1, 1, 2, 25.0), now_s=25.0) == [0, 1]


def test_a_short_full_ring_goes_before_a_longer_queue() -> None:
    """2 of 2 before 5 of 10."""
    assert order(Road(5, 2, 1, slots=(10, 2, 10)), Request(0, 0, 2, 0.0), Request(1, 1, 2, 0.0)) == [1, 0]


def test_nobody_drives_into_a_crowded_place_that_is_fuller_than_its_own() -> None:
    """6 of 10 is crowded: from 7 one may, from 6 and 2 not yet."""
    road = Road(7, 6, 2, 6)
    assert order(road, Request(0, 0, 3, 0.0), Request(1, 1, 3, 0.0), Request(2, 2, 3, 0.0)) == [0]


def test_the_reserve_yields() -> None:
    """Four tenths of a place are waited out after 40 s, not before; all of one after 100 s."""
    road = Road(2, 6)
    assert order(road, Request(0, 0, 1, 0.0), now_s=39.0) == []
    assert order(road, Request(0, 0, 1, 0.0), now_s=41.0) == [0]


def test_options_without_meaning_are_refused() -> None:
    """Neither is a time of 0, nor a negative share."""
    with pytest.raises(ScenarioError, match="crowded=-1"):
        make_negotiation("pressure:crowded=-1", Random(1))
    with pytest.raises(ScenarioError, match="patience=0"):
        make_negotiation("pressure:patience=0", Random(1))


@pytest.mark.parametrize(("robots", "goes"), [(7, [0]), (8, [])])
def test_what_is_kept_free_follows_from_the_network(robots: int, goes: list[int]) -> None:
    """Of two places of ten 7 vehicles leave 0.65 of the slots free, 8 leave 0.6: then 6 of 10 is crowded."""
    road = Road(2, 6)
    made = make_negotiation("pressure", Random(1))
    assert isinstance(made, InformedNegotiation)
    paths = [Robot(RobotId(f"v{k}"), (StateId("p"), StateId("q")), start=k % 2) for k in range(robots)]
    made.prepare(System(paths, {StateId("p"): 10, StateId("q"): 10}))
    requests = [Request(0, 0, 1, 0.0)]
    assert [request.robot for request in made.order(requests, road, 0.0)] == goes


def test_without_a_system_there_is_no_reserve() -> None:
    """A full place is the gate's affair."""
    made = make_negotiation("pressure", Random(1))
    assert len(made.order([Request(0, 0, 1, 0.0)], Road(1, 10), 0.0)) == 1
