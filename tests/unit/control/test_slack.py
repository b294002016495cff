"""How much room vehicles leave for ordinary ones in circles of places."""

from __future__ import annotations

import pytest

from loopgate.control.blocking import outside
from loopgate.control.ledger import Ledger
from loopgate.control.places import ConflictGroup, Leg, Make, Movement, Pass, Place, Vehicle, joined
from loopgate.control.roads import BEYOND_M, Across, Lookout, Other, RoadEdge, RoadLane, RoadStretch
from loopgate.control.slack import Slack

LEADS_TO = {"a": "b", "b": "c", "c": "a", "d": "a", "behind-c": "a", "foe": "a"}
LOOPS = {"a": "abc", "b": "bca", "c": "cab", "d": "dabc", "leaves": "cd"}
CAR = Make(5.0, 2.6, 4.5, 10.0, 1.0)


class Ring:
    """Places a, b and c of 24 m and three slots, whose vehicles go round; one at d wants to come into a.

    `leaves`: whether the first at c is to leave the circle there, to d. `away`: the place in which vehicles
    arrive. `standing`: how many stand in each place.
    """

    def __init__(
        self, *, leaves: bool = False, away: str = "", everywhere: bool = False, **standing: int
    ) -> None:
        roads = (
            "a",
            "b",
            "c",
            "d",
            "behind-a",
            "behind-b",
            "behind-c",
            "behind-d",
            "foe",
            "elsewhere",
            "street",
        )
        self.edges = {name: RoadEdge(24.0, 10.0) for name in roads}
        self.lanes = {
            name: RoadLane(name, edge, 24.0, 10.0, inside=False) for name, edge in self.edges.items()
        }
        for name, to in LEADS_TO.items():
            self.lanes[name].ahead[self.edges[to]] = self.lanes[to]
        self._places = {name: Place(name, 3) for name in "abcd"}
        self._movement = Movement("over", ConflictGroup())
        self._away = away
        self.slack, self.ledger = Slack(everywhere=everywhere), Ledger([lambda *_: None])
        paths = {name: self._path(loop) for name, loop in LOOPS.items()}
        self.others: dict[str, Other] = {}
        for name in (*standing, "d"):
            for number in range(standing.get(name, 1)):
                path = paths["leaves" if leaves and name == "c" and number == 0 else name]
                one = self.ledger.take_in(f"{name}{number}", path, 0, CAR, 24.0 * len(path))
                one.front_m = 24.0 - 7.5 * number

    def _path(self, loop: str) -> list[Leg]:
        legs = [Leg(self._places[name], n, 24.0 * n, 24.0 * (n + 1)) for n, name in enumerate(loop)]
        for leg, name in zip(legs, loop, strict=True):
            behind = self.lanes[f"behind-{name}"]
            leg.stretch = RoadStretch(self.lanes[name], 0.0, 24.0, [], [behind], is_away=name == self._away)
            over = Pass(self._movement, 10.0, 0.0)
            over.lookout = Lookout([Across(self.lanes["foe"], 20.0, unseen=False)], [], 0.0, 20.0, 10.0)
            leg.passes = [over]
        joined(legs, closed=True)
        self.slack.know(legs)
        return legs

    def first(self, name: str) -> Vehicle:
        """Return the first vehicle in a place."""
        return self._places[name].line[0]

    def put(self, name: str, road: str, position_m: float, route: str = "") -> None:
        """Put an ordinary vehicle that stands, with the rest of its route, on the road, or elsewhere."""
        before = self.others.pop(name, None)
        if before is not None and before.lane is not None:
            before.lane.fronts.remove(before)
            for edge in self.edges.values():
                edge.coming.pop(before, None)
        other = self.others[name] = Other(name, 5.0, 2.6, 4.5, 1.0)
        other.parks, other.position_m = False, position_m
        other.lane = self.lanes[road]
        other.edges = [self.edges[edge] for edge in (road, *route.split())]
        other.lane.fronts.append(other)
        for edge in other.edges[1:]:
            edge.coming[other] = None

    def tight(self, name: str = "d", *, must_move: bool = False) -> bool:
        """Return whether the move of the first vehicle in a place leaves too little room."""
        self.first(name).mover = must_move
        return bool(self.slack.too_tight(self.first(name)))


def test_a_vehicle_that_comes_into_a_circle_leaves_room_for_one_more() -> None:
    """Of three slots in nine one must stay free to go round, and one for an ordinary vehicle."""
    assert not Ring(a=1, b=3, c=2).tight()
    assert Ring(a=1, b=3, c=3).tight()
    assert not Ring(a=1, b=3, c=3).tight(must_move=True)


def test_within_a_circle_one_may_go_on() -> None:
    """Else no vehicle could move."""
    assert not Ring(a=3, b=3, c=2).tight("b")


def test_ordinary_vehicles_take_room_in_a_circle() -> None:
    """It takes the slot of c, the last that goes round: then no vehicle may come, whatever it must."""
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
    ring.first("c").front_m = 16.5
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


def test_there_is_room_for_vehicles_that_are_about_to_come() -> None:
    """One that has a place of the circle among its next edges."""
    ring = Ring(a=1, b=3, c=2)
    ring.put("o", "elsewhere", 3.0, "street b")
    assert ring.tight()
    ring.put("o", "elsewhere", 3.0, "street")
    assert not ring.tight()


def test_a_share_of_a_place_stays_free() -> None:
    """The last of three slots, where no circle goes on, if an ordinary vehicle comes there."""
    ring = Ring(a=2, b=0, c=0)
    ring.put("o", "street", 3.0, "elsewhere")
    assert not ring.tight()
    assert Ring(a=2, b=0, c=0, everywhere=True).tight()
    ring.put("o", "street", 3.0, "a")
    assert ring.tight()
    assert not ring.tight(must_move=True)
    ring = Ring(a=1, b=0, c=0)
    ring.put("o", "street", 3.0, "a")
    assert not ring.tight()


def test_a_vehicle_that_arrives_is_in_no_other_ones_way() -> None:
    """Behind its last line is room for all there are, and no ordinary vehicle on its lane takes any of it."""
    for away in ("", "a"):
        ring = Ring(a=2, b=0, c=0, away=away)
        ring.put("o", "street", 3.0, "a")
        assert ring.tight() is not bool(away)
    ring.put("o", "a", 10.0)
    assert not ring.tight()


def test_any_other_vehicle_may_have_to_move_on_first() -> None:
    """Of those in the circle and those that could leave it: that is not told apart."""
    ring = Ring(a=1, b=3, c=3)
    ring.put("o", "street", 3.0)
    ring.ledger.ask(ring.first("d"))
    (some,) = outside(ring.first("d"), ring.slack, ring.ledger.vehicles.values())
    assert sorted(some) == ["a0", *(f"{name}{number}" for name in "bc" for number in range(3))]


@pytest.mark.parametrize(
    ("position_m", "there"), [(9.9, False), (10.0, True), (50.0 + BEYOND_M, True), (50.1 + BEYOND_M, False)]
)
def test_a_place_holds_ordinary_vehicles_from_its_beginning_to_just_past_its_line(
    position_m: float,
    there: bool,  # noqa: FBT001  a case
) -> None:
    other, lane = (
        Other("o", 5.0, 2.6, 4.5, 1.0),
        RoadLane("r", RoadEdge(90.0, 10.0), 90.0, 10.0, inside=False),
    )
    other.position_m = position_m
    assert RoadStretch(lane, 10.0, 50.0, [], []).holds(other) == there


def test_one_that_comes_into_an_empty_place_of_a_circle_goes_on_round() -> None:
    """It is the first there; the two slots beside it do not suffice with one more about to come."""
    ring = Ring(a=0, b=3, c=3)
    assert not ring.tight()
    ring.put("o", "elsewhere", 3.0, "street b")
    assert ring.tight()
