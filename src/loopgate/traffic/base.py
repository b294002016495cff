"""The protocol of a traffic simulator: the calls that the rest of the program makes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

import numpy as np

from loopgate.arrays import Floats
from loopgate.network.stops import Stop

_NOTHING: Final[Floats] = np.zeros(0)


@dataclass(frozen=True, slots=True)
class Collision:
    """A collision as SUMO reports it: the two vehicles and the lane."""

    collider: str
    victim: str
    lane: str


@dataclass(frozen=True, slots=True)
class Insertion:
    """How a vehicle is put in: on which route, of which type, on which lane and where on it [m].

    At rest, or `rolling` as fast as it may there. Besides, attributes as SUMO has them, and parameters by
    key.
    """

    route: str
    kind: str
    lane_index: int
    position_m: float
    attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    parameters: Mapping[str, str] = field(default_factory=dict, hash=False)
    rolling: bool = False


@dataclass(frozen=True, slots=True)
class Dynamics:
    """Data of a vehicle: length [m], acceleration and deceleration [m/s2], factor on speed limits [1]."""

    length_m: float
    accel_mps2: float
    decel_mps2: float
    speed_factor: float


class Light(NamedTuple):
    """The state of a traffic light.

    Attributes
    ----------
    state
        SUMO's letter for each link: ``G`` and ``g`` green, ``y`` yellow, ``r`` red, ``o`` and ``O`` off.
    changes_s
        When it may change next [s]: certain for a program that is fixed, else the earliest.
    program, phase
        Which program it follows and the number of the phase.
    spent_s
        For how long the phase has lasted [s].
    """

    state: str
    changes_s: float
    program: str = ""
    phase: int = 0
    spent_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of a light: the letters, how long at most [s], and the number of the phase after it."""

    state: str
    longest_s: float
    following: int


@dataclass(frozen=True, slots=True)
class Program:
    """The phases of a light, and whether their durations are fixed."""

    phases: tuple[Phase, ...]
    fixed: bool


class Whereabouts(NamedTuple):
    """Vehicles, and of each the lane that its front is on, where on that [m], and its speed [m/s]."""

    vehicles: Sequence[str] = ()
    lanes: Sequence[str] = ()
    positions_m: Floats = _NOTHING
    speeds_mps: Floats = _NOTHING


class Traffic(Protocol):
    """A running simulation of vehicles on roads. Positions in metres, speeds in m/s, times in seconds."""

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""

    @property
    def step_s(self) -> float:
        """Length of a step [s]."""

    def step(self) -> None:
        """Advance by one step; raise `TrafficError` if the simulator stops."""

    def vehicles(self) -> Sequence[str]:
        """Return the vehicles on the road, in a fixed order."""

    def departed(self) -> Sequence[str]:
        """Return the vehicles that were put in in the last step."""

    def arrived(self) -> Sequence[str]:
        """Return the vehicles that went off the road in the last step, at the ends of their routes."""

    def put_in(self, vehicle: str, how: Insertion) -> None:
        """Insert a vehicle in the next step, if the simulator finds it safe."""

    def take_out(self, vehicle: str) -> None:
        """Undo `put_in`, whether it has departed or not."""

    def odometer(self, vehicle: str) -> float:
        """Return the distance driven, counted from an origin of the vehicle's own [m]."""

    @property
    def gives_way(self) -> bool:
        """Whether vehicles under the gate keep the simulator's right of way too."""

    def odometers(self, vehicles: Sequence[str]) -> Floats:
        """Return the odometers [m] of `vehicles`, in their order."""

    def whereabouts(self) -> Whereabouts:
        """Return where all vehicles on the road are, in the order of `vehicles`; read once a step."""

    def whereabouts_of(self, vehicles: Sequence[str]) -> Whereabouts:
        """Return where `vehicles` are now, which the simulator knows."""

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return lane id and position of the front on that lane [m]."""

    def speed(self, vehicle: str) -> float:
        """Return the speed [m/s]."""

    def parks(self, vehicle: str) -> bool:
        """Return whether the vehicle stands beside the lane that it is on."""

    def position(self, vehicle: str) -> tuple[float, float]:
        """Return where the front is, in network coordinates [m]."""

    def put_under_gate(self, vehicle: str, *, keeps_lane: bool = False) -> None:
        """Put the vehicle under the gate: the simulator's right of way no longer rules it.

        It changes lanes where its route demands it; if it `keeps_lane`, only by `change_lane`.
        """

    def leave_gate(self, vehicle: str) -> None:
        """Undo `put_under_gate`, and all that holds the vehicle; it may be gone."""

    def lead(self, vehicle: str, edges: Sequence[str]) -> None:
        """Give the vehicle a route from its edge on; raise `TrafficError` if SUMO refuses the route."""

    def route(self, vehicle: str) -> tuple[Sequence[str], int]:
        """Return the edges of the vehicle's route, and the index of its present or last edge."""

    def route_id(self, vehicle: str) -> str:
        """Return the name of the vehicle's route; a new route has a new name."""

    def mean_speed(self, edge: str) -> float:
        """Return the mean speed of the vehicles on an edge [m/s], or the speed limit if there are none."""

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        """Make a route for `renew` and `forget_stops`."""

    def renew(self, vehicle: str, route: str) -> None:
        """Give the vehicle a route by name; the edge on which it is lies on it.

        While a street on it is closed to the vehicle it keeps the one it has, and this is tried again.
        """

    def lane_index(self, vehicle: str) -> int:
        """Return the index of the vehicle's lane on its edge."""

    def change_lane(self, vehicle: str, lane_index: int) -> None:
        """Ask for a lane change in the next step; the simulator makes it if gaps and speeds allow."""

    def put_on_lane(self, vehicle: str, lane_index: int) -> bool:
        """Move the vehicle to the neighbouring lane if that is free; return whether it is there."""

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        """Limit the speed of a vehicle, or lift the limit.

        With 0 it stands without a stop: one at a stop changes no lanes.
        """

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        """Hold the vehicle: it stops with its front at a position ahead for which it can still brake.

        Return False, with nothing done, if it is on that edge already, and on another lane. Raise
        `TrafficError` if it cannot be held there; `ClosedLaneError` since the lane is closed to it.
        """

    def release(self, vehicle: str) -> None:
        """Undo `hold` and `brake`, standing or not."""

    def brake(self, vehicle: str, *, hard: bool = True) -> None:
        """Stop a vehicle where it is: as hard as possible if it overruns its stop, else gently."""

    def stay_braked(self) -> None:
        """Stop vehicles again that were braked, hard if they are no slower: their owner let them drive."""

    def forget_stops(self, vehicle: str, edge: str, route: str, alone: str) -> bool:
        """Remove the finished stops of a vehicle on edges other than `edge`.

        The vehicle is to go on along `route`, which begins with `edge`; `alone` is a route of `edge` and no
        other. Return False, with nothing done, if the vehicle is not on `edge`.
        """

    def halted(self) -> Sequence[str]:
        """Return the held vehicles that came to rest in the last step."""

    def next_stop(self, vehicle: str) -> tuple[str, float, bool] | None:
        """Return edge and position [m] of the current or next stop of a vehicle, or None.

        And whether it comes after the stop that holds the vehicle, which does not count.
        """

    def set_stop(self, vehicle: str, stop: Stop) -> None:
        """Set a stop at the next pass of that position; raise `TrafficError` if the vehicle cannot stop."""

    def drop_stop(self, vehicle: str, stop: Stop) -> None:
        """Undo `set_stop`."""

    def stops_ahead(self, vehicle: str) -> int:
        """Return the number of current and coming stops of the vehicle, without the stop that holds it."""

    def at_own_stop(self, vehicle: str) -> bool:
        """Return whether a vehicle stands at its own stop, not at a stop of the gate."""

    def stays_s(self, vehicle: str) -> float:
        """Return for how long a vehicle will stand at the stop that it makes [s]; 0 if it makes none."""

    def stay(self, vehicle: str, for_s: float) -> None:
        """Set the remaining duration of the current stop of a vehicle [s]."""

    def awaits(self, vehicle: str) -> bool:
        """Return whether a vehicle at a stop waits for persons or containers."""

    def stops_begun(self) -> Sequence[str]:
        """Return the vehicles that came to rest in the last step at a stop that does not hold them."""

    def stops_ended(self) -> Sequence[str]:
        """Return the vehicles that left a stop of any kind in the last step."""

    def collisions(self) -> Sequence[Collision]:
        """Return the collisions of the last step."""

    def teleports(self) -> Sequence[str]:
        """Return the vehicles that the simulator began to teleport in the last step."""

    def waits_for(self, vehicle: str, *, guess: bool) -> Sequence[str]:
        """Return the vehicles that each, alone, block a standing vehicle.

        Where the simulator gives no reason, `guess` at the likely one.
        """

    def pauses(self, vehicle: str) -> bool:
        """Return whether the vehicle is at a light that is red for it, or at a stop of its own."""

    def dynamics(self, vehicle: str) -> Dynamics:
        """Return the accelerations, length and gap of the vehicle."""

    def show_brakes(self, vehicle: str) -> None:
        """Let others know how hard a vehicle brakes, where it brakes harder than they think."""

    def advise(self, vehicle: str, speed_factor: float) -> None:
        """Set the vehicle's speed factor: its wished speed over the speed limit."""

    def jump(self, vehicle: str) -> float | None:
        """Put the vehicle on an edge ahead on its route where there is room; return the distance skipped [m].

        None if there is no room anywhere ahead.
        """

    def heed_lights(self, vehicle: str, *, heeds: bool) -> None:
        """Set whether a gated vehicle obeys red and amber lights."""

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        """Set whether a gated vehicle keeps the simulator's right of way for vehicles that approach."""

    def light(self, light: str) -> Light:
        """Return the state of a traffic light."""

    def light_program(self, light: str) -> Program:
        """Return the program that a traffic light follows now; without phases if it follows none."""

    def expects_more(self) -> bool:
        """Return whether there are vehicles on the road or still to come."""

    def configured_end_s(self) -> float | None:
        """Return the end time that the simulator's own configuration sets, if any [s]."""

    def close(self) -> None:
        """End the simulation and free it; may be called twice."""
