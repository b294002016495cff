"""A vehicle at a red light inside its crossing lets others go first: two vehicles, without SUMO."""

from __future__ import annotations

import pytest
from fake_traffic import FakeTraffic

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control.lamps import Lamp, Signal
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.lending import Lending
from loopgate.control.lights import PATIENCE_S, Lights
from loopgate.control.places import Leg, Make, Vehicle
from loopgate.control.rules import crossing, room
from loopgate.model import StateId
from loopgate.traffic.base import Light, Phase, Program

LIGHT_M = 70.0
"""Where the light stands on the way of the vehicle that lends, whose stop line is at 50 m [m]."""


class Scene:
    """A vehicle `lender` at a red light inside, 20 m behind its stop line; another, `other`, waits.

    A third one, `behind`, has the same way as the lender.

    Behind the light their ways share 10 m. `into`: the place to which the other goes. `fixed`: whether the
    light has a fixed program. `inside`: whether the lender has left its stop line.
    """

    def __init__(self, into: str = "south", *, fixed: bool = True, inside: bool = True) -> None:
        before = Crossing("west>between", frozenset(), speed_mps=10.0)
        behind = Crossing("between>east", frozenset({"north>"}), {"north>": (22.0, 32.0)}, 10.0, 20.0)
        across = Crossing("north>", frozenset({"between>east"}), {"between>east": (2.0, 12.0)}, 10.0)
        ways = [
            (DrawnLeg(StateId("west"), 0.0, 50.0, (before, behind)), DrawnLeg(StateId("east"), 90.0, 150.0)),
            (DrawnLeg(StateId("north"), 0.0, 50.0, (across,)), DrawnLeg(StateId(into), 70.0, 130.0)),
        ]
        self.traffic = FakeTraffic({})
        phases = Phase("G", 1000.0, 1), Phase("r", 1000.0, 0)
        self.traffic.programs["t"] = Program(phases, fixed=fixed)
        self.shows("r")
        layout = PlaceLayout(
            dict.fromkeys(("west", "east", "north", "south"), 3),
            ways,
            {"between>east": Signal(Lamp("t", self.traffic), 0, 10.0)},
        )
        self.ledger = Ledger([room, crossing])
        self.lights, self.lending = Lights(self.traffic), Lending(self.traffic, self.ledger)
        make = Make(5.0, 2.6, 4.5, 10.0, 1.0, foreseen=False)
        self.lender, self.other = (
            self.ledger.take_in(name, layout.path(way), 0, make, 1000.0)
            for name, way in zip(("lender", "other"), ways, strict=True)
        )
        self.behind = self.ledger.take_in("behind", layout.path(ways[0]), 0, make, 1000.0)
        self.lender.front_m = self.other.front_m = 49.0
        self.behind.front_m = 40.0
        self.ledger.ask(self.lender)
        self.step()
        self.drive(self.lender, LIGHT_M - 1.0 if inside else 49.5)
        self.ledger.ask(self.other)

    def shows(self, letter: str, changes_s: float = 1000.0) -> None:
        """Let the light show a letter until a time."""
        self.traffic.lights["t"] = Light(letter, changes_s, "p", 0 if letter == "G" else 1)

    def drive(self, vehicle: Vehicle, front_m: float) -> None:
        """Let a vehicle drive on and stand there."""
        vehicle.front_m, vehicle.speed = front_m, 0.0
        self.ledger.passed(vehicle)

    def step(self, at_s: float | None = None) -> None:
        """Answer requests, and look at the lights."""
        self.traffic.now_s = self.traffic.now_s + 1.0 if at_s is None else at_s
        gone = self.ledger.answer(self.traffic.now_s)
        self.lights.look(gone)
        self.lending.look(self.lights.at_red)

    def waits(self, steps: int = 3) -> bool:
        """Return whether the other vehicle has no grant after some steps."""
        for _ in range(steps):
            self.step()
        return self.other.asks

    @property
    def is_held(self) -> bool:
        """Whether the lender has been told to stay."""
        return "lender" in self.traffic.standing


def test_it_lends_at_red_and_the_light_holds_it() -> None:
    scene = Scene()
    assert not scene.waits()
    assert scene.lending.lent == 1
    assert not scene.is_held


def test_it_sets_out_when_the_other_is_past() -> None:
    scene = Scene()
    assert not scene.waits()
    scene.shows("G", 2000.0)
    scene.step(1001.0)
    assert [scene.is_held, scene.lender.lends, scene.lender.claims] == [True] * 3
    scene.drive(scene.other, 68.0)
    scene.step()
    assert [scene.is_held, scene.lender.lends, scene.lender.claims] == [False] * 3
    assert scene.lender.trips[1].number > scene.other.trips[0].number


def test_a_light_that_may_open_at_any_time_does_not_hold_it() -> None:
    scene = Scene(fixed=False)
    scene.shows("r", 0.0)
    scene.step(1001.0)
    assert scene.is_held
    scene.shows("G", 2000.0)
    scene.ledger.withdraw(scene.other)
    scene.step()
    assert not scene.is_held


def test_it_is_not_held_while_it_closes_up_behind_others() -> None:
    """A limit of speed would brake it less than SUMO's drivers can, and bring it too near the one ahead."""
    scene = Scene()
    scene.step()
    scene.ledger.ask(scene.other)
    scene.lender.front_m, scene.lender.speed = LIGHT_M - 15.0, 2.0
    scene.shows("G", 2000.0)
    scene.ledger.grant(scene.other)
    scene.step(1001.0)
    far = scene.is_held
    scene.lender.front_m = LIGHT_M - 5.0
    scene.step()
    assert (far, scene.is_held) == (False, True)


def test_nobody_new_goes_first_once_its_light_is_open() -> None:
    scene = Scene()
    scene.ledger.withdraw(scene.other)
    scene.step()
    scene.shows("G", 2000.0)
    scene.step(1001.0)
    scene.ledger.ask(scene.other)
    assert scene.waits()
    assert not scene.lender.lends


def test_after_long_it_claims_at_red_too() -> None:
    scene = Scene()
    scene.ledger.withdraw(scene.other)
    scene.step()
    before = scene.lender.claims
    scene.step(PATIENCE_S + 10.0)
    assert (before, scene.lender.claims) == (False, True)
    scene.ledger.ask(scene.other)
    assert scene.waits()


def test_it_lends_nothing_before_it_stands_inside() -> None:
    assert Scene(inside=False).waits()
    scene = Scene()
    scene.lender.speed = 1.0
    assert scene.waits()


def test_it_lends_nothing_while_one_with_a_grant_may_count_on_it_to_go() -> None:
    scene = Scene()
    scene.ledger.grant(scene.other)
    scene.step()
    before = scene.lender.lends
    scene.drive(scene.other, 68.0)
    scene.step()
    assert (before, scene.lender.lends) == (False, True)


def test_who_gets_a_grant_behind_one_that_lends_is_behind_at_once() -> None:
    """Others that are answered in the same step must not go first behind it."""
    scene = Scene()
    scene.ledger.withdraw(scene.other)
    scene.step()
    scene.ledger.ask(scene.behind)
    scene.ledger.answer(scene.traffic.now_s + 1.0)
    assert [scene.behind.asks, scene.behind.behind, scene.other.behind] == [False, True, False]


@pytest.mark.parametrize(("slots", "counts"), [(2, True), (3, False)])
def test_who_counts_on_one_behind_to_leave_a_place_is_behind_too(slots: int, counts: bool) -> None:  # noqa: FBT001  a case
    """Three hold slots of the place, with the lender: one more than there are, or as many."""
    scene = Scene()
    scene.ledger.withdraw(scene.other)
    scene.step()
    scene.ledger.grant(scene.behind)
    west = scene.behind.bodies[0].place
    comes = scene.ledger.take_in("comes", [Leg(west)], 0)
    west.slots = slots
    scene.step()
    assert (scene.behind.behind, comes.behind) == (True, counts)


def test_a_vehicle_to_the_same_place_does_not_go_first() -> None:
    assert Scene(into="east").waits()


def test_a_vehicle_that_leaves_the_ledger_is_forgotten() -> None:
    scene = Scene()
    scene.step()
    scene.ledger.leave(scene.lender)
    scene.lights.forget(scene.lender)
    scene.lending.forget(scene.lender)
    assert not scene.waits()
