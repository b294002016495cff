"""Vehicles of several lengths, exhaustively: all that have a slot fit, and nobody is ever stuck."""

from collections.abc import Iterator, Sequence

import mixed_lengths
import pytest
from mixed_lengths import look

from loopgate.control import circles, credits  # noqa: A004  a topic of long vehicles
from loopgate.control.circles import Circles
from loopgate.control.places import Leg, Place

SMALL = {
    False: [5, 6, 7, 8, 12, 14, 20, 22, 23, 24, 29, 31, 32, 34, 35, 36, 37, 42, 49, 52, 53, 55, 56, 57, 59],
    True: [2, 5, 6, 9, 11, 14, 15, 18, 19, 21, 22, 26, 28, 29, 31, 36, 37],
}
"""Those of the first systems, without and with loops, that have few configurations: `look` tells no more
of all of them, but looks at the others until they prove too large."""
FIRST = {False: range(60), True: range(40)}


@pytest.mark.parametrize("seeds", [SMALL, pytest.param(FIRST, marks=pytest.mark.slow)], ids=["small", "all"])
@pytest.mark.parametrize("loops", [False, True])
def test_all_fit_and_get_on(loops: bool, seeds: dict[bool, Sequence[int]]) -> None:  # noqa: FBT001  a case
    """Also in configurations with more vehicles than the longest ones would leave room for."""
    found = look(seeds[loops], loops=loops, most=300 if loops else 450)
    assert (found["do not fit"], found["stuck"]) == (0, 0)
    assert found["systems"] > 8
    assert found["with more vehicles than the longest"] > 100
    assert found["places without room for two of the longest"] > 2
    assert found["with vehicles on a stretch"] > 10
    assert found["with metres not kept where there is no circle"] > 100


def test_the_oracle_knows_metres_only() -> None:
    """Two of three units do not fit into five, whatever slots say."""
    vehicles = mixed_lengths.Vehicles(((0, 1), (0, 1)), (True, True), (3, 3), (5, 6))
    node = mixed_lengths.Node((((0, 0), (1, 0)), ()), frozenset())
    assert not vehicles.fit(node)
    assert vehicles.fit(vehicles.moved(node, 0))


@pytest.mark.parametrize(
    ("broken", "wrong"),
    [
        ("limit of what is kept", "do not fit"),
        ("what is kept", "do not fit"),
        ("walk", "stuck"),
        ("circles", "stuck"),
        ("new circles", "do not fit"),
    ],
)
def test_each_rule_is_needed(broken: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit in short places, metres kept ahead, and circles of full places or of ways when one comes."""
    if broken == "limit of what is kept":
        monkeypatch.setattr(mixed_lengths, "Place", lambda *known: Place(*known[:4]))
    elif broken == "what is kept":
        monkeypatch.setattr(Place, "extra_m", lambda *_: 0.0)
    elif broken == "circles":
        monkeypatch.setattr(Circles, "_circled", lambda _: set())
    elif broken == "new circles":
        monkeypatch.setattr(Circles, "closed_by", lambda *_: [])
    else:
        monkeypatch.setattr(credits, "circle_from", lambda _: [])
        monkeypatch.setattr(credits, "closes_by_entering", lambda _: False)
    assert any(look([seed], loops=False, most=450)[wrong] for seed in SMALL[False])


@pytest.mark.parametrize("linked", [True, False])
def test_who_changes_lanes_waits_for_both_lanes(linked: bool, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: FBT001  a case
    """Three come over the stretch and stand on it; four change lanes there, from where the three drive to."""
    ways = ((0, 2, 4),) * 3 + ((4, 0, 3),) * 4
    vehicles = mixed_lengths.Vehicles(ways, (True,) * 7, (1,) * 7, (2,) * 5, (0, 1), (2, 3), 1)
    if not linked:
        monkeypatch.setattr(circles, "_next_of", _only_the_next)
    every = mixed_lengths.Everything(vehicles, 2_000)
    assert (every.whole, every.unfit(), every.stuck() > 0) == (True, 0, not linked)
    assert every.stands_on_stretch > 0


def _only_the_next(leg: Leg) -> Iterator[Place]:
    """Yield the next place, and none beside it."""
    if leg.after is not None:
        yield leg.after.place
