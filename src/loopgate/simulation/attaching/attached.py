"""A gate over vehicles of a simulation that its owner starts and steps."""

from collections.abc import Set as AbstractSet
from contextlib import ExitStack, suppress
from itertools import chain, count, pairwise
from random import Random
from types import TracebackType
from typing import Any, Self

import pandas as pd

from loopgate.abstraction.track import round_routes
from loopgate.errors import ScenarioError, TrafficError
from loopgate.folders import temporary_folder
from loopgate.negotiation.registry import make_negotiation
from loopgate.network import Loop, RoadNetwork, VehicleType, make_loop
from loopgate.network.trips import one_round
from loopgate.results.columns import Event
from loopgate.results.histogram import Histogram
from loopgate.results.recorder import EventFeed, Happening
from loopgate.simulation.attaching.containing import OwnersContainment
from loopgate.simulation.attaching.fleet import Fleet
from loopgate.simulation.attaching.joining_queue import GONE, JoiningQueue
from loopgate.simulation.attaching.newcomers import Newcomer
from loopgate.simulation.drives import Record
from loopgate.simulation.run_folder import deadlock_figures, promise_figures
from loopgate.simulation.settings import why_unsafe
from loopgate.simulation.sumo.devices import LEADING
from loopgate.simulation.watching.collisions import Collisions
from loopgate.simulation.watching.deadlock_detector import Deadlock, DeadlockDetector
from loopgate.simulation.watching.starving import StarvationWatch
from loopgate.traffic.running import RunningSumo

_LONGER_M = 0.01
_LOOK_EVERY_S = 10.0
_STANDING_S = 60.0
"""So often vehicles that stand are looked at, and so long they stand before they can be in a deadlock [s]."""


_OPEN: list["Attached"] = []
"""Those that are in use in this process."""


class Attached:
    """A gate over vehicles of your running simulation; made by `attach` and used in a ``with`` statement.

    Examples
    --------
    >>> import libsumo
    >>> import loopgate
    >>> files = ["-n", "networks/grid5-priority.net.xml", "-r", "routes/grid5.rou.xml"]
    >>> _ = libsumo.start(["sumo", *files, "--no-step-log", "--no-warnings"])
    >>> for bus in ("bus1", "bus2"):
    ...     libsumo.vehicle.add(bus, "loop0")
    >>> with loopgate.attach(libsumo) as gate:
    ...     gate.add("bus1", "bus2")
    ...     for _ in range(60):
    ...         libsumo.simulationStep()
    ...         happened = gate.after_step()
    ...     gate.leave("bus2")
    ...     gate.vehicles, gate.waiting
    (('bus1',), ())
    >>> libsumo.close()
    """

    def __init__(
        self,
        sumo: RunningSumo,
        network: RoadNetwork,
        settings: dict[str, Any],
        *,
        starving_s: float = 600.0,
        standing: str = "contain",
    ) -> None:
        self._sumo, self._traffic, self._network = sumo, sumo.traffic, network
        self._settings = settings
        self._starving_s, self._standing = starving_s, standing
        self._negotiation = make_negotiation(settings["negotiation"], Random(settings["seed"]))
        self._stack = ExitStack()
        self._loops: dict[tuple[tuple[str, ...], str], Loop] = {}
        self._ends: dict[str, str] = {}
        """Where the routes ended that vehicles had."""
        self._kinds: dict[str, VehicleType] = {}
        """The types of vehicles as they were when they were added."""
        self._begin_s = self._latest_s = self._traffic.now_s
        self._done = {"laps": 0.0, "distance_m": 0.0, "hold_s": 0.0, "longest_wait_s": 0.0}
        self._collisions = self._collisions_with_others = self._vehicles = 0
        self._colliding = Collisions()
        self._made: JoiningQueue | None = None
        self._final: dict[str, Any] | None = None
        self._events: pd.DataFrame | None = None
        self._deadlocks: list[Deadlock] = []
        self._next_look_s = self._begin_s + _LOOK_EVERY_S

    @property
    def events(self) -> pd.DataFrame:
        """All events so far, as a table with the columns `EVENT_COLUMNS`."""
        return self._recorder.read() if self._events is None else self._events

    @property
    def _entrance(self) -> JoiningQueue:
        if self._made is None:
            msg = "attach: use what it returns in a with statement"
            raise TrafficError(msg)
        return self._made

    @property
    def _fleet(self) -> Fleet:
        return self._entrance.fleet

    def add(self, *vehicles: str) -> None:
        """Put vehicles under the gate; a vehicle that cannot join yet waits and drives as ordinary traffic.

        Parameters
        ----------
        vehicles
            Vehicles on the road or still to depart. The route of each is its loop, once or several times: its
            last edge leads to the first edge, or is the first edge.

        Raises
        ------
        LoopgateError
            If a vehicle is unknown to SUMO, is under another gate, has a route that is not closed or cannot
            work, or a type that gates refuse; the message names vehicle and reason. Then no vehicle is added.
        """
        known = self._known
        for other in (one for one in _OPEN if one is not self and one.connection is self.connection):
            for vehicle in other._known & set(vehicles):  # noqa: SLF001  of the same class
                msg = f"vehicle {vehicle}: another gate of this simulation has it; let it leave there first"
                raise TrafficError(msg)
        newcomers = [self._newcomer(vehicle) for vehicle in dict.fromkeys(vehicles) if vehicle not in known]
        self._entrance.add(newcomers)
        self._ends.update((n.vehicle, self._traffic.route(n.vehicle)[0][-1]) for n in newcomers)
        self._kinds.update((n.vehicle, n.kind) for n in newcomers)

    @property
    def _known(self) -> AbstractSet[str]:
        """All vehicles that have joined or wait to join."""
        return self._fleet.vehicles.keys() | self._entrance.newcomers.keys()

    def _newcomer(self, vehicle: str) -> Newcomer:
        if not self._sumo.knows(vehicle):
            msg = f"vehicle {vehicle}: SUMO knows none of that name now; add it when it has departed"
            raise TrafficError(msg)
        kind = self._sumo.kind(vehicle)
        reason = why_unsafe(kind, self._traffic.step_s)
        if reason:
            msg = f"vehicle {vehicle}: vType {kind.id}: {reason}"
            raise ScenarioError(msg)
        for device, would in LEADING.items():
            if self._sumo.has(vehicle, device):
                msg = f"vehicle {vehicle}: it has a {device} device, which would {would}; start it without"
                raise ScenarioError(msg)
        return Newcomer(vehicle, self._loop(vehicle, kind), kind, self._traffic.now_s)

    def _loop(self, vehicle: str, kind: VehicleType) -> Loop:
        """Return the loop of the vehicle's route: a known loop if the route is that loop or a part of it."""
        route = self._traffic.route(vehicle)[0]
        edges = one_round(route)
        first = edges.index(min(edges))
        key = (edges[first:] + edges[:first], kind.vclass)
        for (once, vclass), loop in self._loops.items():
            steps = set(zip(once, once[1:] + once[:1], strict=True))
            if (once, vclass) == key or (vclass == kind.vclass and steps.issuperset(pairwise(route))):
                return loop
        self._loops[key] = self._new_loop(vehicle, *key)
        return self._loops[key]

    def _new_loop(self, vehicle: str, edges: tuple[str, ...], vclass: str) -> Loop:
        """Make a loop, and the routes by which the drive keeps vehicles on it."""
        taken = self._sumo.route_names()
        numbered = (f"{vehicle}/{number}" for number in count(2))
        names = chain((self._sumo.route_name(vehicle), vehicle), numbered)
        name = next(one for one in names if f"round@{one}" not in taken)
        loop = make_loop(self._network, name, edges, vclass=vclass, source=f"vehicle {vehicle}")
        for route, its in round_routes(loop).items():
            self._traffic.add_route(route, its)
        return loop

    def leave(self, *vehicles: str) -> None:
        """Release vehicles from the gate; they drive on by SUMO's rules on the rest of their old route.

        Raises
        ------
        TrafficError
            If a vehicle is neither under the gate nor waits to join.
        """
        for vehicle in vehicles:
            if vehicle not in self._fleet and vehicle not in self._entrance.newcomers:
                msg = f"vehicle {vehicle}: it is not under the gate; add it first"
                raise TrafficError(msg)
        self._contained.call_back(vehicles)
        self._entrance.drop(vehicles, "left")
        for vehicle in vehicles:
            self._send_home(vehicle)

    def block(self, *names: str) -> None:
        """Close a vehicle's place, an edge or a lane: no vehicle enters, and vehicles are led round it.

        Call it for breakdowns and closures. The gate itself notices vehicles with a stop of more than 300 s.

        Parameters
        ----------
        names
            Vehicles under the gate that have broken down; edges or lanes that are closed.

        Raises
        ------
        LoopgateError
            If a name is no gated vehicle, edge or lane; then nothing is blocked.
        """
        self._contained.block(names)

    def free(self, *names: str) -> None:
        """Undo `block` for these names of vehicles, edges or lanes: vehicles go back to their loops.

        Raises
        ------
        LoopgateError
            If a name was not blocked; then nothing is freed.
        """
        self._contained.free(names)

    def _send_home(self, vehicle: str) -> None:
        """Let the vehicle's route end where it ended before it came under the gate."""
        with suppress(TrafficError, *self._sumo.error):
            edges, at = self._traffic.route(vehicle)
            end = self._ends.pop(vehicle, "")
            if end in edges[at:]:
                self._traffic.lead(vehicle, edges[at : edges.index(end, at) + 1])

    def after_step(self) -> list[Happening]:
        """Let the gate act after a step of the simulation; return the events of the step in order.

        Call it once after each ``simulationStep``.

        Raises
        ------
        TrafficError
            If SUMO refuses a call, an earlier state has been loaded, or a vehicle was given a setting that
            gates refuse; the message names vehicle and setting.
        """
        try:
            self._look_at_clock()
            self._note_collisions()
            self._entrance.after_step()
            self._check_kinds()
            self._look_for_standstill()
        except self._sumo.error as error:
            msg = f"at {self._traffic.now_s:g} s SUMO refuses what the gate asks of it: {error}"
            raise TrafficError(msg) from error
        fresh = self._recorder.take()
        for row in fresh:
            if (row.event, row.reason) == (Event.END, GONE):
                self._ends.pop(row.vehicle, None)
        return fresh

    def _look_at_clock(self) -> None:
        """Take note of a step; raise `TrafficError` if an earlier state has been loaded."""
        self._traffic.look_at_clock()
        now = self._traffic.now_s
        if now < self._latest_s:
            self._traffic.find_holds(self._known)  # so that nobody is held when the gate is left
            msg = (
                f"at {self._latest_s:g} s the clock went back to {now:g} s: what the gate knows of its "
                f"vehicles is no longer so; leave it, and attach anew"
            )
            raise TrafficError(msg)
        self._latest_s = now

    def _check_kinds(self) -> None:
        """Refuse settings of the owner that no gate can count on.

        Raises
        ------
        TrafficError
            If a vehicle is of another class, keeps a longer gap, or drives as no gate can work with.
        """
        for vehicle in self._fleet.vehicles:
            before, name = self._kinds[vehicle], self._sumo.type_name(vehicle)
            if name == before.id and "@" not in name:
                continue
            kind = self._sumo.kind(vehicle)
            why = why_unsafe(kind, self._traffic.step_s)
            if kind.vclass != before.vclass:
                why = f"its class was {before.vclass} when it came under the gate and is {kind.vclass}"
            elif kind.min_gap_m > before.min_gap_m + _LONGER_M:
                was, now = before.min_gap_m, kind.min_gap_m
                why = f"its minGap was {was:g} m when it came under the gate and is {now:g} m"
            if why:
                msg = f"vehicle {vehicle}: {why}; let it leave the gate"
                raise TrafficError(msg)

    def __repr__(self) -> str:
        return f"<Attached: {len(self.vehicles)} vehicles under the gate, {len(self.waiting)} wait to join>"

    @property
    def vehicles(self) -> tuple[str, ...]:
        """The names of the vehicles under the gate."""
        return tuple(sorted(self._fleet.vehicles))

    @property
    def waiting(self) -> tuple[str, ...]:
        """The names of the vehicles that have been added and wait to come under the gate."""
        return tuple(sorted(self._entrance.newcomers))

    def _look_for_standstill(self) -> None:
        """Look for vehicles that starve, and for circles of vehicles that wait for each other."""
        now = self._traffic.now_s
        if now < self._next_look_s or not self._fleet.vehicles:
            return
        self._next_look_s = now + _LOOK_EVERY_S
        self._hunger.check(deadlocked=bool(self._deadlocks))
        deadlock = self._watch.check()
        if deadlock is not None:
            self._deadlocks.append(deadlock)
            ahead = deadlock.vehicles[1:] + deadlock.vehicles[:1]
            for vehicle, place, other in zip(deadlock.vehicles, deadlock.places, ahead, strict=True):
                self._recorder.note(now, vehicle, Event.DEADLOCK, place, other)

    def _note_collisions(self) -> None:
        own, now = self._fleet.vehicles.keys(), self._traffic.now_s
        theirs = (one for one in self._traffic.collisions() if not own.isdisjoint((one.collider, one.victim)))
        for collision in self._colliding.begun(theirs):
            if own >= {collision.collider, collision.victim}:
                self._collisions += 1
            else:
                self._collisions_with_others += 1
            self._recorder.note(now, collision.collider, Event.COLLISION, collision.lane, collision.victim)

    def _count(self, driver: Record) -> None:
        """Add the figures of a vehicle under the gate."""
        self._add_up(self._done, driver)
        self._vehicles += 1

    def _add_up(self, figures: dict[str, float], driver: Record) -> None:
        now = self._traffic.now_s
        figures["laps"] += driver.laps
        figures["distance_m"] += driver.distance_m
        figures["hold_s"] += driver.total_hold_s(now)
        figures["longest_wait_s"] = max(figures["longest_wait_s"], driver.worst_wait_s(now))

    @property
    def summary(self) -> dict[str, Any]:
        """Figures so far, as a mapping with the keys of ``summary.json``."""
        if self._final is not None:
            return self._final
        return {**self._figures(), **self._fleet.report()}

    def _figures(self) -> dict[str, Any]:
        figures = dict(self._done)
        for record in self._fleet.drive.records.values():
            self._add_up(figures, record)
        drive = self._fleet.drive
        times = Histogram(drive.decision_us.values())
        return {
            **self._settings,
            "duration_s": round(self._traffic.now_s - self._begin_s, 3),
            "vehicles": len(self._fleet.vehicles),
            "waiting": len(self._entrance.newcomers),
            "left": self._vehicles,
            "changes": self._fleet.changes,
            "loops": len(self._loops),
            "laps": int(figures["laps"]),
            "distance_km": round(figures["distance_m"] / 1000.0, 6),
            "hold_s": round(figures["hold_s"], 3),
            "longest_wait_s": round(figures["longest_wait_s"], 3),
            "collisions": self._collisions,
            "collisions_with_others": self._collisions_with_others,
            **{name: getattr(drive, name) for name in ("overruns", "trespasses", "strays")},
            "mended": self._entrance.mended,
            "without_way": list(self._traffic.without_way),
            "outcome": "deadlock" if self._deadlocks else "starving" if self._hunger.sinks else "done",
            "deadlocks": [deadlock_figures(deadlock) for deadlock in self._deadlocks],
            "starving": [sink.figures() for sink in self._hunger.sinks.values()],
            **self._contained.report(),
            **promise_figures(drive),
            "decisions": times.count,
            "refusals": dict(sorted(drive.refusals.items())),
            "decision_us": times.summary(),
        }

    def __enter__(self) -> Self:
        self._folder = self._stack.enter_context(temporary_folder())
        self._recorder = EventFeed(self._folder)
        self._stack.callback(self._recorder.close)
        settings = self._settings
        fleet = Fleet(
            self._network,
            self._traffic,
            self._recorder,
            settings["gate"],
            self._negotiation,
            obeys=settings["lights"] == "obey",
        )
        self._made = JoiningQueue(self._network, self._traffic, fleet)
        fleet.on_leaving = self._count
        contained = OwnersContainment(
            self._sumo, self._network, self._recorder, self._made, standing=self._standing
        )
        self._contained, self._made.before_asking = contained, contained.look
        self._hunger = StarvationWatch(
            fleet.drive,
            self._traffic,
            self._recorder,
            after_s=self._starving_s,
            stands=contained.why,
            reason=contained.reason,
        )
        self._watch = DeadlockDetector(
            self._traffic, after_s=_STANDING_S, at_gate=fleet.drive.refused, own=fleet
        )
        self.connection = self._sumo.connection
        _OPEN.append(self)
        self._stack.callback(_OPEN.remove, self)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._stack:
            final = self._figures()
            with suppress(TrafficError, *self._sumo.error):  # it may have been ended already
                final |= self._fleet.report()
                self._contained.call_back(self._known)
                self._entrance.drop(self._known, "end")
            self._recorder.close()
            self._events = self._recorder.read()
            self._final = final
