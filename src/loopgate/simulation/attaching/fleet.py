"""The vehicles under an attached gate: they join and leave while their owner steps the simulation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from loopgate.abstraction.itinerary import Track
from loopgate.control.diary import Diary
from loopgate.control.parking import mend_order
from loopgate.errors import GateError
from loopgate.gates import Gate, Reason
from loopgate.model import System
from loopgate.negotiation.base import Negotiation
from loopgate.network import RoadNetwork
from loopgate.results.recorder import Recorder
from loopgate.simulation.asked_gate import Deciding, start_with
from loopgate.simulation.attaching.plan import Plan
from loopgate.simulation.drive import Drive
from loopgate.simulation.ground import Ground
from loopgate.simulation.leading import Leading
from loopgate.simulation.scenario import SERVE_AFTER_S
from loopgate.traffic.base import Traffic


class Fleet:
    """The vehicles under a gate, among ordinary traffic; it starts without any.

    Parameters
    ----------
    gate, negotiation
        The gate's name or class, and the negotiation that puts requests in order.
    obeys
        Whether traffic lights are obeyed.

    Notes
    -----
    A vehicle joins when it is with its full length in a place of its loop, and can stop at the end of that
    place. It then holds a slot there and nothing else. A new gate is made for all vehicles where they are.
    The gate refuses a vehicle with which it could not keep its promise.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        recorder: Recorder,
        gate: object,
        negotiation: Negotiation,
        *,
        obeys: bool,
    ) -> None:
        self._traffic, self._gate = traffic, gate
        self._ground = ground = Ground(network, traffic, obeys=obeys, others=True)
        self._deciding = deciding = Deciding(None, None, negotiation, SERVE_AFTER_S)
        ledger = deciding.ledger(ground.rules, step_s=traffic.step_s, lit=ground.is_lit)
        self._driving = ground.driving(ledger, ground.layout({}))
        self._driving.is_courteous = False
        self._ledger = ledger
        self.drive = Drive(traffic, recorder, self._driving, (), None, ground.slack, deciding.asked)
        self.leads = Leading(traffic, self._driving, ())
        self.changes = 0
        """How often vehicles joined or left."""
        self.on_leaving: Callable[[Diary], None] = lambda _: None
        """Called with the diary of each vehicle that leaves."""

    def __contains__(self, vehicle: object) -> bool:
        return vehicle in self._ledger.vehicles

    @property
    def diaries(self) -> Mapping[str, Diary]:
        """The diaries of the vehicles, by name."""
        return self.leads.diaries

    @property
    def settled(self) -> bool:
        """Whether every vehicle holds the place in which it is, and nothing else."""
        every = self._ledger.vehicles.values()
        return all(one.beside or (one.is_settled() and not one.steered) for one in every)

    def report(self) -> dict[str, Any]:
        """Return the figures of lights and ordinary traffic."""
        return self._ground.report()

    def drive_by(self, plan: Plan) -> None:
        """Use a plan for all vehicles, present and later."""
        self._ground.itineraries, room = plan.itineraries, plan.room
        legs = {track.loop: track.legs for track in plan.tracks}
        if self._ledger.vehicles:
            self._driving.paths.lay_more(room, legs, self._driving.diaries)
        else:
            self._driving.paths.lay_anew(self._ground.layout(room, legs.values()))
            self._deciding.know(self._driving.paths.places)

    def take_in(self, tracks: Sequence[Track], *, beyond: int = 0) -> bool:
        """Let vehicles join together if places and gate allow it; return whether they do.

        Call `answer` afterwards. `beyond`: how many vehicles more than its slots a place may hold.
        """
        come = Counter(track.legs[track.position].state for track in tracks)
        places = self._driving.paths.places
        for name, number in come.items():
            if len(places[name].bodies) + number > places[name].slots + beyond:
                return False
        try:
            made = start_with(self._driving, tracks, self._gate)
        except GateError:
            return False
        self.changes += 1
        self._driving.welcome(tracks, beyond)
        for track in tracks:
            self._ledger.vehicles[track.vehicle].held = True
        self._go_by(*made)
        return True

    def _go_by(self, system: System, gate: Gate) -> None:
        self._deciding.go_by(system, gate)
        self.drive.gate = gate

    def let_go(self, vehicles: set[str], reason: str) -> bool:
        """Release vehicles that are under the gate; return whether there were any. Then call `answer`."""
        leaving = sorted(vehicles & self._ledger.vehicles.keys())
        for name in leaving:
            self.on_leaving(self.drive.records[name])
            self._driving.leave(name, reason)
        if not leaving:
            return False
        self.changes += 1
        if self._ledger.vehicles and not self._ledger.by_chain:
            self._go_by(*start_with(self._driving, (), self._gate))
        return True

    def after_step(self) -> None:
        """Drive all vehicles after a step of the simulation."""
        self._driving.after_step()

    def answer(self) -> None:
        """Answer requests after vehicles have joined or left."""
        self._driving.answer()

    def open_up(self) -> None:
        """Open all places that were shut."""
        self._ledger.open_up()

    def pause(self, *, pauses: bool) -> None:
        """Withhold all grants, or allow grants again."""
        for vehicle in self._ledger.vehicles.values():
            if vehicle.withheld in ("", Reason.TRAFFIC):
                vehicle.withheld = str(Reason.TRAFFIC) if pauses else ""

    def stops_at(self, vehicle: str, at_m: float, *, anew: bool) -> None:
        """Set the point where a vehicle stops next by itself [m].

        `anew`: whether it has just made a stop, so that its wait for a grant begins now.
        """
        one = self._ledger.vehicles[vehicle]
        one.stop_m = at_m
        self._driving.keep_hold(one)
        if anew and one.asks:
            self._ledger.withdraw(one)
            self._ledger.consider(one)

    def mend_order(self) -> int:
        """Put the lines of all places in the order on the road; return how many lines were not."""
        return mend_order(self._ledger, self._driving.paths.places.values())
