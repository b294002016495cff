"""Grants only into green, and which vehicles drive on at amber: one vehicle before lights, without SUMO."""

from __future__ import annotations

import pytest
from fake_traffic import FakeTraffic

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control.lamps import Lamp, Signal
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.lights import Lights, light, passes_lights
from loopgate.control.places import Make
from loopgate.control.refusal import Refusal
from loopgate.control.rules import usual
from loopgate.model import StateId
from loopgate.traffic.base import Light, Phase, Program

LINE_M = 100.0


class Scene:
    """A vehicle whose first leg ends at 100 m, before crossings with lights.

    `ahead`, `after`: the lights behind the first leg and the second, and how far behind [m].
    """

    def __init__(
        self,
        *ahead: tuple[str, float],
        after: tuple[tuple[str, float], ...] = (),
        at_m: float = 99.0,
        speed: float = 0.0,
    ) -> None:
        way = (
            DrawnLeg(StateId("a"), 0.0, LINE_M, self._crossings(ahead)),
            DrawnLeg(StateId("b"), 150.0, 300.0, self._crossings(after)),
        )
        self.traffic = FakeTraffic({})
        signals = {f"over {name}": Signal(Lamp(name, self.traffic), 0, 10.0) for name, _ in (*ahead, *after)}
        path = PlaceLayout({"a": 2, "b": 2}, [way], signals).path(way)
        self.lights = Lights(self.traffic)
        self.ledger = Ledger([light, lambda *_: Refusal("deadlock")])
        self.car = self.ledger.take_in("car", path, 0, Make(5.0, 2.6, 4.5, 10.0, 1.0), lap_m=400.0)
        self.car.front_m, self.car.speed = at_m, speed

    @staticmethod
    def _crossings(ahead: tuple[tuple[str, float], ...]) -> tuple[Crossing, ...]:
        return tuple(
            Crossing(f"over {name}", frozenset(), speed_mps=10.0, ahead_m=ahead_m) for name, ahead_m in ahead
        )

    def shows(
        self, name: str, letter: str, changes_s: float, *, after: str = "r", fixed: bool = True
    ) -> None:
        """Let a light show a letter until a time, then another for 1000 s."""
        self.traffic.lights[name] = Light(letter, changes_s, "p", 0)
        phases = Phase(letter, 50.0, 1), Phase(after, 1000.0, 0)
        self.traffic.programs[name] = Program(phases, fixed=fixed)

    def keeps(self) -> bool:
        """Return whether a light keeps the vehicle, which asks, and is refused for something else if not."""
        self.ledger.ask(self.car)
        self.ledger.wake(self.car)
        self.ledger.answer(self.traffic.now_s)
        self.lights.look([], [self.car])
        return self.car.reason == "red"

    def let_go(self) -> None:
        """Let the vehicle have its next leg."""
        self.ledger.ask(self.car)
        self.ledger.grant(self.car)
        self.lights.look([self.car])

    def look(self) -> None:
        """Look at the vehicle in a step of its own."""
        self.lights.look([])

    def drives_on(self) -> bool:
        """Return whether the simulator has been told that the vehicle drives on whatever the light shows."""
        return self.car.name in self.traffic.heedless


@pytest.mark.parametrize("letter", ["r", "y", "u"])
def test_nothing_is_granted_into_red_or_yellow(letter: str) -> None:
    scene = Scene(("t", 0.1))
    scene.shows("t", letter, 30.0, after="G")
    assert scene.keeps()


@pytest.mark.parametrize("letter", ["G", "g", "O"])
def test_green_or_no_light_lets_pass(letter: str) -> None:
    """Also green with others that go first, and a light that is off."""
    scene = Scene(("t", 0.1))
    scene.shows("t", letter, 30.0)
    assert not scene.keeps()


@pytest.mark.parametrize(("letter", "kept"), [("r", False), ("G", True)])
def test_nothing_is_kept_for_a_vehicle_at_red(letter: str, *, kept: bool) -> None:
    """The next place is full for two minutes: at red nobody passes the vehicle over, at green some might."""
    scene = Scene(("t", 0.1))
    ledger, car, after = scene.ledger, scene.car, scene.car.leg.after
    assert after is not None
    ledger.rules[:] = usual()
    for name in ("x", "y"):
        ledger.take_in(name, [car.leg, after], 1, car.make, lap_m=400.0)
    scene.shows("t", letter, 500.0)
    ledger.ask(car)
    for now_s in range(121):
        ledger.answer(float(now_s))
    assert car.reason == ("occupied" if kept else "red")
    assert (after.place.kept_for is car) is kept


def test_a_slow_driver_has_to_be_over_the_line_before_red() -> None:
    """From standing, 60 m at 10 m/s take 9 s at least; amber is used."""
    late, amber, soon = (Scene(("t", 0.1), at_m=40.0) for _ in range(3))
    late.shows("t", "G", 6.0)
    amber.shows("t", "G", 11.0, after="y")
    soon.shows("t", "G", 20.0)
    assert late.keeps()
    assert not amber.keeps()
    assert not soon.keeps()


def test_a_green_that_comes_in_the_next_step_is_green() -> None:
    """The light changes at the beginning of the step, before any vehicle moves."""
    scene = Scene(("t", 0.1))
    scene.shows("t", "r", 0.0, after="G")
    assert not scene.keeps()


def test_a_vehicle_kept_at_red_is_asked_about_again_when_it_turns_green() -> None:
    """Of a fixed program that is known, so it is not asked about before."""
    scene = Scene(("t", 0.1))
    scene.shows("t", "r", 30.0, after="G")
    scene.ledger.ask(scene.car)
    asked = []
    for now_s in range(33):
        scene.traffic.now_s = float(now_s)
        if now_s == 31:
            scene.shows("t", "G", 1000.0)
        before = scene.ledger.looked_at
        scene.ledger.answer(float(now_s))
        if scene.ledger.looked_at > before:
            asked.append(now_s)
    assert asked == [0, 30, 31, 32]  # from then on the last rule refuses it
    assert scene.car.reason == "deadlock"


def test_a_vehicle_that_was_let_go_drives_on_at_amber_and_stops_for_a_red_only_if_it_can() -> None:
    """Near the line at speed it is too late to brake: that is counted."""
    stops, passes = Scene(("t", 0.1), at_m=40.0, speed=10.0), Scene(("t", 0.1), at_m=95.0, speed=10.0)
    for scene in (stops, passes):
        scene.shows("t", "G", 30.0)
        scene.let_go()
        assert not scene.drives_on(), "the light is green"
        scene.shows("t", "r", 1000.0)
        scene.traffic.now_s = 31.0
        scene.look()
    assert not stops.drives_on()
    assert passes.drives_on()
    passes.car.front_m = 100.5
    passes.look()
    assert not passes.drives_on()
    assert passes.lights.on_red == 1


@pytest.mark.parametrize(
    ("changes_s", "fixed", "yields", "told"),
    [
        (30.0, True, False, False),
        (1.0, True, False, True),
        (1.0, False, False, True),
        (30.0, False, False, False),
        (30.0, True, True, True),
    ],
)
def test_the_simulator_is_told_that_a_vehicle_drives_on_before_the_light_closes(
    changes_s: float, *, fixed: bool, yields: bool, told: bool
) -> None:
    """In the step before amber; at once where that may come any time, or SUMO's right of way is kept."""
    scene = Scene(("t", 0.1), at_m=95.0, speed=10.0)
    scene.traffic.gives_way = yields
    scene.shows("t", "G", changes_s, after="y", fixed=fixed)
    scene.let_go()
    scene.traffic.now_s = 1.0
    scene.look()
    assert scene.drives_on() is told


@pytest.mark.parametrize(
    ("second_m", "fixed", "waited_s", "sure"),
    [
        (30.0, True, 0.0, True),
        (30.0, False, 0.0, False),
        (60.0, True, 0.0, False),
        (30.0, True, 180.0, False),
    ],
)
def test_which_vehicles_pass_all_lights_for_sure_if_these_let_them_go(
    second_m: float, waited_s: float, *, fixed: bool, sure: bool
) -> None:
    """Not a light that is far, nor a second one that changes with the traffic, nor after a long wait."""
    scene = Scene(("t", 0.1), ("u", second_m))
    scene.shows("t", "G", 30.0, fixed=False)
    scene.shows("u", "G", 30.0, fixed=fixed)
    scene.keeps()
    scene.car.refused_s["red"] = -waited_s
    assert passes_lights(scene.car, 0.0) is sure


def two_lights(*, at_m: float) -> Scene:
    """Return a vehicle that was let go over two junctions, one after the other, both lights green."""
    scene = Scene(("t", 0.1), after=(("u", 0.1),), at_m=at_m, speed=10.0)
    for name in "tu":
        scene.shows(name, "G", 30.0)
    scene.let_go()
    scene.let_go()
    return scene


def test_a_vehicle_over_the_line_of_one_light_still_drives_on_at_amber_at_the_next() -> None:
    """It was let go there too."""
    scene = two_lights(at_m=95.0)
    scene.car.front_m = 101.0
    scene.shows("u", "y", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert scene.drives_on()
    scene.car.front_m = 301.0
    scene.look()
    assert not scene.drives_on()


def test_a_vehicle_that_stops_at_a_light_is_not_let_through_it_by_a_grant_beyond() -> None:
    """It drives on at the second light when it is over the line of the first, which it waits for."""
    scene = two_lights(at_m=40.0)
    scene.look()
    scene.shows("t", "r", 1000.0)
    scene.shows("u", "y", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert not scene.drives_on()
    scene.let_go()
    scene.look()
    assert not scene.drives_on()
    scene.car.front_m = 101.0
    scene.look()
    assert scene.drives_on()


def test_before_a_green_arrow_a_vehicle_stops() -> None:
    """It heeds the light as SUMO's drivers do."""
    scene = Scene(("t", 0.1))
    scene.shows("t", "s", 30.0)
    assert not scene.keeps()
    scene.let_go()
    scene.shows("t", "r", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert not scene.drives_on()


@pytest.mark.parametrize(("letter", "kept"), [("G", False), ("s", True)])
def test_a_stop_before_a_green_arrow_takes_time(letter: str, *, kept: bool) -> None:
    """A vehicle is over the line 1.2 s after it sets out; it stops for three seconds before."""
    scene = Scene(("t", 0.1))
    scene.shows("t", letter, 3.0)
    assert scene.keeps() is kept


@pytest.mark.parametrize(("letter", "drives_on"), [("G", True), ("s", False)])
def test_a_vehicle_with_a_green_arrow_does_not_drive_on_when_that_ends(
    letter: str, *, drives_on: bool
) -> None:
    """Not even near the line at speed."""
    scene = Scene(("t", 0.1), at_m=95.0, speed=10.0)
    scene.shows("t", letter, 30.0)
    scene.let_go()
    scene.shows("t", "r", 1000.0)
    scene.traffic.now_s = 31.0
    scene.look()
    assert scene.drives_on() is drives_on


def test_all_lights_on_one_crossing_have_to_be_green_on_arrival() -> None:
    """The second light turns before the vehicle gets to it; it need not be green yet if it will be."""
    scene = Scene(("t", 0.1), ("u", 40.0))
    scene.shows("t", "G", 30.0)
    scene.shows("u", "G", 3.0)
    assert scene.keeps()
    scene = Scene(("t", 0.1), ("u", 40.0))
    scene.shows("t", "G", 30.0)
    scene.shows("u", "r", 2.0, after="G")
    assert not scene.keeps()


@pytest.mark.parametrize(
    ("ahead_m", "red_s", "kept"), [(60.0, 20.0, False), (60.0, 40.0, True), (40.0, 20.0, True)]
)
def test_a_vehicle_may_stand_at_a_light_far_ahead_for_a_while(
    ahead_m: float, red_s: float, *, kept: bool
) -> None:
    """It is there after eight seconds; a longer wait would keep others from their crossings."""
    scene = Scene(("t", ahead_m))
    scene.shows("t", "r", red_s, after="G")
    assert scene.keeps() is kept


@pytest.mark.parametrize("far_m", [40.0, 60.0])
def test_a_light_that_changes_with_the_traffic_is_of_no_account_far_ahead(far_m: float) -> None:
    """Nobody knows when it turns green."""
    scene = Scene(("t", far_m))
    scene.shows("t", "r", 1000.0, fixed=False)
    assert scene.keeps() is (far_m < 50.0)


def test_where_lights_are_never_green_together_a_vehicle_sets_out_for_the_shortest_wait_inside() -> None:
    """The first is green from 0 to 40 s of 90 s, the second, 20 m on, from 45 to 85 s: it leaves at 36 s."""
    scene = Scene(("t", 0.1), ("u", 20.0))
    scene.traffic.programs["t"] = Program((Phase("G", 40.0, 1), Phase("r", 50.0, 0)), fixed=True)
    scene.traffic.programs["u"] = Program(
        (Phase("r", 45.0, 1), Phase("G", 40.0, 2), Phase("r", 5.0, 0)), fixed=True
    )
    scene.traffic.lights |= {"t": Light("G", 40.0, "p", 0), "u": Light("r", 45.0, "p", 0)}
    left_s = []
    for second in range(40):
        scene.traffic.now_s = float(second)
        if not scene.keeps():
            left_s.append(second)
    assert left_s == [36, 37]


def test_lights_that_are_never_green_together_do_not_keep_a_vehicle_for_ever() -> None:
    """After three minutes only the first light counts, so that its turning green is enough."""
    scene = Scene(("t", 0.1), ("u", 40.0))
    scene.shows("t", "G", 1000.0)
    scene.shows("u", "r", 1000.0)
    assert scene.keeps()
    scene.traffic.now_s = 179.0
    assert scene.keeps()
    scene.traffic.now_s = 180.0
    assert not scene.keeps()
    scene.shows("t", "r", 2000.0)
    scene.traffic.now_s = 1001.0
    assert scene.keeps()


def test_standing_at_a_red_with_a_grant_is_counted() -> None:
    """The light turns after the grant; the vehicle stands for three steps, then passes."""
    scene = Scene(("t", 0.1))
    scene.shows("t", "G", 5.0)
    scene.let_go()
    assert scene.lights.stood == 0
    scene.shows("t", "r", 1000.0)
    scene.traffic.now_s = 6.0
    for _ in range(3):
        scene.look()
    scene.car.front_m, scene.car.speed = 102.0, 5.0
    scene.look()
    scene.car.speed = 0.0
    scene.look()
    assert (scene.lights.grants, scene.lights.stood, scene.lights.stood_s) == (1, 1, 3.0)


def test_the_longest_wait_for_green_is_known_with_its_light() -> None:
    """It lasts as long as the vehicle waits, and is kept when that goes on."""
    scene = Scene(("t", 0.1))
    scene.shows("t", "r", 1000.0)
    assert scene.keeps()
    scene.traffic.now_s = 40.0
    waited_s, over = scene.lights.longest()
    assert (waited_s, over) == (40.0, scene.car.leg.passes[0])
    scene.shows("t", "G", 2000.0)
    scene.traffic.now_s = 1001.0
    scene.let_go()
    scene.traffic.now_s = 1100.0
    waited_s, over = scene.lights.longest()
    assert waited_s == 1001.0
    assert over is not None
    assert over.movement.name == "over t"


def test_a_wait_for_something_else_is_none_for_green() -> None:
    """The light is green after 31 s; what keeps the vehicle then is no light."""
    scene = Scene(("t", 0.1))
    scene.shows("t", "r", 30.0, after="G")
    assert scene.keeps()
    scene.shows("t", "G", 2000.0)
    scene.traffic.now_s = 31.0
    assert not scene.keeps()
    scene.traffic.now_s = 500.0
    assert scene.lights.longest()[0] == 31.0


@pytest.mark.parametrize(("red_at_s", "kept"), [(10.5, True), (10.7, False)])
def test_a_slow_driver_speeds_up_by_six_tenths_to_nine_tenths(red_at_s: float, kept: bool) -> None:  # noqa: FBT001
    """At 1.56 m/s2 it comes to 9 m/s in 26 m, and takes 9.6 s for the 60 m; a second is to spare."""
    scene = Scene(("t", 0.1), at_m=40.0)
    scene.shows("t", "G", red_at_s)
    assert scene.keeps() == kept
