"""The watch names circular waits, and only those."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from collections.abc import Set as AbstractSet
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from fake_traffic import whereabouts

from loopgate.arrays import Floats
from loopgate.simulation.watching.ahead import Ahead, Future
from loopgate.simulation.watching.deadlock_detector import Deadlock, DeadlockDetector, Root, ToldRefusal
from loopgate.simulation.watching.road_waits import RoadWaits
from loopgate.simulation.watching.trails import Trails
from loopgate.traffic.base import Traffic

LONG_S = 300.0


class Standing:
    """Traffic in which nobody moves; `waits` says who waits for whom on the road."""

    def __init__(self, waits: dict[str, list[str]]) -> None:
        self.waits = waits
        self.now_s = 0.0
        self.at_m = dict.fromkeys(waits, 0.0)
        self.pausing: set[str] = set()
        self.awaiting: set[str] = set()
        self.ways: dict[str, list[list[str]]] = {}
        self.standing: Collection[str] = ()
        self.restless: AbstractSet[str] = frozenset()
        self.lasting: AbstractSet[str] | None = None

    def vehicles(self) -> Sequence[str]:
        return list(self.waits)

    def odometers(self, vehicles: Sequence[str]) -> Floats:
        return np.array([self.at_m[vehicle] for vehicle in vehicles])

    def lane(self, vehicle: str) -> tuple[str, float]:
        return f"lane of {vehicle}", 0.0

    def at_own_stop(self, vehicle: str) -> bool:
        return vehicle in self.pausing

    def awaits_lot(self, vehicle: str) -> bool:
        return vehicle in self.awaiting

    def look(self, standing: Collection[str], restless: AbstractSet[str]) -> None:
        self.standing, self.restless = standing, restless

    def suppose(self, lasting: AbstractSet[str] | None) -> None:
        self.lasting = lasting

    def of(self, vehicle: str, stood_s: float) -> list[list[str]]:
        del stood_s
        return [[other] for other in self.waits[vehicle]]

    def by_each_way(self, vehicle: str) -> list[list[str]]:
        return self.ways.get(vehicle, [])

    def cause(self, vehicle: str) -> str:
        return f"cause of {vehicle}"


def looked_at(traffic: Standing) -> tuple[Traffic, RoadWaits]:
    """Return the traffic as what `DeadlockDetector` takes."""
    return cast("Traffic", traffic), cast("RoadWaits", traffic)


class Gates:
    """Who is refused by a gate, and by whom."""

    def __init__(self, refused: dict[str, list[str]]) -> None:
        self.refused = refused

    def __call__(self, vehicle: str) -> ToldRefusal | None:
        others = self.refused.get(vehicle)
        return None if others is None else lambda: ([others], f"state {vehicle} wants")


def named(
    watch: DeadlockDetector,
    traffic: Standing,
    *,
    at_s: float = math.inf,
    change: Callable[[], object] = list,
    until_s: float = LONG_S,
) -> Iterator[Deadlock]:
    """Check every ten seconds, with a change of the traffic before one check; yield what is found."""
    while traffic.now_s < until_s:
        traffic.now_s += 10.0
        if traffic.now_s == at_s:
            change()
        deadlock = watch.check()
        if deadlock is not None:
            yield deadlock


def watched(traffic: Standing, gates: Gates | None = None) -> list[tuple[float, tuple[str, ...]]]:
    """Return time and circle of what is found."""
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, at_gate=gates)
    found = list(named(watch, traffic))
    assert all(deadlock.closed_at_s == 10.0 for deadlock in found)
    return [(deadlock.noticed_at_s, deadlock.vehicles) for deadlock in found]


def test_a_circle_on_the_road_is_named_once() -> None:
    """Three wait for each other, a fourth behind them; they stand from the first check at 10 s on."""
    traffic = Standing({"a": ["b"], "b": ["c"], "c": ["a"], "d": ["a"]})
    assert watched(traffic) == [(70.0, ("a", "b", "c"))]


def test_who_is_at_a_stop_of_its_own_goes_on() -> None:
    """And so do those behind it; when it still stands a minute after its stop, the two are in a deadlock."""
    traffic = Standing({"a": ["b"], "b": ["a"]})
    traffic.pausing = {"b"}
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    found = named(watch, traffic, at_s=500.0, change=traffic.pausing.clear, until_s=900.0)
    assert [deadlock.noticed_at_s for deadlock in found] == [550.0]


def test_who_waits_for_a_lot_goes_on_when_one_is_free() -> None:
    """The next behind it may come so near that it keeps it from backing away; it does not have to."""
    traffic = Standing({"a": ["b"], "b": ["a"]})
    traffic.awaiting = {"a"}
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    assert list(named(watch, traffic, until_s=900.0)) == []


def test_jams_are_of_those_that_may_stand_for_good() -> None:
    """Not of whoever stands just now."""
    traffic = Standing({"a": ["b"], "b": ["a"], "x": ["y"], "y": []})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    for traffic.now_s in range(0, 100, 10):
        watch.check()
    assert traffic.lasting == {"a", "b"}


def test_who_creeps_stands() -> None:
    """A millimetre a second, as SUMO's drivers move up to their leaders, does not reset the clock."""
    traffic = Standing({"a": ["b"], "b": ["a"]})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    found = []
    while traffic.now_s < LONG_S:
        traffic.now_s += 10.0
        traffic.at_m["a"] += 0.01 if traffic.now_s > 30.0 else 5.0
        found += [deadlock] if (deadlock := watch.check()) else []
    assert [(one.closed_at_s, one.noticed_at_s) for one in found] == [(30.0, 90.0)]


@pytest.mark.parametrize(("creeps_m", "until_s"), [(0.004, 450.0), (0.0, 150.0)])
def test_who_creeps_is_restless_for_long(creeps_m: float, until_s: float) -> None:
    """Under half a millimetre a second, which no single check shows."""
    traffic = Standing({"a": ["b"], "b": []})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    last_s = 0.0
    while traffic.now_s < 2 * LONG_S:
        traffic.now_s += 10.0
        traffic.at_m["a"] += 5.0 if traffic.now_s <= 30.0 else creeps_m if traffic.now_s <= 350.0 else 0.0
        watch.check()
        last_s = traffic.now_s if "a" in traffic.restless else last_s
    assert last_s <= until_s
    assert (last_s > 350.0) == (creeps_m > 0.0)


def test_whoever_has_broken_down_waits_for_nobody() -> None:
    """Two that stand across each other's way: no circle until the one that broke down could go again."""
    traffic, halted = Standing({"a": ["b"], "b": ["a"]}), {"b"}
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, halted=halted)
    assert list(named(watch, traffic)) == []
    halted.clear()
    assert [deadlock.vehicles for deadlock in named(watch, traffic, until_s=2 * LONG_S)] == [("a", "b")]


def test_the_circle_that_closed_first_is_named_with_its_time() -> None:
    """A and b come first by name, but c and d stood 20 s before them; both are seen at the same check."""
    traffic = Standing({"a": ["b"], "b": [], "c": ["d"], "d": []})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    found = []
    while traffic.now_s < LONG_S:
        traffic.now_s += 10.0
        for name in "abcd" if traffic.now_s <= 100.0 else "ab" if traffic.now_s <= 120.0 else "":
            traffic.at_m[name] += 100.0
        if traffic.now_s == 200.0:
            traffic.waits |= {"b": ["a"], "d": ["c"]}
        found += [deadlock] if (deadlock := watch.check()) else []
    assert [(one.closed_at_s, one.vehicles, one.held_up) for one in found] == [(100.0, ("c", "d"), 4)]


def test_who_stood_for_good_before_several_ways_was_in_it_from_then_on() -> None:
    """Positions do not say whether a wants the way where b stands, or that where c came to stand later."""
    traffic = Standing({"a": ["c"], "b": ["a"], "c": ["a"]})
    traffic.ways = {"a": [["b"], ["c"]]}
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    found = []
    while traffic.now_s < LONG_S:
        traffic.now_s += 10.0
        traffic.at_m["c"] += 100.0 if traffic.now_s <= 100.0 else 0.0
        found += [deadlock] if (deadlock := watch.check()) else []
    assert [(one.closed_at_s, one.noticed_at_s, one.vehicles) for one in found] == [(10.0, 160.0, ("a", "b"))]


def test_a_queue_is_no_deadlock() -> None:
    """The head waits for nobody."""
    assert watched(Standing({"a": ["b"], "b": ["c"], "c": []})) == []


def test_a_circle_may_lead_through_gates_and_road() -> None:
    """A is refused because of b, and b stands behind a on the road."""
    assert watched(Standing({"a": [], "b": ["a"]}), Gates({"a": ["b"]})) == [(70.0, ("a", "b"))]


@pytest.mark.parametrize("let_go_s", [70.0, 100.0])
def test_who_was_let_go_just_now_is_not_stuck(let_go_s: float) -> None:
    """B stood at its gate for long; let go, it yields to a for a moment, while a is refused because of b.

    Only if b still stands there a minute after it was last refused do the two block each other.
    """
    traffic = Standing({"a": [], "b": ["a"]})
    gates = Gates({"a": ["b"], "b": ["somebody who drives"]})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, at_gate=gates)
    found = named(watch, traffic, at_s=let_go_s, change=lambda: gates.refused.pop("b"))
    assert [(d.closed_at_s, d.noticed_at_s) for d in found] == [(let_go_s - 10.0, let_go_s + 50.0)]


def test_newcomers_behind_a_named_circle_are_not_named_again() -> None:
    """A vehicle that joins the queue later is held up by the same circle."""
    traffic = Standing({"a": ["b"], "b": ["a"], "c": []})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    found = named(watch, traffic, at_s=150.0, change=lambda: traffic.waits.update(c=["a"]))
    assert [deadlock.vehicles for deadlock in found] == [("a", "b")]
    assert watch.held_up == {"a", "b", "c"}


def test_a_circle_that_a_named_one_holds_up_is_not_named() -> None:
    """Two ordinary vehicles stand for good; one of them waits for a gated one too, which waits for them."""
    traffic = Standing({"a": ["b"], "b": ["a"], "c": []})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, own="c")
    found = named(
        watch, traffic, at_s=150.0, change=lambda: traffic.waits.update({"a": ["c", "b"], "c": ["b"]})
    )
    assert [(deadlock.vehicles, deadlock.by) for deadlock in found] == [(("a", "b"), "ordinary")]
    assert watch.held_up == {"a", "b", "c"}


@pytest.mark.parametrize(
    ("waits", "own", "by"),
    [
        ({"a": ["b"], "b": ["a"]}, "ab", "gated"),
        ({"a": ["b"], "b": ["a"]}, "a", "both"),
        ({"a": ["b"], "b": ["a"]}, "", "ordinary"),
        ({"a": ["b"], "b": ["c"], "c": ["b"]}, "a", "ordinary"),
        ({"a": ["b"], "b": ["a"], "c": ["a"]}, "ab", "gated"),
    ],
)
def test_whose_deadlock_it_is(waits: dict[str, list[str]], own: str, by: str) -> None:
    """Of those who would be stuck without the others, or of both."""
    traffic = Standing(waits)
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, own=own)
    assert next(named(watch, traffic)).by == by


def test_who_came_last_into_the_circle_is_told() -> None:
    """And whether it is gated; the places of who is not in the circle do not count."""
    traffic = Standing({"a": ["b"], "b": ["a"], "c": ["a"]})
    granted = np.array([0])
    drive: Any = SimpleNamespace(changes=0, names=lambda: ["b"], granted=granted.copy)
    trails = Trails(drive)
    ways = (1.0, "far", "far", 0), (2.0, "far", "far", 1), (3.0, "lane of b", "lane of c", 1)
    for at_s, b, c, leg in ways:
        granted[0] = leg
        on = {"a": "lane of a", "b": b, "c": c}
        trails.look(at_s, whereabouts(**{vehicle: (lane, 0.0, 0.0) for vehicle, lane in on.items()}))
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, own="b", trails=trails)
    assert next(named(watch, traffic)).last == ("b", 2.0, True)


def test_a_later_deadlock_is_not_put_down_to_an_earlier_one() -> None:
    """Two ordinary vehicles stand for good when two gated ones close a circle of their own."""
    traffic = Standing({"a": ["b"], "b": ["a"], "c": [], "d": ["c"]})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, own="cd")
    found = named(watch, traffic, at_s=150.0, change=lambda: traffic.waits.update(c=["d"]))
    assert [(deadlock.vehicles, deadlock.by) for deadlock in found] == [
        (("a", "b"), "ordinary"),
        (("c", "d"), "gated"),
    ]


def test_roots_are_those_that_stand_by_themselves_with_others_behind_them() -> None:
    """A has broken down; d waits for whoever drives; f and g are a deadlock, and no root; i is alone."""
    waits = {"a": [], "b": ["a"], "c": ["b"], "d": ["drives"], "e": ["d"], "f": ["g"], "g": ["f"], "h": ["f"]}
    traffic = Standing(waits | {"drives": [], "i": []})
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0, halted={"a"})
    while traffic.now_s < 2 * LONG_S:
        traffic.now_s += 10.0
        traffic.at_m["drives"] += 5.0
        watch.check()
        assert traffic.now_s > LONG_S or watch.roots() == []
    assert watch.roots() == [
        Root("a", "lane of a", 10.0, "breakdown", 2),
        Root("d", "lane of d", 10.0, "cause of d", 1),
    ]


def test_a_vehicle_that_a_gate_lets_go_is_a_root_after_a_minute() -> None:
    """A has a grant and nothing before it; the same vehicle under no gate may only give way for long."""
    for gated, expected in (({"a", "b"}, [Root("a", "lane of a", 10.0, "cause of a", 1)]), (set(), [])):
        traffic = Standing({"a": [], "b": ["a"]})
        watch = DeadlockDetector(*looked_at(traffic), after_s=40.0)
        watch.gated = gated
        while traffic.now_s < 80.0:
            traffic.now_s += 10.0
            watch.check()
        assert watch.roots() == expected


class Told(Ahead):
    """Tells a future and who is left alone; counts how often it was asked to look."""

    def __init__(
        self,
        moves_s: dict[str, float],
        *,
        alone: Collection[str] = "abc",
        until_s: float = math.inf,
        ends: bool = False,
    ) -> None:
        super().__init__()
        here = dict.fromkeys("abcd", 0.0) | moves_s
        self.told, self.alone, self.looks, self.ends = Future(until_s, here), alone, 0, ends

    def look(self, *, ends: bool) -> None:
        assert ends == self.ends
        self.looks += 1
        self.future = self.told

    def left_alone(self, vehicles: Collection[str], core: AbstractSet[str]) -> Collection[str]:
        assert core <= set(vehicles)
        return [one for one in vehicles if one in self.alone]


def foreseen(traffic: Standing, ahead: Told) -> list[tuple[float, tuple[str, ...], int]]:
    """Return time, circle and size of what is found by one who knows what comes."""
    watch = DeadlockDetector(*looked_at(traffic), after_s=60.0)
    watch.ahead = ahead
    return [(one.noticed_at_s, one.vehicles, one.held_up) for one in named(watch, traffic)]


RING = {"a": ["b"], "b": ["a"], "c": ["a"]}


def test_who_moves_later_is_in_no_deadlock() -> None:
    """Neither a circle one of which moves again, nor who moves behind one that stands."""
    assert foreseen(Standing(RING), Told({"a": 5000.0})) == []
    assert foreseen(Standing(RING), Told({"c": 5000.0})) == [(70.0, ("a", "b"), 2)]


def test_the_future_is_looked_at_once_and_only_if_some_may_wait_for_each_other() -> None:
    free, ring = Told({}), Told({})
    assert foreseen(Standing({"a": ["b"], "b": []}), free) == []
    assert foreseen(Standing(RING), ring) == [(70.0, ("a", "b"), 3)]
    assert (free.looks, ring.looks) == (0, 1)


def test_who_drives_on_alone_waits_for_somebody_who_is_not_there_yet() -> None:
    assert foreseen(Standing(RING), Told({}, alone="c")) == []


def test_who_moved_and_left_the_others_standing_was_not_waited_for() -> None:
    """Driver a may wait for d, which drives past; a stands nevertheless, for b."""

    class Passing(Standing):
        def of(self, vehicle: str, stood_s: float) -> list[list[str]]:
            return [["b", "d"]] if vehicle == "a" else super().of(vehicle, stood_s)

        def odometers(self, vehicles: Sequence[str]) -> Floats:
            return np.array([self.now_s if vehicle == "d" else 0.0 for vehicle in vehicles])

    waits = {"a": ["b"], "b": ["a"], "d": []}
    assert foreseen(Passing(waits), Told({"d": 5000.0})) == [(70.0, ("a", "b"), 2)]
    assert watched(Passing(waits)) == []


def test_who_may_wait_for_one_at_a_stop_is_in_no_deadlock() -> None:
    """However long the stop lasts: it ends by itself."""

    class Beside(Standing):
        def of(self, vehicle: str, stood_s: float) -> list[list[str]]:
            return [["b", "bus"]] if vehicle == "a" else super().of(vehicle, stood_s)

    traffic = Beside({"a": ["b"], "b": ["a"], "c": ["d"], "d": ["c"], "bus": []})
    traffic.pausing = {"bus"}
    ahead = Told({"bus": 0.0}, alone=["a", "b", "c", "d", "bus"], ends=True)
    assert foreseen(traffic, ahead) == [(70.0, ("c", "d"), 2)]


def test_of_a_vehicle_that_came_since_nothing_is_known() -> None:
    assert foreseen(Standing({"x": ["y"], "y": ["x"]}), Told({}, alone="xy")) == []


def test_a_short_future_decides_nothing() -> None:
    """The rules do then, which take the circle for one."""
    assert foreseen(Standing(RING), Told({"a": 90.0}, until_s=600.0)) == [(70.0, ("a", "b"), 3)]
