"""Vehicles that join and leave the gate, in a run or in an attached simulation."""

from collections import Counter
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.track import Track
from loopgate.drive.codes import NOTHING, TRAFFIC
from loopgate.drive.driver import Driver
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.ground import Ground
from loopgate.drive.observed import ObservedEngine
from loopgate.drive.timetable import Timetable
from loopgate.errors import GateError
from loopgate.gates import Gate
from loopgate.gates.certified.chain import closes_by_entering
from loopgate.model import StateId, System
from loopgate.negotiation.base import Negotiation
from loopgate.network import RoadNetwork
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.around.lights import signals_of
from loopgate.simulation.around.surroundings import Surroundings
from loopgate.simulation.drives import Record
from loopgate.simulation.fleet.start import start_with
from loopgate.simulation.scenario import SERVE_AFTER_S
from loopgate.traffic.base import Traffic


@dataclass(frozen=True, slots=True)
class Rules:
    """The rules by which vehicles get grants.

    Attributes
    ----------
    gate, negotiation
        The gate's name or class, and the negotiation.
    lights, others
        Whether traffic lights are obeyed, and whether there is traffic under no gate.
    serve_after_s
        See `Gatekeeper`.
    foresees, unforeseen
        See `Engine`.
    expects
        Whether vehicles come later, on ways that are all known from the beginning on.
    """

    gate: object
    negotiation: Negotiation
    lights: bool
    others: bool = True
    serve_after_s: float = SERVE_AFTER_S
    foresees: bool = False
    unforeseen: Container[str] = ()
    expects: bool = False


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
    start like any other, which the gate refuses if it could not keep its promise. Under the chain rule alone
    none is made for those who drive once: they are residents of no set of places, and loops have left them
    room (`_refuse_crowd`), so the gate promises with them what it did without.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic, recorder: Recorder, rules: Rules) -> None:
        self._traffic, self._recorder, self._rules = traffic, recorder, rules
        self._passing: Sequence[tuple[StateId, ...]] = ()
        """The states of each way that is driven once, by whoever comes."""
        self.room: Mapping[str, int] = {}
        """How many vehicles a state holds, by name."""
        self.slots = 0
        """How many all states on the road hold."""
        self.changes = 0
        """How often vehicles joined or left."""
        self.on_leaving: Callable[[Record], None] = lambda _: None
        """Called with each vehicle that leaves, while it can still be asked."""
        self.keeper = keeper = Gatekeeper(rules.negotiation, serve_after_s=rules.serve_after_s)
        timetable = Timetable(traffic, signals_of(network))
        keeper.timetable = timetable if rules.lights else None
        ground = Ground(recorder.code, step_s=traffic.step_s, signals=keeper.signals)
        self.engine = ObservedEngine(
            traffic,
            (),
            keeper,
            recorder,
            foresees=rules.foresees,
            unforeseen=rules.unforeseen,
            ground=ground,
        )
        self.around = Surroundings(
            network, traffic, self.engine, keeper, recorder.code, timetable, others=rules.others
        )

    @property
    def members(self) -> Mapping[str, Driver]:
        """The vehicles under the gate, by name."""
        return self.engine.driver_of

    @property
    def drive(self) -> ObservedEngine:
        """What drives them."""
        return self.engine

    leads = drive
    """What leads them other ways."""

    @property
    def settled(self) -> bool:
        """Whether every vehicle holds the state it is in and nothing else."""
        return self.engine.settled

    def after_step(self) -> None:
        """Do what is due after a step of the traffic."""
        self.engine.after_step()

    def answer(self) -> None:
        """Answer the requests since somebody has come or gone."""
        self.engine.answer()

    def open_up(self) -> None:
        """Let vehicles into all states again that were shut."""
        self.engine.open_up()

    def pause(self, *, pauses: bool) -> None:
        """Grant nothing to anybody for now, or grant again."""
        self.engine.vehicles["withheld"] = TRAFFIC if pauses else NOTHING  # newcomers are but traffic so far

    def stops_at(self, vehicle: str, at_m: float, *, anew: bool) -> None:
        """Note where a vehicle stops next by itself [m]; `anew`: it has made a stop, and asks as of now."""
        self.members[vehicle].row["stop_m"] = at_m
        if anew:
            self.engine.asks_anew(self.members[vehicle])

    def mend_order(self) -> int:
        """Put the lines of all states in the order on the road; return how many were not in it."""
        return self.engine.mend_order()

    def drive_by(
        self, itineraries: Sequence[Itinerary], ways: Sequence[Track], room: Mapping[str, int]
    ) -> None:
        """Replace the itineraries and tracks of all vehicles, present and later.

        Parameters
        ----------
        room
            How many vehicles a state holds, by name.
        """
        self.room = room
        away = {leg.state for way in itineraries for leg in way.legs[-1:] if leg.away}
        self.slots = sum(most for state, most in room.items() if state not in away)
        once = {id(way.legs): way.legs for way in ways if not way.rounds}
        self._passing = [tuple(leg.state for leg in legs) for legs in once.values()]
        self.engine.lay(ways, room)
        self.around.plan(itineraries, ways)

    def begin(self, system: System, gate: Gate, tracks: Sequence[Track]) -> None:
        """Begin with these vehicles, one per robot, which stand as the system says; or with none of them."""
        self.engine.stand(tracks)
        self.engine.go_by(system, gate, joined=self._rules.expects)

    def take_in(self, tracks: Sequence[Track], *, beyond: int = 0) -> bool:
        """Take vehicles in together if places and gate allow it; return whether they do.

        `answer` has to follow, but not before all who are on the road are taken in: who is granted a state
        counts as ahead of those that are taken in there after it, and would wait for ever behind one that may
        not go before it.

        Parameters
        ----------
        tracks
            They begin where the vehicles are, which can be held at the ends of those states.
        beyond
            By how many vehicles a state may hold more than it has slots for.
        """
        try:
            made = self._with(tracks, beyond)
        except GateError:
            return False
        self.changes += 1
        self.engine.join(tracks)
        if made is not None:
            self.engine.go_by(*made, joined=self._rules.expects)
        return True

    def admits(self, track: Track) -> bool:
        """Return whether `take_in` would take a vehicle in, if it were there."""
        try:
            self._with([track])
        except GateError:
            return False
        return True

    def _with(self, tracks: Sequence[Track], beyond: int = 0) -> tuple[System, Gate] | None:
        """Return the system and the gate with the joining vehicles; None if the gate goes on as it is.

        Raises
        ------
        GateError
            If there is no place for one, or the gate cannot keep its promise.
        """
        come = Counter(track.legs[track.start_position].state for track in tracks)
        for state, number in come.items():
            if len(self.engine.holding(state)) + number > self.room[state] + beyond:
                msg = f"{state} is full"
                raise GateError(msg)
        if not self.keeper.in_place or len(tracks) > 1 or tracks[0].rounds:
            return self._make(tracks)
        if self._closes(tracks[0]):
            msg = "a circle of full places would close"
            raise GateError(msg)
        return None

    def _closes(self, track: Track) -> bool:
        """Return whether a vehicle that begins on a track closes a circle of full places."""
        keeper, at = self.keeper, track.start_position
        first, wanted = (track.legs[(at + ahead) % len(track.legs)].state for ahead in (0, 1))
        here, there = keeper.number(first), keeper.number(wanted)
        if here is None:
            return False
        free = self.room[first] - len(keeper.line(here))
        return closes_by_entering(keeper, here, free=free, onward=there)

    def let_go(self, vehicles: Iterable[str], reason: str) -> bool:
        """Let vehicles under the gate go; return whether there are any: then `answer` has to follow."""
        leaving = sorted(set(vehicles) & self.members.keys())
        if not leaving:
            return False
        now = self._traffic.now_s
        for vehicle in leaving:
            driver = self.members[vehicle]
            self.on_leaving(driver)
            for leg in driver.held[:-1]:
                self._recorder.note(now, vehicle, Event.LEAVE, driver.leg(leg).state)
            self._recorder.note(now, vehicle, Event.END, driver.leg(driver.granted).state, reason)
            self._traffic.leave_gate(vehicle)
        self.changes += 1
        self.engine.leave(leaving)
        if self.members and not self.keeper.in_place:
            self.engine.go_by(*self._make(()), joined=self._rules.expects)
        return True

    def _make(self, joining: Sequence[Track]) -> tuple[System, Gate]:
        """Make system and gate anew, with the joining vehicles.

        Raises
        ------
        GateError
            If the gate cannot keep its promise with them.
        """
        comes_to_stay = self._rules.expects and any(track.rounds for track in joining)
        passing = self._passing if comes_to_stay else ()
        return start_with(self.engine, joining, self.room, self._rules.gate, passing)
