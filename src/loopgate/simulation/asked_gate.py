"""Gates other than the chain rule in the ledger, made anew as vehicles come and go; their order."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from math import inf
from time import perf_counter
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.chain import ChainGate
from loopgate.control.driving import Driving
from loopgate.control.ledger import Ledger, Order
from loopgate.control.lights import light
from loopgate.control.places import Place, Vehicle
from loopgate.control.pressure import PressureOrder
from loopgate.control.refusal import Refusal, Rule
from loopgate.control.rules import usual
from loopgate.errors import GateError
from loopgate.gates import Decision, Gate, make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.gates.following import careful, following
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.negotiation.base import InformedNegotiation, Negotiation, Request
from loopgate.negotiation.pressure import Pressure
from loopgate.negotiation.registry import careful as careful_order
from loopgate.results.histogram import Histogram

_REASK_S: Final = 1.0 - 1e-6
"""A gate is asked again about a refusal at most this often [s]."""


class AskedGate:
    """A gate that decides about each move that no other rule refuses.

    Parameters
    ----------
    system, gate
        The vehicles as robots with their positions, and the gate made for the system. If they are not
        given, `go_by` must be called with both before the gate is asked.

    Attributes
    ----------
    times
        How long decisions of the gate took, by stage [us].
    messages
        Number of messages between robots for these decisions.
    """

    def __init__(self, system: System | None = None, gate: Gate | None = None) -> None:
        self.times: defaultdict[str, Histogram] = defaultdict(Histogram)
        self.messages = 0
        self.look: Callable[[], None] = lambda: None
        """Called before the gate is asked; may call `go_by` if vehicles have come or gone."""
        if system is not None and gate is not None:
            self.go_by(system, gate)

    def go_by(self, system: System, gate: Gate) -> None:
        """Use another gate from now on, made for the vehicles as they are."""
        self._system, self._asked = system, careful(gate, system)
        self._following = following(self._asked)
        self._configuration = system.initial
        self._number = {str(robot.id): number for number, robot in enumerate(system.robots)}
        self._decisions: dict[Vehicle, Decision] = {}
        self._since_move: set[Vehicle] = set()
        """The vehicles asked about since the last move: only a move changes an answer."""

    def allows(self, vehicle: Vehicle, now_s: float) -> Refusal | None:
        """Refuse what the gate refuses."""
        self.look()
        if vehicle not in self._since_move:
            self._ask(vehicle)
        decision = self._decisions[vehicle]
        return (
            None
            if decision.admitted
            else Refusal(str(decision.reason), at_s=now_s + _REASK_S, stage=decision.stage)
        )

    def stage(self, vehicle: Vehicle) -> str:
        """Return the stage of the gate that last decided about a vehicle."""
        return self._decisions[vehicle].stage

    def _ask(self, vehicle: Vehicle) -> None:
        began, robot = perf_counter(), self._number[vehicle.name]
        if self._following is not None:
            decision = self._following.decide_here(robot)
        else:
            decision = self._asked.decide(self._configuration, robot)
        self.times[decision.stage].add((perf_counter() - began) * 1e6)
        self.messages += decision.messages
        self._decisions[vehicle] = decision
        self._since_move.add(vehicle)

    def moved(self, vehicle: Vehicle) -> None:
        """Tell the gate that a vehicle got a grant."""
        self._since_move.clear()
        robot = self._number[vehicle.name]
        if self._following is not None:
            self._following.moved_here(robot)
        else:
            self._configuration = self._system.moved(self._configuration, robot)
            self._asked.moved(self._configuration, robot)

    def would_admit(self, vehicle: Vehicle) -> bool:
        """Return whether the gate would admit a vehicle's next move now, without counting the decision."""
        robot = self._number[vehicle.name]
        if self._following is not None:
            return self._following.decide_here(robot).admitted
        return self._asked.decide(self._configuration, robot).admitted

    def blockers(self, vehicle: Vehicle) -> list[str]:
        """Return vehicles of which some must move before a refused vehicle can, as the gate says."""
        self.look()
        robots, decision = self._system.robots, self._decisions.get(vehicle)
        if self._following is not None:  # the vehicles in its way may have changed since
            decision = self._following.decide_here(self._number[vehicle.name])
        return [str(robots[other].id) for other in decision.blockers] if decision else []


class Negotiated:
    """Puts the vehicles of a ledger in the order that a negotiation sets."""

    def __init__(self, system: System | None, negotiation: Negotiation) -> None:
        self._negotiation = careful_order(negotiation)
        self.places: Mapping[str, Place] = {}
        """All places, by name."""
        if system is not None:
            self.go_by(system)

    def go_by(self, system: System) -> None:
        """Use the numbers of vehicles and places in a system."""
        self._robot = {str(robot.id): number for number, robot in enumerate(system.robots)}
        self._state = {str(name): number for number, name in enumerate(system.states)}
        self._names = list(self._state)
        self._known: dict[int, Place] = {}
        if isinstance(self._negotiation, InformedNegotiation):
            self._negotiation.prepare(system)

    def held(self, state: int) -> int:
        """Return how many vehicles occupy a place."""
        return len(self._place(state).bodies)

    def room(self, state: int) -> int:
        """Return how many more vehicles fit into a place."""
        return self._place(state).slots - len(self._place(state).bodies)

    def _place(self, state: int) -> Place:
        return self._known[state] if state in self._known else self.places[self._names[state]]

    def order(self, vehicles: list[Vehicle], now_s: float) -> list[Vehicle]:
        """Return the vehicles in the order of grants: movers first, then as the negotiation says."""
        movers = [vehicle for vehicle in vehicles if vehicle.mover]
        ready: dict[Request, Vehicle] = {}
        for vehicle in vehicles:
            wanted = vehicle.wanted()
            if wanted is None:
                movers.append(vehicle)  # it leaves the road
            elif not vehicle.mover:
                ready[self._request(vehicle, wanted)] = vehicle
        going = list(self._negotiation.order(list(ready), self, now_s)) if ready else []
        return [*movers, *(ready[request] for request in going)]

    def _request(self, vehicle: Vehicle, wanted: Place) -> Request:
        robot = self._robot.setdefault(vehicle.name, len(self._robot))
        return Request(robot, self._number(vehicle.leg.place), self._number(wanted), vehicle.since_s)

    def _number(self, place: Place) -> int:
        number = self._state.setdefault(place.name, len(self._state))
        self._known[number] = place
        return number


def by_chain(gate: Gate) -> bool:
    """Return whether the chain rule alone decides for a gate; gates derived from it may decide otherwise."""
    return type(gate) is CertifiedGate and gate.by_chain_alone


class Deciding:
    """The gate and the negotiation of a ledger.

    Parameters
    ----------
    system, gate, negotiation
        The vehicles at the start, the gate made for them, and the negotiation. System and gate are None
        where all vehicles join later; `go_by` then sets them.
    serve_after_s
        Age from which requests are served, where the gate promises that everyone can go on; 0 for never [s].

    Attributes
    ----------
    asked
        The gate; None if it is the chain rule and stays so.
    """

    def __init__(
        self, system: System | None, gate: Gate | None, negotiation: Negotiation, serve_after_s: float
    ) -> None:
        self.asked = None if gate is not None and by_chain(gate) else AskedGate()
        self._made = (system, gate) if system is not None and gate is not None else None
        self._negotiation, self._serve_after_s = negotiation, serve_after_s or inf
        self._negotiated: Negotiated | None = None

    def ledger(
        self, outside: Sequence[Rule], *, step_s: float, lit: bool = True, everybody: bool = False
    ) -> Ledger:
        """Return an empty ledger with this gate and negotiation.

        `outside`: the rules about spacing and ordinary traffic. `lit`: whether vehicles obey lights.
        """
        negotiation = self._negotiation
        order: Order
        pressing = None
        if type(negotiation) is Pressure:
            crowded, patience_s = negotiation.figures
            pressure = PressureOrder(crowded if negotiation.given else inf, patience_s)
            pressing = None if negotiation.given else pressure
            order = pressure.order
        else:
            self._negotiated = Negotiated(None, negotiation)
            order = self._negotiated.order
        rules = usual(outside, lit=lit)
        self._ledger = ledger = Ledger(
            rules, everybody=everybody, step_s=step_s, order=order, pressing=pressing
        )
        ledger.keeping.outside = [light, *outside] if lit else outside
        ledger.rules_look_near = not outside
        if self._made is not None:
            self.go_by(*self._made)
        return ledger

    def go_by(self, system: System, gate: Gate) -> None:
        """Use another gate from now on, made for the vehicles as they are."""
        ledger, asked, chained = self._ledger, self.asked, by_chain(gate)
        everyone = chained and getattr(gate, "promise", "") == "everyone"
        ledger.keeping.serve_after_s = self._serve_after_s if everyone else inf
        if asked is None or chained:
            ledger.gate = ChainGate()
        else:
            ledger.gate = asked
            asked.go_by(system, gate)
        if self._negotiated is not None:
            self._negotiated.go_by(system)

    def know(self, places: Mapping[str, Place]) -> None:
        """Store all places, by name."""
        if self._negotiated is not None:
            self._negotiated.places = places


NEVER_FULL: Final = 1 << 30
"""Number of slots of a place where vehicles arrive, which is never full."""


class JoinedGate:
    """Makes a new gate whenever vehicles have come or gone.

    Parameters
    ----------
    spec
        The gate's name or class.
    driving
        Drives the vehicles.
    asked
        The gate as a rule of the ledger.
    there
        Number of vehicles for which the first gate was made.
    """

    def __init__(self, spec: object, driving: Driving, asked: AskedGate, there: int) -> None:
        self._spec, self._driving, self._asked = spec, driving, asked
        self._changes = there

    def look(self) -> None:
        """Make the gate anew if vehicles have come or gone."""
        changes, self._changes = self._changes, self._driving.changes
        if changes != self._changes:
            self._asked.go_by(*start_with(self._driving, (), self._spec))

    def admits(self, track: Track) -> bool:
        """Return whether the gate could keep its promise with one more vehicle."""
        try:
            start_with(self._driving, [*self._driving.arrivals.coming, track], self._spec)
        except GateError:
            return False
        return True


def start_with(driving: Driving, joining: Sequence[Track], spec: object) -> tuple[System, Gate]:
    """Return all vehicles as robots, with some that join them, and a gate made for these robots.

    Parameters
    ----------
    joining
        Paths of the vehicles that join, from where they are.
    spec
        The gate's name or class.

    Raises
    ------
    GateError
        If the gate cannot keep its promise with them.
    """
    lines = {
        name: [one.name for one in place.line] for name, place in driving.paths.places.items() if place.line
    }
    tracks, at, left_m = dict[str, Track](), dict[str, int](), dict[str, float]()
    for name, vehicle in driving.ledger.vehicles.items():
        tracks[name], at[name] = driving.diaries[vehicle.row].track, vehicle.leg.number
        left_m[name] = vehicle.left_m()
    for track in joining:
        leg = track.legs[track.position]
        tracks[track.vehicle], at[track.vehicle] = track, track.position
        left_m[track.vehicle] = leg.end_m - track.front_m
        line = lines.setdefault(str(leg.state), [])
        line.insert(sum(left_m[other] <= left_m[track.vehicle] for other in line), track.vehicle)
    names = dict.fromkeys([*(name for line in lines.values() for name in line), *tracks])
    robots = [Robot(RobotId(n), tuple(leg.state for leg in tracks[n].legs), start=at[n]) for n in names]
    there = Counter(robot.path[robot.start] for robot in robots)
    slots = {state: driving.paths.places[state].slots for robot in robots for state in robot.path}
    everybody = len(robots) + SPARE
    slots = {state: everybody if most == NEVER_FULL else most for state, most in slots.items()}
    room = {state: max(most, there[state]) for state, most in slots.items()}
    system = System(robots, room, room.keys())
    gate = make_gate(spec, system, perf_counter)
    refuse_crowd(gate, system, slots)
    return system, gate


def refuse_crowd(gate: Gate, system: System, slots: Mapping[StateId, int]) -> None:
    """Refuse a start in which a place holds more than its slots, if a vehicle could then get stuck.

    Raises `GateError`.
    """
    most = [slots[state] for state in system.states]
    if most == list(system.room) or getattr(gate, "promise", "") != "everyone":
        return
    wide = [max(SPARE, room) if own else room for room, own in zip(most, system.private, strict=True)]
    if find_crowd(system.paths, wide, ()) is not None:
        msg = "with the vehicles that join, not every vehicle could go on for ever"
        raise GateError(msg)
