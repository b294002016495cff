"""The way of a vehicle, as it comes to the ledger."""

from __future__ import annotations

from dataclasses import dataclass

from loopgate.abstraction.itinerary import Leg as Drawn


@dataclass(frozen=True, slots=True)
class Way:
    """A vehicle's loop: its name, its length [m], its top speed [m/s], its legs, and where its edges begin.

    `position` and `front_m`: the leg in which the vehicle starts, and where its front is. `renewed_on`: the
    edge on which its route is renewed; `renews`: by which route, unless the simulator does so by itself.
    `rounds`: that edge and the next, each with the route that begins there, and the route of that edge alone.
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
