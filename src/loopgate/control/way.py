"""The path of a vehicle, as it is handed to the ledger."""

from __future__ import annotations

from dataclasses import dataclass

from loopgate.abstraction.itinerary import Leg as Drawn


@dataclass(frozen=True, slots=True)
class Way:
    """A vehicle and its path.

    `loop`: name of the loop or trip. `lap_m`: its length [m]. `top`: top speed of the vehicle [m/s]. `legs`:
    as the abstraction drew them. `edges`: where each edge begins [m], and its name. `position`: the leg in
    which the vehicle starts. `front_m`: arc length of its front there [m]. `renewed_on`: the edge on which
    its route is renewed; `renews`: the route that renews it, or "" if SUMO does so by itself. `keeps_lane`:
    whether SUMO must not change its lane. `foreseen`: whether the time at which it clears a crossing can be
    predicted. `rounds`: `renewed_on` and the next edge, each with the route that begins on it, and the route
    of this edge alone.
    """

    vehicle: str
    loop: str
    lap_m: float
    top: float
    legs: tuple[Drawn, ...]
    edges: tuple[tuple[float, str], ...]
    position: int
    front_m: float
    renewed_on: str
    renews: str = ""
    keeps_lane: bool = False
    foreseen: bool = True
    rounds: tuple[tuple[str, str, str], ...] = ()
