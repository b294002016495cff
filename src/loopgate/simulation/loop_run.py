"""Drives the vehicles of a run to its end, and records deadlocks, collisions and teleports."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from loopgate.errors import PluginError
from loopgate.results.columns import FLOW_EVERY_S, Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.ahead import SimulatedAhead
from loopgate.simulation.watching.deadlock_detector import Deadlock, DeadlockDetector, Root
from loopgate.simulation.watching.starving import Sink
from loopgate.simulation.watching.verdicts import CollisionVerdict, Verdicts
from loopgate.traffic.base import Collision, Traffic


class Collisions:
    """Finds new collisions among all collisions that SUMO reports."""

    def __init__(self) -> None:
        self._under_way: set[tuple[str, str]] = set()

    def __bool__(self) -> bool:
        """Return whether a collision lasted in the last step."""
        return bool(self._under_way)

    def begun(self, reported: Iterable[Collision]) -> list[Collision]:
        """Return the collisions that began in the last step."""
        before, now = self._under_way, {(one.collider, one.victim): one for one in reported}
        self._under_way = set(now)
        return [one for pair, one in now.items() if pair not in before and pair[::-1] not in before]


@dataclass(slots=True)
class RunCourse:
    """The outcome and the counts of a run.

    Attributes
    ----------
    outcome
        ``done``, ``starving``, ``deadlock`` or ``interrupted``.
    begin_s, end_s
        The measured time [s].
    deadlocks
        In the order in which they were detected.
    roots
        Vehicles that stood at the end for a cause of their own, with others behind them.
    collisions, teleports
        Counts; a collision that lasts for several steps counts once.
    collisions_of_others
        Collisions without a vehicle of the run's own.
    verdicts
        Which vehicle erred, for each collision of a gated vehicle with an ordinary one.
    starving
        Vehicles behind which other vehicles starved.
    fault
        The error of a user's gate or negotiation that interrupted the run.
    sumo_s, ahead_s, total_s
        Wall time of SUMO's steps, of looks ahead, and of the whole run [s].
    """

    outcome: str = "done"
    begin_s: float = 0.0
    end_s: float = 0.0
    deadlocks: list[Deadlock] = field(default_factory=list)
    roots: list[Root] = field(default_factory=list)
    collisions: int = 0
    collisions_of_others: int = 0
    verdicts: list[CollisionVerdict] = field(default_factory=list)
    teleports: int = 0
    starving: list[Sink] = field(default_factory=list)
    fault: PluginError | None = None
    sumo_s: float = 0.0
    ahead_s: float = 0.0
    total_s: float = 0.0


_ROOTS_EVERY_S = 60.0
"""So often, and with each deadlock, it is told who stands by itself with others behind it [s]."""

Tick = Callable[[float, RunCourse], None]
"""Called every ten simulated seconds with the simulated time [s] and the course so far."""


def standstill_text(course: RunCourse) -> str:
    """Return which vehicles the others stand behind so far, in a few words; empty if there are none."""
    if course.roots:
        one = course.roots[0]
        return f"{one.vehicle} stands since {one.since_s:.0f} s ({one.why}), {one.behind} behind it"
    if course.deadlocks:
        first = course.deadlocks[0]
        size = len(first.vehicles)
        behind = max((one.held_up for one in course.deadlocks), default=size) - size
        return f"deadlock of {size} vehicles since {first.closed_at_s:.0f} s, {behind} behind it"
    return ""


class Steps(Protocol):
    """What the loop asks of a drive."""

    @property
    def sumo_s(self) -> float:
        """Wall time in SUMO's steps [s]."""

    def begin(self) -> None:
        """Make the first step, in which all vehicles appear."""

    def step(self) -> None:
        """Advance SUMO by one step, and act."""

    def measure_from_now(self) -> None:
        """Begin the measured time: set all figures to zero."""

    def count_from(self, at_s: float) -> None:
        """Count standing times only from this time [s]."""

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Note that SUMO moved a vehicle `skipped_m` ahead."""


def after(look: Callable[[], None], tick: Tick) -> Tick:
    """Return a function that calls `look`, then `tick`."""

    def both(now: float, course: RunCourse) -> None:
        look()
        tick(now, course)

    return both


def run_to_end(
    drive: Steps,
    traffic: Traffic,
    detector: DeadlockDetector,
    collisions: CollisionLog,
    *,
    scenario: Scenario,
    tick: Tick,
    each_step: Sequence[Callable[[], None]] = (),
    over: Callable[[], bool] = lambda: False,
) -> RunCourse:
    """Drive until the time is over, all vehicles have arrived, or a deadlock or the user ends the run.

    Parameters
    ----------
    drive, traffic, detector, collisions
        The parts of one run that has not begun.
    scenario
        Has the measured time, the warm-up, and what a deadlock does to the run.
    tick
        Called every ten simulated seconds with the simulated time.
    each_step
        Functions to call after each step.
    over
        Returns whether no vehicle is left, which ends the run.
    """
    course, recorder = collisions.course, collisions.recorder
    began, ahead = perf_counter(), None
    try:
        drive.begin()
        start = traffic.now_s
        if scenario.warmup_s <= 0:
            drive.measure_from_now()
        course.begin_s = start + scenario.warmup_s
        drive.count_from(course.begin_s + traffic.step_s / 2.0)  # from the next step on
        end = course.begin_s + scenario.duration_s
        next_watch = start + FLOW_EVERY_S
        advance = _step(drive, collisions, each_step)
        detector.ahead = ahead = _ahead(scenario, traffic, advance, end)
        while traffic.now_s < end and not over():
            advance()
            now = traffic.now_s
            if now >= course.begin_s > now - traffic.step_s and scenario.warmup_s > 0:
                drive.measure_from_now()
                course.collisions = course.collisions_of_others = course.teleports = 0
                course.verdicts.clear()
            if now >= next_watch:
                next_watch += FLOW_EVERY_S
                tick(now, course)
                deadlock = detector.check()
                _note_roots(detector, course, deadlock, now)
                if deadlock is not None:
                    note_deadlock(deadlock, course, recorder)
                    if scenario.on_deadlock == "stop":
                        break
                    if scenario.on_deadlock == "teleport":  # under no gate
                        jump_on(deadlock, traffic, collisions, drive.jumped)
        course.roots = detector.roots()
    except (KeyboardInterrupt, PluginError) as ended:
        course.outcome = "interrupted"
        course.fault = ended if isinstance(ended, PluginError) else None
    course.end_s = traffic.now_s
    course.total_s = perf_counter() - began
    course.sumo_s, course.ahead_s = drive.sumo_s, ahead.took_s if ahead else 0.0
    return course


def _step(drive: Steps, collisions: CollisionLog, looks: Sequence[Callable[[], None]]) -> Callable[[], None]:
    """Return a function that drives on by one step, and looks at what has happened."""

    def both() -> None:
        drive.step()
        collisions.note()
        for look in looks:
            look()

    return both


def _ahead(
    scenario: Scenario, traffic: Traffic, advance: Callable[[], None], end_s: float
) -> SimulatedAhead | None:
    """Return what looks ahead, under SUMO's rules alone. `end_s`: when the run ends [s].

    Under a gate the ledger says who waits for whom, and a run that moves vehicles out of deadlocks changes
    what comes.
    """
    if scenario.gated or scenario.on_deadlock == "teleport" or not SimulatedAhead.works(traffic):
        return None
    return SimulatedAhead(traffic, advance, ends=bool(scenario.incidents), end_s=end_s)


def _note_roots(detector: DeadlockDetector, course: RunCourse, found: Deadlock | None, now: float) -> None:
    """Note who stands by itself with others behind it, once a minute and with each new deadlock."""
    if now % _ROOTS_EVERY_S < FLOW_EVERY_S or (found is not None and not found.again):
        course.roots = detector.roots()


class CollisionLog:
    """Counts and records SUMO's collisions and teleports, step by step.

    Collisions without one of the `own` vehicles are only counted; without `own`, all vehicles are own.
    `verdicts` judges collisions of own vehicles with others.
    """

    def __init__(
        self,
        traffic: Traffic,
        recorder: Recorder,
        course: RunCourse,
        *,
        own: AbstractSet[str] | None = None,
        verdicts: Verdicts | None = None,
    ) -> None:
        self.own, self._verdicts = own, verdicts
        self._traffic = traffic
        self.recorder = recorder
        self.course = course
        self._colliding = Collisions()

    def note(self) -> None:
        """Record the events of the last step; a collision counts when it begins."""
        now = self._traffic.now_s
        if self._verdicts is not None:
            self._verdicts.look()
        reported = self._traffic.collisions()
        for collision in self._colliding.begun(reported) if reported or self._colliding else ():
            if self.own is not None and self.own.isdisjoint((collision.collider, collision.victim)):
                self.course.collisions_of_others += 1
                continue
            self.course.collisions += 1
            verdict = self._verdicts.judge(collision) if self._verdicts is not None else None
            self.course.verdicts += [verdict] if verdict is not None else []
            self.recorder.note(now, collision.collider, Event.COLLISION, collision.lane, collision.victim)
        for vehicle in self._traffic.teleports():
            self.course.teleports += 1
            if self.own is not None and vehicle not in self.own:
                continue  # an ordinary vehicle whose stop says that it jumps
            self.recorder.note(now, vehicle, Event.TELEPORT, "")


def note_deadlock(deadlock: Deadlock, course: RunCourse, recorder: Recorder) -> None:
    """Record a deadlock in the course and as events: each vehicle with the vehicle that it waits for."""
    if deadlock.again:
        return
    course.deadlocks.append(deadlock)
    course.outcome = "deadlock"
    ahead = deadlock.vehicles[1:] + deadlock.vehicles[:1]
    for vehicle, place, waits_for in zip(deadlock.vehicles, deadlock.places, ahead, strict=True):
        recorder.note(deadlock.noticed_at_s, vehicle, Event.DEADLOCK, place, waits_for)


def jump_on(
    deadlock: Deadlock,
    traffic: Traffic,
    log: CollisionLog,
    jumped: Callable[[str, float], None] = lambda _vehicle, _skipped_m: None,
) -> None:
    """Put the first vehicle of a circle that has room ahead on its route there; count it as a teleport."""
    for vehicle in deadlock.vehicles:
        skipped_m = traffic.jump(vehicle)
        if skipped_m is not None:
            jumped(vehicle, skipped_m)
            log.course.teleports += 1
            log.recorder.note(traffic.now_s, vehicle, Event.TELEPORT, "")
            return
