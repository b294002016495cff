"""A gate that knows the vehicles at its start only: it is made anew whenever some have come or gone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from time import perf_counter

from loopgate.control.driving import Driving
from loopgate.control.way import Way
from loopgate.errors import GateError
from loopgate.gates import Gate, make_gate
from loopgate.gates.certified.crowding import SPARE
from loopgate.model import Robot, RobotId, System
from loopgate.simulation.ledger_departures import NEVER_FULL
from loopgate.simulation.ledger_gate import AskedGate

__all__ = ["JoinedGate"]


class JoinedGate:
    """Makes a gate anew for the vehicles that there are; they stand as a start of a system does.

    Parameters
    ----------
    spec
        The gate's name or class.
    driving, asked
        Drives the vehicles; what asks the gate.
    there
        For how many vehicles the gate was made that is there at the beginning.
    """

    def __init__(self, spec: object, driving: Driving, asked: AskedGate, there: int) -> None:
        self._spec, self._driving, self._asked = spec, driving, asked
        self._changes = there

    def look(self) -> None:
        """Make the gate anew if vehicles have come or gone."""
        changes, self._changes = self._changes, self._driving.changes
        if changes != self._changes:
            self._asked.go_by(*self._make(()))

    def admits(self, way: Way) -> bool:
        """Return whether the gate could keep its promise with a vehicle that is to come too."""
        try:
            self._make([*self._driving.coming, way])
        except GateError:
            return False
        return True

    def _make(self, coming: Sequence[Way]) -> tuple[System, Gate]:
        """Return the vehicles as robots in the order of their lines, with some behind them, and their gate.

        A place holds all that are in it. Raises `GateError` if the gate cannot keep its promise.
        """
        driving = self._driving
        in_line = [vehicle for place in driving.places.values() for vehicle in place.line]
        ways = [driving.diaries[vehicle.row].way for vehicle in in_line]
        at = [*(vehicle.leg.number for vehicle in in_line), *(way.position for way in coming)]
        robots = [
            Robot(RobotId(way.vehicle), tuple(leg.state for leg in way.legs), start=start)
            for way, start in zip([*ways, *coming], at, strict=True)
        ]
        there = Counter(robot.path[robot.start] for robot in robots)
        everybody = len(robots) + SPARE
        slots = {name: driving.places[name].slots for robot in robots for name in robot.path}
        room = {n: max(everybody if most == NEVER_FULL else most, there[n]) for n, most in slots.items()}
        system = System(robots, room, room.keys())
        return system, make_gate(self._spec, system, perf_counter)
