"""How much room gated vehicles leave for ordinary ones in circles of places, without SUMO."""

from collections.abc import Sequence
from unittest.mock import Mock

import pytest
from fake_traffic import whereabouts
from ordinary_scene import Found, Watched, road_network

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Track
from loopgate.drive import step as drive
from loopgate.model import StateId
from loopgate.simulation.around.crossing_ways import Movement, Place, Way
from loopgate.traffic.base import Dynamics

LEADS_TO = {"a": "b", "b": "c", "c": "a", "d": "a"}
LOOPS = {"a": "abc", "b": "bca", "c": "cab", "d": "dabc"}


def track(vehicle: str, loop: str, front_m: float, *, away: Sequence[str] = ()) -> Track:
    """Return a vehicle in the first place of its loop, each of whose places has 24 m."""
    legs = [Leg(StateId(state), 24.0 * n, 24.0 * (n + 1), away=state in away) for n, state in enumerate(loop)]
    return Track(vehicle, loop, 24.0 * len(loop), front_m, 10.0, (), ((0.0, loop[0]),), tuple(legs))


class Ring(Watched):
    """Places a, b and c of 24 m and three slots, whose vehicles go round; one at d wants to come into a.

    The first of those at c may be to leave the circle there, to d.
    """

    def __init__(self, *, leaves: bool = False, away: Sequence[str] = (), **standing: int) -> None:
        tracks: list[Track] = []
        self.first: dict[str, int] = {}
        for state in (*standing, "d"):
            self.first[state] = len(tracks)
            for place in range(standing.get(state, 1)):
                loop = "cd" if leaves and state == "c" and place == 0 else LOOPS[state]
                tracks.append(track(f"{state}{place}", loop, 24.0 - 7.5 * place, away=away))
        paths = {one.vehicle: " ".join(one.loop) for one in tracks}
        self.on: dict[str, tuple[str, float]] = {}
        self.routes: dict[str, list[str]] = {}
        traffic = Mock(
            now_s=0.0,
            step_s=1.0,
            whereabouts=lambda: whereabouts(**{v: (*at, 0.0) for v, at in self.on.items()}),
            parks=lambda _: False,
            dynamics=lambda _: Dynamics(5.0, 2.6, 4.5, 1.0),
            route=lambda v: (self.routes[v], 0),
            route_id=lambda v: " ".join(self.routes[v]),
        )
        roads = [*LEADS_TO, *(f"behind-{state}" for state in LEADS_TO), "foe", "elsewhere", "street"]
        network = road_network(
            dict.fromkeys(roads, 24.0), [*LEADS_TO.items(), ("behind-c", "a"), ("foe", "a")]
        )
        movement = Movement(0.0, ("foe_0",), (), (), 20.0, 10.0, 0.0)
        places = {state: Place(f"{state}_0", 0.0, 24.0, ()) for state in LEADS_TO}
        ways = {
            loop: [
                Way(f"{state}_0", 24.0, (movement,), (f"behind-{state}_0",), places[ahead])
                for state, ahead in zip(loop, loop[1:] + loop[0], strict=True)
            ]
            for loop in (*LOOPS.values(), "cd")
        }
        robots = system(paths, capacity=dict.fromkeys("abcd", 3), fifo=tuple("abcd"))
        super().__init__(robots, tracks, traffic, network, Found(ways, places))
        for driver in self.engine.drivers:
            driver.drives_like(traffic.dynamics(driver.id))

    def put(self, name: str, edge: str, position_m: float, route: str = "") -> None:
        """Put an ordinary vehicle on the road, with the rest of its route."""
        self.on[name] = f"{edge}_0", position_m
        self.routes[name] = [edge, *route.split()]

    def tight(self, state: str = "d", *, must_move: bool = False) -> bool:
        """Ask for the first vehicle of a place."""
        self.traffic.now_s += 10.0
        self.look()
        robot = self.first[state]
        self.engine.vehicles["mover"][robot] = must_move
        return bool(self.keeper.ask(drive.TIGHT, robot))


def test_who_comes_into_a_circle_leaves_room_for_one_more() -> None:
    """Of three slots in nine one must stay free to go round, and one for an ordinary vehicle."""
    assert not Ring(a=1, b=3, c=2).tight()
    assert Ring(a=1, b=3, c=3).tight()
    assert not Ring(a=1, b=3, c=3).tight(must_move=True)


def test_within_a_circle_one_may_go_on() -> None:
    """Nobody could move else."""
    assert not Ring(a=3, b=3, c=2).tight("b")


def test_ordinary_vehicles_take_room_in_a_circle() -> None:
    """It takes the slot of c, the last that goes round: then nobody may come, whatever it must."""
    ring = Ring(a=1, b=3, c=2)
    ring.put("o", "c", 24.0 - 15.0, "a b")
    assert ring.tight()
    assert not ring.tight(must_move=True)
    ring = Ring(a=2, b=3, c=2)
    assert not ring.tight(must_move=True)
    ring.put("o", "c", 24.0 - 15.0, "a b")
    assert ring.tight(must_move=True)


def test_one_that_is_first_and_leaves_opens_the_circle() -> None:
    """Its route ends beyond c, or leads on round."""
    ring = Ring(a=2, b=3, c=2)
    ring.engine.vehicles["front"][ring.first["c"]] = 16.5
    ring.put("o", "c", 24.0)
    assert not ring.tight(must_move=True)
    ring.put("o", "c", 24.0, "a b")
    assert ring.tight(must_move=True)


@pytest.mark.parametrize("where", ["behind-c", "foe"])
def test_one_that_stands_on_a_crossing_goes_before_the_first_of_the_place(where: str) -> None:
    """That of c leaves the circle, but an ordinary vehicle stands in its way and is to go on round."""
    ring = Ring(a=2, b=3, c=2, leaves=True)
    assert not ring.tight(must_move=True)
    ring.put("o", where, 3.0, "a b")
    ring.put("p", "c", 9.0, "elsewhere")
    assert ring.tight(must_move=True)


def test_room_for_those_who_are_about_to_come() -> None:
    """One that has a place of the circle among its next edges."""
    ring = Ring(a=1, b=3, c=2)
    ring.put("o", "elsewhere", 3.0, "street b")
    assert ring.tight()
    ring.put("o", "elsewhere", 3.0, "street")
    assert not ring.tight()


def test_a_share_of_a_place_stays_free() -> None:
    """The last of three slots, where no circle goes on."""
    ring = Ring(a=2, b=0, c=0)
    assert ring.tight()
    assert not ring.tight(must_move=True)
    assert not Ring(a=1, b=0, c=0).tight()


def test_who_arrives_is_never_in_anybodys_way() -> None:
    """Behind its last line is room for all there are, and no ordinary vehicle on its lane takes any of it."""
    assert Ring(a=2, b=0, c=0).tight()
    ring = Ring(a=2, b=0, c=0, away="a")
    ring.put("o", "a", 10.0)
    assert not ring.tight()


def test_anybody_else_may_have_to_move_on_first() -> None:
    """Of those in the circle and those that could leave it: that is not told apart."""
    ring = Ring(a=1, b=3, c=3)
    ring.put("o", "street", 3.0)
    assert ring.is_barred(ring.first["d"])
    (some,) = ring.blockers(ring.first["d"])
    assert sorted(some) == ["a0", *(f"{state}{place}" for state in "bc" for place in range(3))]
