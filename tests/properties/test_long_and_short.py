"""Vehicles of several lengths, exhaustively: all that have a slot fit, and nobody is ever stuck."""

from collections import Counter

import mixed_lengths
import pytest
from mixed_lengths import look

from loopgate.control import credits  # noqa: A004  a topic of long vehicles
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


@pytest.mark.parametrize(
    ("broken", "wrong"),
    [("limit of what is kept", "do not fit"), ("what is kept", "do not fit"), ("walk", "stuck")],
)
def test_each_rule_is_needed(broken: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit in short places, the metres kept ahead, and the walk along full places when one comes."""
    if broken == "limit of what is kept":
        monkeypatch.setattr(mixed_lengths, "Place", lambda *known: Place(*known[:4]))
    elif broken == "what is kept":
        monkeypatch.setattr(Place, "extra_m", lambda *_: 0.0)
    else:
        monkeypatch.setattr(credits, "circle_from", lambda _: [])
        monkeypatch.setattr(credits, "closes_by_entering", lambda _: False)
    assert any(look([seed], loops=False, most=450)[wrong] for seed in range(60))
