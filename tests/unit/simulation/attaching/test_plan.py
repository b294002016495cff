"""Plans of places for loops that come one after the other, and newcomers in places that are full."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from loopgate.gates.certified.crowding import find_crowd
from loopgate.network import Loop, RoadNetwork, VehicleType, make_loop
from loopgate.simulation.attaching.plan import Plan

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
    """A loop that crosses the first brings conflicts of its own movements, none between earlier movements."""
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
def test_vehicles_that_go_round_leave_room_for_one_that_is_to_pass_later(
    residents: int, *, fine: bool
) -> None:
    """Nobody passes yet, so all three could go round; but no fourth could ever get through."""
    a, b, x, y = range(4)
    slots, loops = [2, 2, 2, 2], [[a, b]] * residents
    assert find_crowd(loops, slots, ()) is None
    for passing in ([x, b, y], [a, y]):
        assert (find_crowd(loops, slots, [passing]) is None) is fine
