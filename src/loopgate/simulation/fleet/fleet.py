"""Vehicles under a gate that join and leave: in a run as in a simulation of somebody else's."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter

from loopgate.abstraction.itinerary import Itinerary
from loopgate.drive.books import Books
from loopgate.drive.changing import ChangingEngine
from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.obstacles import Obstacle
from loopgate.drive.timetable import Timetable
from loopgate.drive.track import Track
from loopgate.errors import GateError
from loopgate.gates import Gate, make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.gates.certified.entering import closes_by_entering
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.negotiation.base import Negotiation
from loopgate.network import RoadNetwork
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.around.lights import signals_of
from loopgate.simulation.around.surroundings import Surroundings
from loopgate.simulation.scenario import SERVE_AFTER_S
from loopgate.traffic.base import Traffic

_Ready = tuple[Sequence[Track], Books, System, Gate]
"""Tracks, books, system and gate that vehicles go on with."""


@dataclass(frozen=True, slots=True)
class Rules:
    """By what vehicles are let go.

    Attributes
    ----------
    gate, negotiation
        The gate's name or class, and the negotiation.
    lights, others
        Whether traffic lights are obeyed, and whether there is traffic under no gate.
    serve_after_s
        See `Gatekeeper`.
    foresees
        See `Engine`.
    """

    gate: object
    negotiation: Negotiation
    lights: bool
    others: bool = True
    serve_after_s: float = SERVE_AFTER_S
    foresees: bool = False


class Fleet:
    """The vehicles under a gate.

    Parameters
    ----------
    rules
        By what they are let go.

    Notes
    -----
    A vehicle is taken in where it is as a whole in a place of its loop and can stop at the end of that: then
    it holds a slot there and nothing else, and the gate is made anew for all vehicles as they stand. It is a
    start like any other, which the gate refuses if it could not keep its promise.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic, recorder: Recorder, rules: Rules) -> None:
        self._network, self._traffic, self._recorder, self._rules = network, traffic, recorder, rules
        self._obstacles: tuple[Obstacle, ...] = ()
        """Obstacles besides the surroundings; asked first."""
        self._itineraries: Sequence[Itinerary] = ()
        self._ways: Sequence[Track] = ()
        self._passing: Sequence[tuple[StateId, ...]] = ()
        """The states of each way that is driven once, by whoever comes."""
        self.room: Mapping[str, int] = {}
        """How many vehicles a state holds, by name."""
        self.slots = 0
        """How many all states on the road hold."""
        self.keeper: Gatekeeper | None = None
        self.engine: ChangingEngine | None = None
        self.around: Surroundings | None = None
        self.looks: Sequence[Callable[[], None]] = ()
        """What surroundings have to do after each step, once the drive has done its part."""
        self._leaving: Sequence[str] = ()
        """Vehicles that are to be let go with the next change."""
        self.changes = 0
        """How often vehicles joined or left."""
        self.stays = False
        """Whether vehicles come later, on ways that are all known from the beginning on."""
        self.on_leaving: Callable[[Driver], None] = lambda _: None
        """Called with each vehicle that leaves, while it can still be asked."""

    @property
    def members(self) -> Mapping[str, Driver]:
        """The vehicles under the gate, by name."""
        return self.engine.driver_of if self.engine else {}

    @property
    def books(self) -> Books:
        """The holders of every place and crossing."""
        books = self.engine.books() if self.engine is not None and self.members else Books({}, {}, {})
        books.strike(self._leaving)
        return books

    def drive_by(
        self, itineraries: Sequence[Itinerary], ways: Sequence[Track], room: Mapping[str, int]
    ) -> None:
        """Take over what vehicles drive by, now and later; before they begin, or anew.

        Parameters
        ----------
        room
            How many vehicles a state holds, by name.
        """
        self._itineraries, self._ways, self.room = itineraries, ways, room
        away = {leg.state for way in itineraries for leg in way.legs[-1:] if leg.away}
        self.slots = sum(most for state, most in room.items() if state not in away)
        once = {id(way.legs): way.legs for way in ways if not way.rounds}
        self._passing = [tuple(leg.state for leg in legs) for legs in once.values()]
        if self.around is not None:
            self.around.plan(itineraries, ways)

    def begin(self, system: System, gate: Gate, tracks: Sequence[Track]) -> ChangingEngine:
        """Begin with these vehicles, one per robot, which stand as the system says; or with none of them."""
        rules, traffic = self._rules, self._traffic
        self.keeper = Gatekeeper(system, gate, rules.negotiation, serve_after_s=rules.serve_after_s)
        self.keeper.obstacles = self._obstacles
        timetable = Timetable(traffic, signals_of(self._network))
        if rules.lights:
            self.keeper.timetable = timetable
        self.engine = engine = ChangingEngine(
            traffic, tracks, self.keeper, self._recorder, foresees=rules.foresees
        )
        self.around = Surroundings(
            self._network, traffic, engine, self.keeper, timetable, others=rules.others
        )
        self.looks = self.around.each_step
        if self.stays and isinstance(gate, CertifiedGate):
            engine.drive_by(self._ways, self.room)
        self.around.plan(self._itineraries, self._ways)
        return engine

    def take_in(self, tracks: Mapping[str, Track], left_m: Mapping[str, float], *, beyond: int = 0) -> bool:
        """Take vehicles in together if places and gate allow it; return whether they do.

        Parameters
        ----------
        tracks
            By vehicle; it begins where the vehicle is, and can be held at the end of that state.
        left_m
            How far it is to there [m].
        beyond
            By how many vehicles a state may hold more than it has slots for.
        """
        if len(tracks) == 1 and not beyond and self.in_place:
            track = next(iter(tracks.values()))
            if not track.rounds and self.engine is not None and self.engine.seats(track):
                return self._seat(self.engine, track)
        ready = self._ready(tracks, left_m, beyond)
        if ready is None:
            return False
        self._go_on(*ready)
        return True

    def admits(self, tracks: Mapping[str, Track], left_m: Mapping[str, float]) -> bool:
        """Return whether `take_in` would take them in, if they were there; places have slots for them.

        Of those who drive once, the chain rule can be asked without a gate made anew: they are residents of
        no set of places.
        """
        alone = len(tracks) == 1 and not any(track.rounds for track in tracks.values())
        if alone and self.keeper is not None and self.keeper.by_chain and (self.members or self.in_place):
            return not any(self._closes(track) for track in tracks.values())
        return self._ready(tracks, left_m, 0) is not None

    def _closes(self, track: Track) -> bool:
        """Return whether a vehicle that begins on a track closes a circle of full places."""
        if self.keeper is None:
            return False
        first, wanted = (
            track.legs[(track.start_position + ahead) % len(track.legs)].state for ahead in (0, 1)
        )
        here = self.keeper.number(first)
        if here is None:
            return False  # no member comes there
        return closes_by_entering(self.keeper, here, room=self.room[first], wanted=self.keeper.number(wanted))

    def holders(self, state: str) -> list[Driver]:
        """Return the members that hold a state."""
        number = self.keeper.number(state) if self.keeper is not None else None
        if self.keeper is None or self.engine is None or number is None or not self.members:
            return []
        return [self.engine.drivers[robot] for robot in self.keeper.holders(number)]

    @property
    def in_place(self) -> bool:
        """Whether those who drive once join and leave one by one, and nothing is made anew for them.

        They are residents of no set of places, and loops have left them room (`_refuse_crowd`), so the gate
        promises with them what it did without.
        """
        return self.engine is not None and self.engine.changes_in_place

    def _seat(self, engine: ChangingEngine, track: Track) -> bool:
        """Take in a vehicle that drives once if its place and the chain rule allow it."""
        self.settle()
        state = track.legs[track.start_position].state
        if len(self.holders(state)) >= self.room[state] or self._closes(track):
            return False
        self.changes += 1
        engine.seat(track)
        return True

    def _ready(self, tracks: Mapping[str, Track], left_m: Mapping[str, float], beyond: int) -> _Ready | None:
        """Return what the vehicles are to go on with when some join, None if they must not."""
        books, drivers = self.books, self.members

        def left(state: str, other: str) -> float:
            return left_m[other] if other in left_m else drivers[other].left_m(state)

        for vehicle, track in tracks.items():
            state = track.legs[track.start_position].state
            if len(books.holders.get(state, ())) >= self.room[state] + beyond:
                return None
            books.enter(vehicle, state, left_m[vehicle], partial(left, state))
        try:
            return self._make(books, tracks)
        except GateError:
            return None

    def drop(self, vehicles: Sequence[str], reason: str) -> None:
        """Let vehicles go that are under the gate."""
        self.let_go(vehicles, reason)
        self.settle()
        self.answer()

    def let_go(self, vehicles: Sequence[str], reason: str) -> None:
        """Let vehicles go with the next change; `settle` has to follow."""
        leaving = sorted(set(vehicles) & self.members.keys())
        if not leaving or self.engine is None:
            return
        now = self._traffic.now_s
        for vehicle in leaving:
            driver = self.members[vehicle]
            self.on_leaving(driver)
            for leg in range(int(driver.row["tail"]), driver.granted):
                self._recorder.note(now, vehicle, Event.LEAVE, driver.leg(leg).state)
            self._recorder.note(now, vehicle, Event.END, driver.leg(driver.granted).state, reason)
            self._traffic.leave_gate(vehicle)
        self._leaving = leaving

    def settle(self) -> None:
        """Make the change that is due since vehicles were let go, if it has not been made."""
        if not self._leaving or self.engine is None:
            return
        once = not any(self.members[vehicle].track.rounds for vehicle in self._leaving)
        if once and self.engine.unseat(self._leaving):
            self.changes += 1
            self._leaving = ()
            return
        books = self.books
        if books.everybody:
            self._change(books)
        else:
            self._leaving = ()
            self.engine.clear()

    def answer(self) -> None:
        """Let others go where that is possible since vehicles have come or gone in place.

        Not before all who are on the road are taken in: who is granted a state counts as ahead of those that
        are taken in there after it, and would wait for ever behind one that may not go before it.
        """
        if self.engine is not None and self.in_place:
            self.engine.answer()

    def _on(self, track: Track) -> Track:
        """Return the track of a member as it is to go on."""
        return track

    def _change(self, books: Books) -> None:
        """Make system, gate and tables anew: some have left, or what they drive by is another."""
        self._go_on(*self._make(books, {}))

    def _make(self, books: Books, joining: Mapping[str, Track]) -> _Ready:
        """Make system and gate anew.

        Raises
        ------
        GateError
            If the gate cannot keep its promise with those who join.
        """
        members = self.members
        vehicles = books.everybody
        tracks = [joining[v] if v in joining else self._on(members[v].track) for v in vehicles]
        positions = [
            track.start_position if track.vehicle in joining else members[track.vehicle].granted
            for track in tracks
        ]
        room = self.room
        standing = Counter({state: len(line) for state, line in books.lines.items()})
        standing.update(str(members[vehicle].leg(members[vehicle].granted).state) for vehicle in books.aside)
        system = _system(tracks, positions, standing, room)
        gate = make_gate(self._rules.gate, system, perf_counter)
        if self.stays and isinstance(gate, CertifiedGate):
            gate.expect_others()
        comes_to_stay = self.stays and any(track.rounds for track in joining.values())
        _refuse_crowd(gate, system, room, self._passing if comes_to_stay else ())
        return tracks, books, system, gate

    def _go_on(self, tracks: Sequence[Track], books: Books, system: System, gate: Gate) -> None:
        self.changes += 1
        self._leaving = ()
        engine = self.engine or self.begin(system, gate, ())
        engine.change(tracks, books, system=system, gate=gate, room=self.room)


def _system(
    tracks: Sequence[Track], positions: Sequence[int], standing: Mapping[str, int], room: Mapping[str, int]
) -> System:
    """Return the vehicles as robots that stand where they are; a place holds all that stand in it."""
    robots = [
        Robot(
            RobotId(track.vehicle),
            tuple(leg.state for leg in track.legs),
            start=position % len(track.legs),
        )
        for track, position in zip(tracks, positions, strict=True)
    ]
    visited = dict.fromkeys(state for robot in robots for state in robot.path)
    capacity = {StateId(state): max(room[state], standing.get(state, 0)) for state in visited}
    return System(robots, capacity, capacity.keys())


def _refuse_crowd(
    gate: Gate, system: System, room: Mapping[str, int], passing: Sequence[Sequence[StateId]] = ()
) -> None:
    """See to it that everyone can still go on where a place holds more than it has slots for.

    And that those can who come later on ways that are driven once: nothing is looked at when they do.
    """
    slots = [room[state] for state in system.states]
    if (slots == list(system.room) and not passing) or getattr(gate, "promise", "") != "everyone":
        return
    wide = [max(SPARE, most) if own else most for most, own in zip(slots, system.private, strict=True)]
    number = {state: place for place, state in enumerate(system.states)}
    ways = [[number.get(state, len(number)) for state in way] for way in passing]
    if find_crowd(system.paths, wide, ways) is not None:
        msg = "with those who join not everyone could go on for ever"
        raise GateError(msg)
