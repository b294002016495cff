"""Vehicles that are led: on by other paths, or by nothing, while something stands in their way."""

from __future__ import annotations

from math import inf

from loopgate.control.chain import closes_by_turning
from loopgate.control.ledger import Ledger
from loopgate.control.places import Body, Leg, Make, Vehicle
from loopgate.control.refusal import Refusal


def withheld(vehicle: Vehicle, _now_s: float) -> Refusal | None:
    """Refuse a vehicle that is to be granted nothing for now."""
    return Refusal(vehicle.withheld, outside=True) if vehicle.withheld else None


def may_turn_off(vehicle: Vehicle, leg: Leg) -> bool:
    """Return whether a vehicle can go on by another path now, on which its place is a leg.

    It can where it holds that place and nothing else, does not have to move out of another's way next, and
    closes no circle of full places by it.
    """
    if not vehicle.is_settled() or vehicle.steered or vehicle.mover:
        return False
    return not closes_by_turning(vehicle, leg)


def turn_off(ledger: Ledger, vehicle: Vehicle, leg: Leg, make: Make, lap_m: float) -> float:
    """Move a vehicle to another path, on which it goes on from `leg`.

    Return what to add to its old arc lengths to get the new ones [m]. `make`, `lap_m`: on that path.
    """
    withdraw(ledger, vehicle)
    by_m = vehicle.turn_off(leg, make, lap_m)
    body, place = vehicle.bodies[0], leg.place
    out_m = vehicle.line_m + make.length_m
    vehicle.bodies[0] = place.bodies[place.bodies.index(body)] = Body(vehicle, place, leg.begin_m, out_m)
    ledger.consider(vehicle)
    return by_m


def wait_for_nothing(ledger: Ledger, vehicle: Vehicle) -> None:
    """Let a vehicle stand where it is and ask for nothing, until `wait_again`."""
    withdraw(ledger, vehicle)
    vehicle.stop_m = vehicle.front_m
    vehicle.near = False


def wait_again(ledger: Ledger, vehicle: Vehicle) -> None:
    """Let a vehicle ask in its turn again."""
    vehicle.stop_m = inf
    ledger.consider(vehicle)


def withdraw(ledger: Ledger, vehicle: Vehicle) -> None:
    """Forget the request of a vehicle, if it has one, and why it was refused; its wait counts."""
    if vehicle.asks:
        vehicle.longest_s = max(vehicle.longest_s, ledger.now_s - vehicle.since_s)
    ledger.withdraw(vehicle)
    vehicle.reason = ""
    vehicle.refused_s.clear()
