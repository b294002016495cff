"""What counts as standing in others' way."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from loopgate.network.incidents import Breakdown, Incidents
from loopgate.simulation.containment import Containment


def diary(name: str, *, crossed: int) -> Any:  # noqa: ANN401  what is read of a vehicle
    """Return the diary of a vehicle that stands in its first place; its crossing before is cleared or not."""
    legs = [SimpleNamespace(state=f"p{n}") for n in range(3)]
    vehicle = SimpleNamespace(
        name=name,
        granted=1,
        holds=lambda: range(1, 2),
        crosses=lambda: range(crossed, 1),
        speed=0.0,
        is_settled=lambda: crossed == 1,
    )
    return SimpleNamespace(vehicle=vehicle, drawn=legs.__getitem__, track=None)


@pytest.mark.parametrize(("crossed", "trapped"), [(0, True), (1, False)])
def test_who_stands_on_a_crossing_behind_a_breakdown_is_trapped(crossed: int, *, trapped: bool) -> None:
    """Also one that has left its last place: its rear is in the way of all that goes over the junction."""
    diaries = {"broken": diary("broken", crossed=1), "behind": diary("behind", crossed=crossed)}
    stuck: list[set[str]] = []
    withheld: list[set[str]] = []
    leading = SimpleNamespace(
        diaries=diaries,
        beside=set(),
        line=lambda _: [],
        close=lambda *_: None,
        stand=lambda _: None,
        withhold=lambda vehicles: withheld.append(set(vehicles)),
    )
    ways = SimpleNamespace(
        junction=lambda leg: f"after {leg.state}",
        avoid=lambda _, junctions: stuck.append(set(junctions)),
        own=lambda _: None,
    )
    standing = SimpleNamespace(
        incidents=Incidents((), (Breakdown("broken", 0.0, 900.0),)), brakes=False, at_long_stop=list
    )
    traffic = SimpleNamespace(now_s=0.0)
    recorder = SimpleNamespace(note=lambda *_: None)
    contained = Containment(cast("Any", standing), *cast("Any", (ways, traffic, leading, recorder)))
    for traffic.now_s in (1.0, 30.0, 61.0, 62.0):
        contained.look()
    assert stuck[-1] == ({"after p0"} if trapped else set())
    assert withheld[-1] == {"broken"}
