"""Plans of places for loops that come one after the other, and newcomers in places that are full."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from builders import system
from loopgate.errors import GateError
from loopgate.gates import make_gate
from loopgate.model import StateId
from loopgate.network import Loop, RoadNetwork, VehicleType, make_loop
from loopgate.simulation.attaching.plan import Plan
from loopgate.simulation.ledger_joining import refuse_crowd

CAR = VehicleType()
TRUCK = replace(CAR, id="truck", length_m=16.0)


@pytest.fixture(scope="module")
def roads() -> RoadNetwork:
    """Read the grid."""
    return RoadNetwork.open(Path(__file__).parents[4] / "networks" / "grid5-priority.net.xml")


def block(roads: RoadNetwork, name: str, corners: str) -> Loop:
    """Return the loop over these corners."""
    names = corners.split()
    return make_loop(roads, name, [a + b for a, b in zip(names, [*names[1:], names[0]], strict=True)])


def test_one_goes_on_with_another_that_leaves_its_places_as_they_are(roads: RoadNetwork) -> None:
    """A loop that crosses the first brings conflicts among its own movements only."""
    first, second = block(roads, "a", "B1 C1 C2 B2"), block(roads, "b", "C1 D1 D2 C2")
    plan = Plan(roads, ((first, CAR),))
    larger = plan.extended([(second, CAR)])
    assert larger.goes_on_with(plan)
    assert larger.extended([(first, CAR), (second, CAR)]) is larger
    new = {c.id for leg in larger.layout.itineraries["b"].legs for c in leg.crossings}
    foes = {foe for leg in larger.layout.itineraries["a"].legs for c in leg.crossings for foe in c.foes}
    assert new & foes


def test_longer_vehicles_make_it_another_plan(roads: RoadNetwork) -> None:
    """A place holds fewer of them, and those who are in it may be too many."""
    first, far = block(roads, "a", "B1 C1 C2 B2"), block(roads, "b", "C3 D3 D4 C4")
    plan = Plan(roads, ((first, CAR),))
    assert not plan.extended([(first, TRUCK)]).goes_on_with(plan)
    assert plan.extended([(far, TRUCK)]).goes_on_with(plan)


@pytest.mark.parametrize(("residents", "fine"), [(2, True), (3, False)])
def test_a_place_that_is_overfull_gives_nobody_a_slot(residents: int, *, fine: bool) -> None:
    """Two places of two slots, crossed by a third loop, are fit for two residents, whatever they hold now."""
    paths = {f"r{k}": "a b" for k in range(residents)} | {"x": "a c", "y": "c a"}
    now = {"a": 3, "b": 2, "c": 2}
    robots = system(paths, capacity=now, fifo=("a", "b", "c"), starts={"x": 1})
    gate = cast("Any", SimpleNamespace(promise="everyone"))
    room = {StateId(place): 2 for place in "abc"}
    if fine:
        refuse_crowd(gate, robots, room)
    else:
        with pytest.raises(GateError, match="not every vehicle"):
            refuse_crowd(gate, robots, room)
    refuse_crowd(cast("Any", SimpleNamespace(promise="somebody")), robots, room)


@pytest.mark.parametrize(("residents", "fine"), [(2, True), (3, False)])
def test_who_goes_round_leaves_room_for_who_is_to_pass_later(residents: int, *, fine: bool) -> None:
    """Nobody passes yet, so a gate can be made for all three; but no fourth could ever get through."""
    paths = {f"r{k}": "a b" for k in range(residents)}
    room = {"a": 2, "b": 2}
    robots = system(paths, capacity=room, fifo=("a", "b"), starts={"r1": 1})
    gate = make_gate("certified", robots)
    refuse_crowd(gate, robots, room)
    for way in ("x b y", "a away", "a b"):
        passing = [[StateId(state) for state in way.split()]]
        if fine or way == "a b":
            refuse_crowd(gate, robots, room, passing)
        else:
            with pytest.raises(GateError, match="not every vehicle"):
                refuse_crowd(gate, robots, room, passing)
