"""Starts of a gate with vehicles that stand where they are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from time import perf_counter

from loopgate.abstraction.track import Track
from loopgate.errors import GateError
from loopgate.gates import Gate, make_gate
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.simulation.leading import Leads


def start_with(
    leads: Leads,
    joining: Sequence[Track],
    room: Mapping[str, int],
    gate: object,
    passing: Sequence[Sequence[StateId]] = (),
) -> tuple[System, Gate]:
    """Make a system and a gate for the vehicles that there are, and for those that join them.

    Parameters
    ----------
    room
        How many vehicles a place holds, by name.
    gate
        Its name or class.
    passing
        The states of each way that is driven once, by vehicles that come later.

    Raises
    ------
    GateError
        If the gate cannot keep its promise with them.
    """
    members = leads.driver_of
    lines: dict[StateId, list[str]] = {}
    for driver in members.values():
        state = driver.leg(driver.granted).state
        if state not in lines:
            lines[state] = [other.id for other in leads.line(state)]
    tracks = {vehicle: driver.track for vehicle, driver in members.items()}
    left_m = {v: driver.line_m - driver.front_m for v, driver in members.items()}
    positions = {vehicle: driver.granted for vehicle, driver in members.items()}
    for track in joining:
        leg = track.legs[track.start_position]
        tracks[track.vehicle], positions[track.vehicle] = track, track.start_position
        left_m[track.vehicle] = leg.end_m - track.front_m
        line = lines.setdefault(leg.state, [])
        line.insert(sum(left_m[other] <= left_m[track.vehicle] for other in line), track.vehicle)
    standing = [vehicle for line in lines.values() for vehicle in line]
    vehicles = [*standing, *(vehicle for vehicle in members if vehicle not in set(standing))]
    system = _system([tracks[v] for v in vehicles], [positions[v] for v in vehicles], room)
    made = make_gate(gate, system, perf_counter)
    _refuse_crowd(made, system, room, passing)
    return system, made


def _system(tracks: Sequence[Track], positions: Sequence[int], room: Mapping[str, int]) -> System:
    """Return the vehicles as robots that stand where they are; a place holds all that stand in it."""
    robots = [
        Robot(RobotId(track.vehicle), tuple(leg.state for leg in track.legs), start=at % len(track.legs))
        for track, at in zip(tracks, positions, strict=True)
    ]
    visited = dict.fromkeys(state for robot in robots for state in robot.path)
    standing = Counter(robot.path[robot.start] for robot in robots)
    capacity = {state: max(room[state], standing[state]) for state in visited}
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
        msg = "with the vehicles that join, not every vehicle could go on for ever"
        raise GateError(msg)
