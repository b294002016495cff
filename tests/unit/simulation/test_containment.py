"""What counts as standing in others' way."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from loopgate.network.incidents import Breakdown, Incidents
from loopgate.simulation.containment import Containment


def driver(name: str, *, crossed: int) -> Any:  # noqa: ANN401  what is read of a vehicle
    """Return a vehicle that stands in its first place, with what lies before that cleared or not."""
    legs = [SimpleNamespace(state=f"p{n}") for n in range(3)]
    return SimpleNamespace(
        id=name,
        granted=1,
        held=range(1, 2),
        crossed=range(crossed, 1),
        speed_mps=0.0,
        settled=crossed == 1,
        leg=legs.__getitem__,
    )


@pytest.mark.parametrize(("crossed", "trapped"), [(0, True), (1, False)])
def test_who_stands_on_a_crossing_behind_a_breakdown_is_trapped(crossed: int, *, trapped: bool) -> None:
    """Also one that has left its last place: its rear is in the way of all that goes over the junction."""
    broken, behind = driver("broken", crossed=1), driver("behind", crossed=crossed)
    stuck: list[set[str]] = []
    withheld: list[set[str]] = []
    drivers = [broken, behind]
    leading = SimpleNamespace(
        driver_of={one.id: one for one in drivers},
        beside=set(),
        line=lambda _: [],
        shut=lambda _: None,
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
    for one in drivers:
        one.track = None
    contained = Containment(cast("Any", standing), *cast("Any", (ways, traffic, leading, recorder)))
    for traffic.now_s in (1.0, 30.0, 61.0, 62.0):
        contained.look()
    assert stuck[-1] == ({"after p0"} if trapped else set())
    assert withheld[-1] == {"broken"}
