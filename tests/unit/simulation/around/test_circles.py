"""How much room gated vehicles leave for ordinary ones in circles of places, without SUMO."""

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
from fake_traffic import whereabouts

from builders import system
from loopgate.simulation.around.circles import Circles
from loopgate.simulation.around.crossing_ways import Place, Way
from loopgate.simulation.around.sight import Sight
from loopgate.traffic.base import Dynamics

LEADS_TO = {"a": "b", "b": "c", "c": "a", "d": "a"}
ROADS = system(
    {f"v{state}": f"{state} {ahead}" for state, ahead in LEADS_TO.items()},
    capacity=dict.fromkeys(LEADS_TO, 3),
    fifo=tuple(LEADS_TO),
)


class Ring:
    """Places a, b and c of 24 m and three slots, whose vehicles go round; one at d wants to come into a."""

    def __init__(self, **standing: int) -> None:
        self.drivers: list[Any] = []
        self.lines: dict[str, list[int]] = {}
        for state in (*standing, "d"):
            count = standing.get(state, 1)
            self.lines[state] = list(range(len(self.drivers), len(self.drivers) + count))
            self.drivers += [self._driver(state, place) for place in range(count)]
        self.on: dict[str, tuple[str, float]] = {}
        self.routes: dict[str, list[str]] = {}
        traffic = Mock(
            now_s=0.0,
            whereabouts=lambda: whereabouts(**{v: (*at, 0.0) for v, at in self.on.items()}),
            parks=lambda _: False,
            dynamics=lambda _: Dynamics(5.0, 2.6, 4.5, 1.0),
            route=lambda v: (self.routes[v], 0),
        )
        keeper = Mock(
            number=lambda state: ROADS.states.index(state) if state in ROADS.states else None,
            slots=lambda _: 3,
            line=lambda number: self.lines.get(ROADS.states[number], []),
        )
        network: Any = SimpleNamespace(
            connections=[
                SimpleNamespace(from_edge=one, from_lane=0, to_edge=other, to_lane=0, via=())
                for one, other in (*LEADS_TO.items(), ("behind-c", "a"), ("foe", "a"))
            ]
        )
        self.sight = Sight(network, traffic, self.drivers)
        across: Any = SimpleNamespace(across=("foe_0",))
        ways: Any = {
            state: [Way("", 0.0, (across,), (f"behind-{state}_0",), next=Place("", 0.0, 0.0, ()))]
            for state in LEADS_TO
        }
        self.circles = Circles(network, keeper, self.drivers, ways, self.sight)
        self.circles.plan({state: Place(f"{state}_0", 0.0, 24.0, ()) for state in LEADS_TO})
        self.traffic = traffic

    def _driver(self, state: str, place: int) -> Any:  # noqa: ANN401  stands for a driver
        way = [state]
        while len(way) < 4:
            way.append(LEADS_TO[way[-1]])
        return SimpleNamespace(
            id=f"{state}{place}",
            robot=len(self.drivers),
            granted=0,
            row={"mover": False},
            track=SimpleNamespace(loop=state),
            length_m=5.0,
            front_m=24.0 - 7.5 * place,
            leg=lambda number: SimpleNamespace(state=way[number], away=False),
            end_m=lambda number: 24.0 * (number + 1),
        )

    def put(self, name: str, edge: str, position_m: float, route: str = "") -> None:
        """Put an ordinary vehicle on the road, with the rest of its route."""
        self.on[name] = f"{edge}_0", position_m
        self.routes[name] = [edge, *route.split()]

    def tight(self, state: str = "d", *, must_move: bool = False) -> bool:
        """Ask for the first vehicle of a place."""
        self.traffic.now_s += 10.0
        self.sight.look()
        robot = self.lines[state][0]
        self.drivers[robot].row["mover"] = must_move
        return self.circles.too_tight(robot)


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
    ring.drivers[ring.lines["c"][0]].front_m = 16.5
    ring.put("o", "c", 24.0)
    assert not ring.tight(must_move=True)
    ring.put("o", "c", 24.0, "a b")
    assert ring.tight(must_move=True)


@pytest.mark.parametrize("where", ["behind-c", "foe"])
def test_one_that_stands_on_a_crossing_goes_before_the_first_of_the_place(where: str) -> None:
    """That of c leaves the circle, but an ordinary vehicle stands in its way and is to go on round."""
    ring = Ring(a=2, b=3, c=2)
    ring.drivers[ring.lines["c"][0]].leg = lambda _: SimpleNamespace(state="d", away=False)
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
    ring = Ring()
    last = ring.drivers[0]
    last.leg = lambda number: SimpleNamespace(state="away d_0" if number else "d", away=bool(number))
    keeper: Any = ring.circles._keeper
    keeper.number, keeper.slots, keeper.line = (lambda _: 0), (lambda _: 2000), (lambda _: [])
    ring.circles.plan({"d": Place("d_0", 0.0, 24.0, ()), "away d_0": Place("d_0", -976.0, 24.0, ())})
    ring.put("o", "d", 10.0)
    assert not ring.tight()
