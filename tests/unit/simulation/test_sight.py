"""What is foreseen of a vehicle: how long it takes behind one that stands, if it may have to wait."""

import math
from collections import deque
from types import SimpleNamespace

import pytest

from loopgate.abstraction.itinerary import Crossing
from loopgate.drive.driver import Joint
from loopgate.drive.motion import braking_time_s
from loopgate.simulation.sight import Sight


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
    assert braking_time_s(distance, room, top, decel) == pytest.approx(time_s, abs=0.01)


def test_without_room_it_never_gets_there() -> None:
    """It would stop before; and with nobody before it, nothing slows it down."""
    assert braking_time_s(10.0, 10.0, 10.0, 4.5) == math.inf
    assert braking_time_s(10.0, math.inf, 10.0, 4.5) == 0.0


class Stub(SimpleNamespace):
    """A driver of 5 m whose first leg ends at 50 m and whose second begins at 70 m."""

    def __init__(self, robot: int, grant: int) -> None:
        super().__init__(robot=robot, length=5.0, crossed=0, granted=1, accel=2.6, decel=4.5, top=13.9)
        self.line_m = 50.0
        self.behind = deque([Joint(50.0, 70.0, grant)])

    def position(self, leg: int) -> int:
        """Return the leg: the first lap."""
        return leg

    def end_m(self, _: int) -> float:
        """Return where the first leg ends [m]."""
        return 50.0


def sight_of(drivers: list[Stub], fronts: list[float], *, foresees: bool = True) -> Sight:
    """Let the first be on ``mine`` and the second on ``theirs``, which share some metres."""
    mine = Crossing("mine", frozenset({"theirs"}), {"theirs": (2.0, 9.0)}, 13.9)
    theirs = Crossing("theirs", frozenset({"mine"}), {"mine": (3.0, 10.0)}, 13.9)
    ways = [SimpleNamespace(legs=[SimpleNamespace(crossings=(crossing,))]) for crossing in (mine, theirs)]
    occupancy = SimpleNamespace(foes_on_way=lambda *_: [(1, "theirs")], holders=lambda _: [1])
    fleet = SimpleNamespace(fronts=fronts, speeds=[0.0, 10.0])
    system = SimpleNamespace(paths=[(0, 1), (0, 1)])
    return Sight(drivers, ways, fleet, system, occupancy, foresees=foresees)  # type: ignore[arg-type]  # what is looked at


@pytest.mark.parametrize(("grant", "front_m", "held"), [(1, 60.0, True), (1, 66.0, False), (3, 60.0, False)])
def test_one_may_have_to_wait_for_one_that_was_granted_before_it_and_is_in_its_way(
    grant: int,
    front_m: float,
    held: bool,  # noqa: FBT001  a case
) -> None:
    """Its leg ends at 50 m; 5 m long, it is past what both use, up to 10 m on, with its front at 65.5 m."""
    drivers = [Stub(0, 2), Stub(1, grant)]
    sight = sight_of(drivers, [55.0, front_m])
    assert sight._may_be_held(drivers[0], 0) == held  # type: ignore[arg-type]  # a stub


def test_where_vehicles_give_way_to_others_nothing_is_foreseen() -> None:
    """The second is on the shared stretch and fast, the first 30 m away. Past it, it is out of the way."""
    mine = Crossing("mine", frozenset({"theirs"}), {"theirs": (2.0, 9.0)}, 13.9)
    for front_m, foresees, free in ((60.0, True, True), (60.0, False, False), (65.6, False, True)):
        drivers = [Stub(0, 2), Stub(1, 1)]
        drivers[0].behind.clear()
        sight = sight_of(drivers, [20.0, front_m], foresees=foresees)
        sight._occupancy.foes_on_way = lambda *_: []  # type: ignore[method-assign]  # it is alone with the first
        assert sight.in_the_way(0, mine, 1, "theirs") != free
