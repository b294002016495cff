"""Watches the vehicles under an attached gate: collisions, deadlocks, starvation and figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any, Final

from loopgate.control.diary import Diary
from loopgate.network import RoadNetwork
from loopgate.results.columns import Event
from loopgate.results.histogram import Histogram
from loopgate.results.recorder import EventFeed
from loopgate.simulation.attaching.containing import OwnersContainment
from loopgate.simulation.attaching.fleet import Fleet
from loopgate.simulation.loop_run import Collisions
from loopgate.simulation.run_folder import deadlock_figures, promise_figures
from loopgate.simulation.watching.ahead import SimulatedAhead
from loopgate.simulation.watching.deadlock_detector import Deadlock, DeadlockDetector, Root
from loopgate.simulation.watching.road_waits import RoadWaits, SimulatedRoad
from loopgate.simulation.watching.starving import StarvationWatch
from loopgate.traffic.base import Traffic

_LOOK_EVERY_S: Final = 10.0
_STANDING_S: Final = 40.0
"""Vehicles are checked in the first interval [s]; one that stands this long can be in a deadlock [s]."""


class Watch:
    """Records what happens to the vehicles under a gate, and counts what they do.

    Parameters
    ----------
    network, traffic, fleet, recorder
        The network, the running simulation, the vehicles, and the recorder of events.
    contained
        Says why vehicles stand.
    starving_s
        Time without a grant after which a vehicle counts as starving [s].
    step
        Drives the simulation on by one step.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        fleet: Fleet,
        recorder: EventFeed,
        contained: OwnersContainment,
        *,
        starving_s: float,
        step: Callable[[], object],
    ) -> None:
        self._traffic, self._fleet, self._recorder = traffic, fleet, recorder
        fleet.on_leaving = self._count
        self._hunger = StarvationWatch(
            fleet.drive,
            traffic,
            recorder,
            after_s=starving_s,
            stands=contained.why,
            reason=contained.reason,
        )
        road = RoadWaits(network, SimulatedRoad(traffic, fleet), impatient_s=traffic.impatient_s())
        self._detector = DeadlockDetector(
            traffic, road, after_s=_STANDING_S, at_gate=fleet.drive.refused, own=fleet
        )
        self._detector.gated = fleet
        self._ahead = SimulatedAhead(traffic, step, shared=True) if SimulatedAhead.works(traffic) else None
        self._deadlocks: list[Deadlock] = []
        self._roots: list[Root] = []
        self._next_look_s = traffic.now_s + _LOOK_EVERY_S
        self._colliding = Collisions()
        self._collisions = self._collisions_with_others = self._left = 0
        self._done = dict.fromkeys(("laps", "distance_m", "hold_s", "longest_stood_s", "longest_wait_s"), 0.0)
        """The figures of the vehicles that have left."""

    def note_collisions(self) -> None:
        """Record the collisions of vehicles under the gate that begin in this step."""
        own, now = self._fleet.diaries.keys(), self._traffic.now_s
        theirs = (one for one in self._traffic.collisions() if not own.isdisjoint((one.collider, one.victim)))
        for collision in self._colliding.begun(theirs):
            if own >= {collision.collider, collision.victim}:
                self._collisions += 1
            else:
                self._collisions_with_others += 1
            self._recorder.note(now, collision.collider, Event.COLLISION, collision.lane, collision.victim)

    def look_for_standstill(self) -> None:
        """Look for vehicles that starve, and for circular waits."""
        now = self._traffic.now_s
        if now < self._next_look_s:
            return
        self._next_look_s = now + _LOOK_EVERY_S
        self._hunger.check(deadlocked=bool(self._deadlocks))
        self._detector.ahead = None if self._fleet.diaries else self._ahead
        deadlock = self._detector.check()
        self._roots = self._detector.roots()
        if deadlock is not None:
            self._deadlocks.append(deadlock)
            ahead = deadlock.vehicles[1:] + deadlock.vehicles[:1]
            for vehicle, place, other in zip(deadlock.vehicles, deadlock.places, ahead, strict=True):
                self._recorder.note(now, vehicle, Event.DEADLOCK, place, other)

    def _count(self, diary: Diary) -> None:
        """Add the figures of a vehicle that leaves."""
        self._add_up(self._done, diary)
        self._left += 1

    def _add_up(self, figures: dict[str, float], diary: Diary) -> None:
        now = self._traffic.now_s
        figures["laps"] += diary.laps
        figures["distance_m"] += diary.distance_m
        figures["hold_s"] += diary.total_hold_s(now)
        figures["longest_stood_s"] = max(figures["longest_stood_s"], diary.longest_stood_s)
        figures["longest_wait_s"] = max(figures["longest_wait_s"], diary.worst_wait_s(now))

    def figures(self) -> dict[str, Any]:
        """Return the figures of all vehicles so far, with the keys of ``summary.json``."""
        figures, drive = dict(self._done), self._fleet.drive
        for diary in drive.records.values():
            self._add_up(figures, diary)
        times = Histogram(drive.decision_us.values())
        return {
            "vehicles": len(self._fleet.diaries),
            "left": self._left,
            "changes": self._fleet.changes,
            "laps": int(figures["laps"]),
            "distance_km": round(figures["distance_m"] / 1000.0, 6),
            "hold_s": round(figures["hold_s"], 3),
            "longest_stood_s": round(figures["longest_stood_s"], 3),
            "longest_wait_s": round(figures["longest_wait_s"], 3),
            "collisions": self._collisions,
            "collisions_with_others": self._collisions_with_others,
            **{name: getattr(drive, name) for name in ("overruns", "trespasses", "strays")},
            "outcome": "deadlock" if self._deadlocks else "starving" if self._hunger.sinks else "done",
            "deadlocks": [deadlock_figures(deadlock) for deadlock in self._deadlocks],
            "roots": [asdict(root) for root in self._roots],
            "starving": [sink.figures() for sink in self._hunger.sinks.values()],
            **promise_figures(
                drive, lights=True, others=bool(drive.driving.sight and drive.driving.sight.others)
            ),
            "decisions": times.count,
            "refusals": dict(sorted(drive.refusals.items())),
            "decision_us": times.summary(),
        }
