"""The object that `attach` returns: a gate over vehicles of a simulation that its owner steps."""

from collections.abc import Set as AbstractSet
from contextlib import ExitStack, suppress
from itertools import chain, count, pairwise
from pathlib import Path
from random import Random
from types import TracebackType
from typing import Any, Self

import pandas as pd

from loopgate.abstraction.itinerary import round_routes
from loopgate.errors import LoopgateError, ScenarioError, TrafficError
from loopgate.folders import temporary_folder
from loopgate.negotiation.registry import make_negotiation
from loopgate.network import Loop, RoadNetwork, VehicleType, make_loop
from loopgate.network.trips import one_round
from loopgate.reading import shown
from loopgate.results.columns import Event
from loopgate.results.recorder import EventFeed, Happening
from loopgate.simulation.attaching.containing import OwnersContainment
from loopgate.simulation.attaching.fleet import Fleet
from loopgate.simulation.attaching.joining_queue import GONE, JoiningQueue
from loopgate.simulation.attaching.newcomers import Newcomer
from loopgate.simulation.attaching.run_files import RunFiles
from loopgate.simulation.attaching.watch import Watch
from loopgate.simulation.settings import highest_limits, why_unsafe
from loopgate.simulation.sumo.devices import LEADING
from loopgate.traffic.running import RunningSumo

_LONGER_M = 0.01

_NOT_ENTERED = "attach: use what it returns in a with statement"

_OPEN: list["Attached"] = []
"""The gates in use in this process."""


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
        folder: Path | None = None,
        overwrite: bool = False,
    ) -> None:
        self._keeps, self._overwrite = folder, overwrite
        self._files: RunFiles | None = None
        self._loop_of: dict[str, Loop] = {}
        """For each vehicle that was added, its loop."""
        self._sumo, self._traffic, self._network = sumo, sumo.traffic, network
        self._settings = settings
        self._starving_s, self._standing = starving_s, standing
        self._negotiation = make_negotiation(settings["negotiation"], Random(settings["seed"]))
        self._stack = ExitStack()
        self._loops: dict[tuple[tuple[str, ...], str], Loop] = {}
        self._ends: dict[str, str] = {}
        """For each vehicle, the last edge of its route before it came under the gate."""
        self._kinds: dict[str, VehicleType] = {}
        """For each vehicle, its type when it was added."""
        self._begin_s = self._latest_s = self._traffic.now_s
        self._made: JoiningQueue | None = None
        self._final: dict[str, Any] | None = None
        self._events: pd.DataFrame | None = None

    @property
    def events(self) -> pd.DataFrame:
        """All events so far, as a table with the columns `EVENT_COLUMNS`."""
        if self._events is not None:
            return self._events
        self._check_in_use()
        return self._recorder.read()

    @property
    def _entrance(self) -> JoiningQueue:
        if self._made is None:
            raise TrafficError(_NOT_ENTERED)
        return self._made

    def _check_in_use(self) -> None:
        """Refuse use before the ``with`` statement, and after its end, where no vehicle would be gated."""
        if self._made is None:
            raise TrafficError(_NOT_ENTERED)
        if self._final is not None:
            msg = (
                "the with statement of this gate has ended, and SUMO drives its vehicles; make the steps "
                "within it, or call attach anew"
            )
            raise TrafficError(msg)

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
        self._check_in_use()
        _check_names("add", vehicles)
        known = self._known
        for other in (one for one in _OPEN if one is not self and one.connection is self.connection):
            for vehicle in other._known & set(vehicles):  # noqa: SLF001  of the same class
                msg = f"vehicle {vehicle}: another gate of this simulation has it; let it leave there first"
                raise TrafficError(msg)
        newcomers = [self._newcomer(vehicle) for vehicle in dict.fromkeys(vehicles) if vehicle not in known]
        self._entrance.add(newcomers)
        self._ends.update((n.vehicle, self._traffic.route(n.vehicle)[0][-1]) for n in newcomers)
        self._kinds.update((n.vehicle, n.kind) for n in newcomers)
        self._loop_of.update((n.vehicle, n.loop) for n in newcomers)

    @property
    def _known(self) -> AbstractSet[str]:
        """All vehicles that have joined or wait to join."""
        return self._fleet.diaries.keys() | self._entrance.newcomers.keys()

    def _newcomer(self, vehicle: str) -> Newcomer:
        if not self._sumo.knows(vehicle):
            msg = f"vehicle {vehicle}: SUMO knows none of that name now; add it when it has departed"
            raise TrafficError(msg)
        kind = self._sumo.kind(vehicle)
        loop = self._loop(vehicle, kind)
        reason = self._why_unsafe(kind, loop)
        if reason:
            msg = f"vehicle {vehicle}: vType {kind.id}: {reason}"
            raise ScenarioError(msg)
        for device, would in LEADING.items():
            if self._sumo.has(vehicle, device):
                msg = f"vehicle {vehicle}: it has a {device} device, which would {would}; start it without"
                raise ScenarioError(msg)
        return Newcomer(vehicle, loop, kind, self._traffic.now_s)

    def _why_unsafe(self, kind: VehicleType, loop: Loop) -> str:
        """Return why no gate can drive a vehicle of this type on a loop; empty if one can."""
        limit_mps = highest_limits(self._network, [(loop, kind)])[kind]
        return why_unsafe(kind, self._traffic.step_s, limit_mps, obeys=self._settings["lights"] == "obey")

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
        """Make a loop, and add the routes to SUMO that keep vehicles on it."""
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
        self._check_in_use()
        _check_names("leave", vehicles)
        for vehicle in vehicles:
            if vehicle not in self._fleet and vehicle not in self._entrance.newcomers:
                msg = f"vehicle {vehicle}: it is not under the gate; add it first"
                raise TrafficError(msg)
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
        self._check_in_use()
        _check_names("block", names)
        self._contained.block(names)

    def free(self, *names: str) -> None:
        """Undo `block` for these names of vehicles, edges or lanes: vehicles go back to their loops.

        Raises
        ------
        LoopgateError
            If a name was not blocked; then nothing is freed.
        """
        self._check_in_use()
        _check_names("free", names)
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
            If SUMO refuses a call, an earlier state has been loaded, a vehicle was given a setting that gates
            refuse (the message names vehicle and setting), or the ``with`` statement has ended.
        """
        self._check_in_use()
        try:
            self._look_at_clock()
            self._watch.note_collisions()
            self._entrance.after_step()
            self._check_kinds()
            self._watch.look_for_standstill()
            if self._files is not None:
                self._files.look()
        except self._sumo.error as error:
            msg = f"at {self._traffic.now_s:g} s SUMO refuses what the gate asks of it: {error}"
            raise TrafficError(msg) from error
        fresh = self._recorder.take()
        for row in fresh:
            if (row.event, row.reason) == (Event.END, GONE):
                self._ends.pop(row.vehicle, None)
        return fresh

    def _look_at_clock(self) -> None:
        """Read the clock after a step; raise `TrafficError` if an earlier state has been loaded."""
        self._traffic.look_at_clock()
        now = self._traffic.now_s
        if now < self._latest_s:
            self._traffic.find_holds(self._known)  # so that no vehicle stays held when the gate is left
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
            If a vehicle is of another class, keeps a longer gap, or drives in a way that gates exclude.
        """
        for vehicle in self._fleet.diaries:
            before, name = self._kinds[vehicle], self._sumo.type_name(vehicle)
            if name == before.id and "@" not in name:
                continue
            kind = self._sumo.kind(vehicle)
            why = self._why_unsafe(kind, self._loop(vehicle, kind))
            if kind.vclass != before.vclass:
                why = f"its class was {before.vclass} when it came under the gate and is {kind.vclass}"
            elif kind.min_gap_m > before.min_gap_m + _LONGER_M:
                was, now = before.min_gap_m, kind.min_gap_m
                why = f"its minGap was {was:g} m when it came under the gate and is {now:g} m"
            if why:
                msg = f"vehicle {vehicle}: {why}; let it leave the gate"
                raise TrafficError(msg)

    def __repr__(self) -> str:
        if self._made is None:
            return "<Attached: not in a with statement yet>"
        return f"<Attached: {len(self.vehicles)} vehicles under the gate, {len(self.waiting)} wait to join>"

    @property
    def vehicles(self) -> tuple[str, ...]:
        """The names of the vehicles under the gate."""
        return tuple(sorted(self._fleet.diaries))

    @property
    def waiting(self) -> tuple[str, ...]:
        """The names of the vehicles that have been added and wait to come under the gate."""
        return tuple(sorted(self._entrance.newcomers))

    def why(self, vehicle: str) -> str:
        """Return why the gate lets a vehicle not go on now, and for whom it waits; "" if it may drive.

        Raises
        ------
        TrafficError
            If the vehicle is not under the gate and does not wait to join.

        Examples
        --------
        >>> import libsumo, loopgate
        >>> def print_reasons(gate: loopgate.Attached) -> None:
        ...     for vehicle in gate.vehicles:
        ...         if gate.why(vehicle):
        ...             print(vehicle, gate.why(vehicle))  # v7 the next street is closed: B2C2_0, until 400 s
        """
        _check_names("why", (vehicle,))
        if vehicle in self._entrance.newcomers:
            return "it waits to join the gate"
        if vehicle not in self._fleet.diaries:
            msg = f"vehicle {vehicle}: it is not under the gate"
            raise TrafficError(msg)
        return self._fleet.leads.why(vehicle)

    @property
    def summary(self) -> dict[str, Any]:
        """Figures so far, as a mapping with the keys of ``summary.json``."""
        if self._final is not None:
            return self._final
        self._check_in_use()
        return {**self._figures(), **self._fleet.report()}

    def _figures(self) -> dict[str, Any]:
        return {
            **self._settings,
            "duration_s": round(self._traffic.now_s - self._begin_s, 3),
            **self._watch.figures(),
            "waiting": len(self._entrance.newcomers),
            "loops": len(self._loops),
            "mended": self._entrance.mended,
            "without_way": list(self._traffic.without_way),
            **self._contained.report(),
        }

    def __enter__(self) -> Self:
        if self._made is not None:
            msg = "this gate has been in a with statement already; call attach anew"
            raise TrafficError(msg)
        if self._keeps is not None:
            of = self._network, self._sumo, self._settings
            self._files = RunFiles(self._keeps, *of, overwrite=self._overwrite)
            self._stack.enter_context(self._files.stack)
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
        contained = OwnersContainment(
            self._sumo, self._network, self._recorder, self._made, standing=self._standing
        )
        self._contained, self._made.before_asking = contained, contained.look
        self._watch = Watch(
            self._network,
            self._traffic,
            fleet,
            self._recorder,
            contained,
            starving_s=self._starving_s,
            step=self._traffic.step,
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
                self._entrance.drop(self._known, "end")
            self._recorder.close()
            self._events = self._recorder.read()
            self._final = final
            if self._files is not None:
                # What was driven before Ctrl-C or an error of the user stays; that error is the one to tell.
                unsaid: tuple[type[BaseException], ...] = (LoopgateError, *self._sumo.error)
                with suppress(*(() if kind is None else unsaid)):
                    self._files.write(self._events, final, self._fleet.drive, self._loop_of)


def _check_names(call: str, names: tuple[object, ...]) -> None:
    """Refuse what is no name, such as a list of names."""
    for name in names:
        if not isinstance(name, str):
            several = "" if call == "why" else f"; of a list: gate.{call}(*names)"
            msg = f"{call} takes names; found {shown(name)}{several}"
            raise TrafficError(msg)
