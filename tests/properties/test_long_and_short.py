"""Vehicles of several lengths, exhaustively: all that have a slot fit, and nobody is ever stuck."""

from collections import Counter

import mixed_lengths
import pytest
from mixed_lengths import look

from loopgate.control.places import Place


def seen(*, loops: bool = False) -> Counter[str]:
    """Look at some dozens of systems, of which the small ones count."""
    return look(range(40 if loops else 60), loops=loops, most=300 if loops else 450)


@pytest.mark.parametrize("loops", [False, True])
def test_all_fit_and_get_on(loops: bool) -> None:  # noqa: FBT001  a case
    """Also in configurations with more vehicles than the longest ones would leave room for."""
    found = seen(loops=loops)
    assert (found["do not fit"], found["stuck"]) == (0, 0)
    assert found["systems"] > 8
    assert found["with more vehicles than the longest"] > 100
    assert found["places without room for two of the longest"] > 2


def test_the_oracle_knows_metres_only() -> None:
    """Two of three units do not fit into five, whatever slots say."""
    vehicles = mixed_lengths.Vehicles(((0, 1), (0, 1)), (True, True), (3, 3), (5, 6))
    node = mixed_lengths.Node((((0, 0), (1, 0)), ()), frozenset())
    assert not vehicles.fit(node)
    assert vehicles.fit(vehicles.moved(node, 0))


def test_a_short_place_takes_one_long_vehicle_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the limit two of three units come to a place of four, which do not fit."""
    seeds = range(60)
    assert look(seeds, loops=False, most=450)["do not fit"] == 0
    monkeypatch.setattr(mixed_lengths, "Place", lambda *known: Place(*known[:4]))
    assert look(seeds, loops=False, most=450)["do not fit"] > 0
