"""Lets vehicles answer the requests in a ledger by messages among themselves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from loopgate.abstraction.itinerary import Abstraction, Itinerary
from loopgate.control.chain import ChainGate, closes
from loopgate.control.ledger import Ledger
from loopgate.control.places import Vehicle
from loopgate.errors import ScenarioError
from loopgate.gates import Gate
from loopgate.gates.algorithm2 import Algorithm2Gate
from loopgate.simulation.asked_gate import AskedGate, by_chain
from loopgate.simulation.by_messages.controllers import Controllers, ControllersHere
from loopgate.simulation.by_messages.controllers_apart import ControllersApart
from loopgate.simulation.by_messages.decisions import DecisionsByMessages
from loopgate.simulation.by_messages.motor import Motor
from loopgate.simulation.by_messages.on_segments import DecisionsOnSegments
from loopgate.simulation.by_messages.sides import far_side
from loopgate.vehicles.air import AirSettings

__all__ = ["ByMessages", "let_vehicles_decide"]


class _ByMonitors(AskedGate):
    """A gate on segments as vehicles and monitors keep it."""

    def stage(self, _vehicle: Vehicle) -> str:
        """Return the name of the stage."""
        return ByMessages.stage


class ByMessages:
    """Answers the requests in a ledger by messages among the vehicles.

    Parameters
    ----------
    ledger
        The ledger, without vehicles yet. Its rules are what a vehicle senses by itself.
    names
        The vehicles; all are in the ledger when it answers for the first time.
    itineraries
        The paths of the vehicles on the road.

    Attributes
    ----------
    stage
        Name of the stage that decides, in events and figures.
    """

    stage = "posts"

    def __init__(
        self,
        ledger: Ledger,
        motor: Motor,
        decisions: DecisionsByMessages | DecisionsOnSegments,
        names: Sequence[str],
        itineraries: Iterable[Itinerary],
    ) -> None:
        self._motor, self._decisions, self._names, self._itineraries = motor, decisions, names, itineraries
        self._begun = False
        self._first = True
        ledger.look, ledger.decide = self._look, self._decide

    @property
    def sent(self) -> int:
        """Number of messages that vehicles and posts have sent."""
        return sum(self._decisions.radio.sent.values())

    def report(self) -> Mapping[str, Any]:
        """Return the figures for ``summary.json``."""
        return {"by_messages": self._decisions.report()}

    def close(self) -> None:
        """End the controllers of the vehicles."""
        self._decisions.controllers.close()

    def _look(self, now_s: float) -> None:
        """Deliver the messages that have arrived, before requests are answered."""
        if not self._begun:
            self._begin()
        self._first = True
        self._decisions.look(now_s)

    def _begin(self) -> None:
        self._begun = True
        self._motor.begin(self._names)
        self._decisions.begin()
        numbers = {place.name: number for place, number in self._motor.where.number.items()}
        self._decisions.radio.far_side = far_side(self._itineraries, numbers.get)

    def _decide(self, vehicles: list[Vehicle]) -> list[Vehicle]:
        """Let vehicles without an obstacle ask by messages; return the vehicles that go."""
        legs = [vehicle.granted for vehicle in vehicles]
        self._decisions.decide(self._motor.ready(vehicles), self._motor.now_s, first=self._first)
        self._first = False
        return [one for one, leg in zip(vehicles, legs, strict=True) if one.granted > leg]


def let_vehicles_decide(
    settings: AirSettings,
    seed: int,
    ledger: Ledger,
    abstraction: Abstraction,
    gate: Gate,
) -> ByMessages:
    """Make vehicles decide by messages what the gate would decide.

    Parameters
    ----------
    seed
        Seed of the losses and delays of messages.
    ledger
        The ledger, without vehicles yet.
    gate
        The gate made for the vehicles of the abstraction.

    Raises
    ------
    ScenarioError
        If there is no protocol for the gate.
    """
    system = abstraction.system
    if isinstance(gate, Algorithm2Gate):
        ledger.gate = asked = _ByMonitors(system, gate)
        motor = Motor(ledger, asked.would_admit)
        private = zip(system.states, system.private, strict=True)
        shared = {str(name) for name, own in private if not own}
        decisions: DecisionsByMessages | DecisionsOnSegments = DecisionsOnSegments(
            settings, seed, motor, shared, gate.lookahead
        )
    elif by_chain(gate) and len(system.robots) > 1:
        ledger.gate = ChainGate(ByMessages.stage)
        motor = Motor(ledger, _goes_on)
        room = {str(name): most for name, most in abstraction.room.items()}
        decisions = DecisionsByMessages(settings, seed, motor, _controllers(settings, seed), room)
    else:
        msg = (
            "decide: vehicles works where the chain rule decides alone: two vehicles at least, and "
            "all places hold two; take central"
        )
        raise ScenarioError(msg)
    names = [str(robot.id) for robot in system.robots]
    return ByMessages(ledger, motor, decisions, names, abstraction.itineraries)


def _goes_on(vehicle: Vehicle) -> bool:
    """Return whether a vehicle has a free slot ahead and the chain rule lets it go."""
    wanted = vehicle.wanted()
    return wanted is not None and not wanted.is_full() and not closes(vehicle)


def _controllers(settings: AirSettings, seed: int) -> Controllers:
    """Return controllers in separate processes, or in this process."""
    return ControllersApart(settings, seed) if settings.processes else ControllersHere()
