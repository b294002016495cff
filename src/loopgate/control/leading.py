"""Changes to the paths of vehicles while they drive."""

from __future__ import annotations

from loopgate.control.chain import closes_by_turning
from loopgate.control.ledger import Ledger
from loopgate.control.places import Body, Leg, Make, Vehicle


def may_turn_off(vehicle: Vehicle, leg: Leg) -> bool:
    """Return whether a vehicle can now change to another path, on which its place is `leg`.

    It can if it holds its place and nothing else, is neither steered nor a mover, and closes no circle of
    full places by the change.
    """
    if not vehicle.is_settled() or vehicle.steered or vehicle.mover:
        return False
    return not closes_by_turning(vehicle, leg)


def turn_off(ledger: Ledger, vehicle: Vehicle, leg: Leg, make: Make, lap_m: float) -> float:
    """Move a vehicle to another path, where it goes on from `leg`.

    Return by how much arc lengths on the new path are larger [m]. `make`, `lap_m`: properties of the vehicle
    and length of the lap on the new path.
    """
    withdraw(ledger, vehicle)
    by_m = vehicle.turn_off(leg, make, lap_m)
    body, place = vehicle.bodies[0], leg.place
    out_m = vehicle.line_m + make.length_m
    vehicle.bodies[0] = place.bodies[place.bodies.index(body)] = Body(vehicle, place, leg.begin_m, out_m)
    ledger.consider(vehicle)
    return by_m


def withdraw(ledger: Ledger, vehicle: Vehicle) -> None:
    """Forget the request of a vehicle and why it was refused; its wait so far still counts."""
    if vehicle.asks:
        vehicle.longest_s = max(vehicle.longest_s, ledger.now_s - vehicle.since_s)
    ledger.withdraw(vehicle)
    vehicle.reason = ""
    vehicle.refused_s.clear()
