"""The seam to the traffic simulator: what the rest of the program asks of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

__all__ = ["Collision", "Dynamics", "Foe", "Leader", "Traffic"]


@dataclass(frozen=True, slots=True)
class Collision:
    """A collision as SUMO reports it: who ran into whom, and on which lane."""

    collider: str
    victim: str
    lane: str


@dataclass(frozen=True, slots=True)
class Leader:
    """The vehicle ahead on the same way.

    Attributes
    ----------
    vehicle
        Its id.
    gap_m
        From front bumper to its rear bumper, less the follower's minimum gap [m].
    """

    vehicle: str
    gap_m: float


@dataclass(frozen=True, slots=True)
class Foe:
    """A vehicle with a conflicting movement at the next junction.

    Attributes
    ----------
    vehicle
        Its id.
    inside
        Whether it is on the junction already, in the asking vehicle's way; else it is one that the right of
        way makes the asking vehicle wait for.
    """

    vehicle: str
    inside: bool


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What a vehicle can do: length [m], acceleration and deceleration [m/s2], factor on speed limits [1]."""

    length_m: float
    accel_mps2: float
    decel_mps2: float
    speed_factor: float


class Traffic(Protocol):
    """A running simulation of vehicles on roads. Positions in metres, speeds in m/s, times in seconds."""

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""
        ...

    @property
    def step_s(self) -> float:
        """Length of a step [s]."""
        ...

    def step(self) -> None:
        """Advance by one step; raise `TrafficError` if the simulator stops."""
        ...

    def vehicles(self) -> Sequence[str]:
        """Return the vehicles on the road, in a fixed order."""
        ...

    def odometer(self, vehicle: str) -> float:
        """Return the distance driven since insertion, plus the insertion position on the first lane [m]."""
        ...

    def speed(self, vehicle: str) -> float:
        """Return the speed [m/s]."""
        ...

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return lane id and position of the front on that lane [m]."""
        ...

    def put_under_gate(self, vehicle: str) -> None:
        """Let the gate rule the vehicle instead of the simulator's right of way."""
        ...

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> None:
        """Make the vehicle come to rest with its front at a position ahead that it can still brake for."""
        ...

    def release(self, vehicle: str) -> None:
        """Undo `hold`, standing or not."""
        ...

    def halted(self) -> Sequence[str]:
        """Return the held vehicles that came to rest in the last step."""
        ...

    def collisions(self) -> Sequence[Collision]:
        """Return the collisions of the last step."""
        ...

    def teleports(self) -> Sequence[str]:
        """Return the vehicles that the simulator began to teleport in the last step."""
        ...

    def leader(self, vehicle: str, look_m: float) -> Leader | None:
        """Return the vehicle ahead within `look_m`, on its lane or beyond the next junction."""
        ...

    def foes(self, vehicle: str, look_m: float) -> Sequence[Foe]:
        """Return whom the vehicle waits for at the next junction within `look_m`."""
        ...

    def dynamics(self, vehicle: str) -> Dynamics:
        """Return what the vehicle can do."""
        ...

    def jump(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        """Put the vehicle elsewhere on its route; return whether there was room."""
        ...

    def close(self) -> None:
        """End the simulation and free it; may be called twice."""
        ...
