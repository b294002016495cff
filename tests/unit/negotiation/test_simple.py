"""Chance and seniority."""

from collections import Counter
from random import Random

import pytest

from loopgate.errors import ScenarioError
from loopgate.negotiation.base import Request
from loopgate.negotiation.registry import make_negotiation


class Empty:
    """A road with nobody on it."""

    def held(self, state: int) -> int:
        """Nobody."""
        del state
        return 0

    def room(self, state: int) -> int:
        """One."""
        del state
        return 1


REQUESTS = [Request(0, 0, 9, 30.0), Request(1, 1, 9, 10.0), Request(2, 2, 9, 10.0)]


def test_oldest_first_ties_go_by_number() -> None:
    """Since 10 s before since 30 s."""
    order = make_negotiation("oldest", Random(1)).order(REQUESTS, Empty(), 40.0)
    assert [request.robot for request in order] == [1, 2, 0]


def test_random_is_fair_and_repeats_by_seed() -> None:
    """Each wins a third of the time; the same seed gives the same winners."""
    winners = [
        [make.order(REQUESTS, Empty(), 40.0)[0].robot for _ in range(3000)]
        for make in (make_negotiation("random", Random(5)), make_negotiation("random", Random(5)))
    ]
    assert winners[0] == winners[1]
    assert all(abs(count - 1000) < 120 for count in Counter(winners[0]).values())


def test_an_unknown_name_lists_the_known() -> None:
    """The way out is in the message."""
    said = "negotiation luck: there is no such negotiation; installed are .*oldest, .*random"
    with pytest.raises(ScenarioError, match=said):
        make_negotiation("luck", Random(1))
