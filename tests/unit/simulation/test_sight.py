"""What is foreseen of a vehicle: how long it takes behind one that stands, if it may have to wait."""

import math
from collections import deque
from types import SimpleNamespace

import pytest

from loopgate.abstraction.itinerary import Crossing
from loopgate.simulation.driver import Joint
from loopgate.simulation.sight import Sight, _braking_time_s


@pytest.mark.parametrize(
    ("distance", "room", "top"), [(10.0, 12.0, 10.0), (10.0, 60.0, 10.0), (5.0, 5.5, 3.0)]
)
def test_the_time_behind_a_standing_vehicle(distance: float, room: float, top: float) -> None:
    """Driven in small steps at the speed from which a second and the brakes are enough, it takes as long."""
    decel, step_s = 4.5, 1e-4
    driven, time_s = 0.0, 0.0
    while driven < distance:
        gap = room - driven
        driven += min(top, math.sqrt(decel**2 + 2 * decel * gap) - decel) * step_s
        time_s += step_s
    assert _braking_time_s(distance, room, top, decel) == pytest.approx(time_s, abs=0.01)


def test_without_room_it_never_gets_there() -> None:
    """It would stop before; and with nobody before it, nothing slows it down."""
    assert _braking_time_s(10.0, 10.0, 10.0, 4.5) == math.inf
    assert _braking_time_s(10.0, math.inf, 10.0, 4.5) == 0.0


@pytest.mark.parametrize(("grant", "front_m", "held"), [(1, 60.0, True), (1, 66.0, False), (3, 60.0, False)])
def test_one_may_have_to_wait_for_one_that_was_granted_before_it_and_is_in_its_way(
    grant: int,
    front_m: float,
    held: bool,  # noqa: FBT001  a case
) -> None:
    """Its leg ends at 50 m; 5 m long, it is past what both use, up to 10 m on, with its front at 65.5 m."""
    mine = Crossing("mine", frozenset({"theirs"}), {"theirs": (2.0, 9.0)})
    theirs = Crossing("theirs", frozenset({"mine"}), {"mine": (3.0, 10.0)})
    drivers = [
        SimpleNamespace(
            robot=robot,
            length=5.0,
            crossed=0,
            behind=deque([Joint(50.0, 70.0, number)]),
            position=lambda leg: leg,
            end_m=lambda _: 50.0,
        )
        for robot, number in ((0, 2), (1, grant))
    ]
    ways = [SimpleNamespace(legs=[SimpleNamespace(crossings=(crossing,))]) for crossing in (mine, theirs)]
    system = SimpleNamespace(paths=[])
    occupancy = SimpleNamespace(foes_on_way=lambda *_: [(1, "theirs")])
    fleet = SimpleNamespace(fronts=[55.0, front_m])
    sight = Sight(drivers, ways, fleet, system, occupancy)  # type: ignore[arg-type]  # what is looked at
    assert sight._may_be_held(drivers[0], 0) == held  # type: ignore[arg-type]  # as above
