"""Makes a new gate for the vehicles on the road whenever vehicles come or go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import Final

from loopgate.abstraction.itinerary import Track
from loopgate.control.driving import Driving
from loopgate.errors import GateError
from loopgate.gates import Gate, make_gate
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.simulation.asked_gate import AskedGate

__all__ = ["NEVER_FULL", "JoinedGate", "refuse_crowd", "start_with"]

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
