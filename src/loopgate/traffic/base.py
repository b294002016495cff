"""The interface of a traffic simulator: the calls that loopgate makes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
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
    """How a vehicle is inserted: its route, its type, its lane and the position there [m].

    It starts at rest, or `rolling`: as fast as allowed there. `attributes`: XML attributes as SUMO names
    them. `parameters`: by key.
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
    """Data of a vehicle: length [m], acceleration and deceleration [m/s2], factor on speed limits [1].

    `min_gap_m`: the gap to a vehicle ahead when it stands; by default SUMO's for a car [m]. `top_mps`: its
    own top speed, whatever the limits [m/s]. `dawdles`: the share of its acceleration that its driver may
    leave unused in a step, SUMO's sigma.
    """

    length_m: float
    accel_mps2: float
    decel_mps2: float
    speed_factor: float
    min_gap_m: float = 2.5
    top_mps: float = inf
    dawdles: float = 0.5


class Light(NamedTuple):
    """The state of a traffic light.

    Attributes
    ----------
    state
        SUMO's letter for each link: ``G`` and ``g`` green, ``y`` yellow, ``r`` red, ``o`` and ``O`` off.
    changes_s
        When it changes next [s]; for a program that is not fixed, the earliest time.
    program, phase
        Name of its program, and index of the phase.
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
    """A phase of a light: its letters, its longest duration [s], and the index of the phase that follows."""

    state: str
    longest_s: float
    following: int


@dataclass(frozen=True, slots=True)
class Program:
    """The phases of a light, and whether their durations are fixed."""

    phases: tuple[Phase, ...]
    fixed: bool


class Whereabouts(NamedTuple):
    """Vehicles, the lane of each front, the position of the front on it [m], and the speed [m/s]."""

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

    @property
    def in_this_process(self) -> bool:
        """Whether the simulation runs in this process."""

    def step(self) -> None:
        """Advance by one step; raise `TrafficError` if the simulator stops."""

    def vehicles(self) -> Sequence[str]:
        """Return the vehicles on the road, in a fixed order."""

    def departed(self) -> Sequence[str]:
        """Return the vehicles that were inserted in the last step."""

    def outside(self) -> Sequence[str]:
        """Return the vehicles that wait for space to be inserted."""

    def arrived(self) -> Sequence[str]:
        """Return the vehicles that reached the end of their route in the last step."""

    def put_in(self, vehicle: str, how: Insertion) -> None:
        """Insert a vehicle in the next step, if the simulator finds it safe."""

    def take_out(self, vehicle: str) -> None:
        """Remove a vehicle that `put_in` has inserted or was to insert."""

    def odometer(self, vehicle: str) -> float:
        """Return the distance driven, counted from an origin of the vehicle's own [m]."""

    @property
    def gives_way(self) -> bool:
        """Whether gated vehicles also obey the simulator's right of way."""

    def odometers(self, vehicles: Sequence[str]) -> list[float]:
        """Return the odometers [m] of `vehicles`, in their order."""

    def whereabouts(self) -> Whereabouts:
        """Return the positions of all vehicles, in the order of `vehicles`; read at most once in a step."""

    def whereabouts_of(self, vehicles: Sequence[str]) -> Whereabouts:
        """Return the positions of `vehicles`, all of which the simulator knows."""

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return lane id and position of the front on that lane [m]."""

    def speed(self, vehicle: str) -> float:
        """Return the speed [m/s]."""

    def parks(self, vehicle: str) -> bool:
        """Return whether a vehicle stands beside its lane."""

    def position(self, vehicle: str) -> tuple[float, float]:
        """Return the position of the front in network coordinates [m]."""

    def put_under_gate(self, vehicle: str, *, keeps_lane: bool = False) -> None:
        """Put a vehicle under the gate: it no longer obeys the simulator's right of way.

        It changes lanes where its route demands it; if it `keeps_lane`, only by `change_lane`.
        """

    def leave_gate(self, vehicle: str) -> None:
        """Undo `put_under_gate` and every hold; the vehicle may have left the road."""

    def lead(self, vehicle: str, edges: Sequence[str]) -> None:
        """Give a vehicle a route from its present edge; raise `TrafficError` if SUMO refuses the route."""

    def route(self, vehicle: str) -> tuple[Sequence[str], int]:
        """Return the edges of the vehicle's route, and the index of its present or last edge."""

    def route_id(self, vehicle: str) -> str:
        """Return the name of the vehicle's route; a new route has a new name."""

    def mean_speed(self, edge: str) -> float:
        """Return the mean speed of the vehicles on an edge [m/s], or the speed limit if there are none."""

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        """Add a route for `renew` and `forget_stops`."""

    def renew(self, vehicle: str, route: str) -> None:
        """Give a vehicle a route by name; its present edge must be on the route.

        While a street of the new route is closed to the vehicle, it keeps its old route, and the call is
        repeated.
        """

    def lane_index(self, vehicle: str) -> int:
        """Return the index of the vehicle's lane on its edge."""

    def change_lane(self, vehicle: str, lane_index: int) -> None:
        """Ask for a lane change in the next step; the simulator makes it if gaps and speeds allow."""

    def put_on_lane(self, vehicle: str, lane_index: int) -> bool:
        """Move a vehicle to the neighbouring lane if there is space; return whether it is there."""

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        """Limit the speed of a vehicle [m/s]; None lifts the limit.

        With 0 the vehicle stands without a stop, so that it can still change lanes.
        """

    def stand(self, vehicle: str, *, stands: bool) -> None:
        """Set whether a vehicle that stands stays there, whatever other limit it has."""

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        """Hold a vehicle: it stops with its front at a position ahead, if it can still brake for it.

        Return False, without doing anything, if the vehicle is already on that edge but on another lane.
        Raise `TrafficError` if it cannot be held there, or its subclass `ClosedLaneError` if the lane is
        closed to it.
        """

    def close_lanes(self, lanes: Sequence[str], *, closed: bool) -> None:
        """Close lanes to all vehicles, or open them again as they were."""

    def lost_hold(self, vehicle: str) -> bool:
        """Return whether a vehicle was held by `hold`, and its owner has removed or changed that stop."""

    def release(self, vehicle: str) -> None:
        """Undo `hold` and `brake`, whether the vehicle stands or not."""

    def brake(self, vehicle: str, *, hard: bool = True) -> None:
        """Stop a vehicle where it is: as hard as possible (`hard`), or gently."""

    def stay_braked(self) -> None:
        """Brake again the vehicles whose `brake` their owner has undone: hard if they are no slower."""

    def forget_stops(self, vehicle: str, edge: str, route: str, alone: str) -> bool:
        """Remove the finished stops of a vehicle on edges other than `edge`.

        The vehicle then follows `route`, which begins with `edge`; `alone` is a route of `edge` only. Return
        False, without doing anything, if the vehicle is not on `edge`.
        """

    def halted(self) -> Sequence[str]:
        """Return the held vehicles that came to rest in the last step."""

    def next_stop(self, vehicle: str) -> tuple[str, float, bool] | None:
        """Return edge, position [m] and order of the current or next stop of a vehicle's own, or None.

        The order is True if the stop comes after the stop that holds the vehicle.
        """

    def set_stop(self, vehicle: str, stop: Stop) -> None:
        """Set a stop at the next pass of its position; raise `TrafficError` if the vehicle cannot make it."""

    def drop_stop(self, vehicle: str, stop: Stop) -> None:
        """Remove a stop that `set_stop` has set."""

    def stops_ahead(self, vehicle: str) -> int:
        """Return the number of current and coming stops of a vehicle, without the stop that holds it."""

    def at_own_stop(self, vehicle: str) -> bool:
        """Return whether a vehicle stands at a stop of its own, not at a hold."""

    def awaits_lot(self, vehicle: str) -> bool:
        """Return whether a vehicle is on the lane of its next stop, a car park whose lots are all taken."""

    def stays_s(self, vehicle: str) -> float:
        """Return for how long a vehicle will stand at its current stop [s]; 0 without a current stop."""

    def stay(self, vehicle: str, for_s: float) -> None:
        """Set the remaining duration of the current stop of a vehicle [s]."""

    def awaits(self, vehicle: str) -> bool:
        """Return whether a vehicle at a stop waits for persons or containers."""

    def lot_ahead_m(self, vehicle: str, stop: Stop) -> float:
        """Return how far ahead of its front the lot of a vehicle in a car park is [m]; it returns beside it.

        A vehicle may have stopped before its lot, or beyond it.
        """

    def is_full(self, car_park: str) -> bool:
        """Return whether all lots of a parking area are taken."""

    def stops_begun(self) -> Sequence[str]:
        """Return the vehicles that came to rest in the last step at a stop of their own."""

    def stops_ended(self) -> Sequence[str]:
        """Return the vehicles that left a stop of any kind in the last step."""

    def collisions(self) -> Sequence[Collision]:
        """Return the collisions of the last step."""

    def teleports(self) -> Sequence[str]:
        """Return the vehicles that the simulator began to teleport in the last step."""

    def persons_at(self, bus_stop: str) -> int | None:
        """Return how many persons wait at a bus stop; None while there are no persons in the simulation."""

    def size(self, vehicle: str) -> tuple[float, float]:
        """Return the length and the minimum gap of a vehicle [m]."""

    def goes_on(self, vehicle: str) -> Sequence[tuple[Sequence[str], float, int]]:
        """Return for each lane of a vehicle's edge how it leads on along the route.

        First the lane and those to which it leads, then their length [m], then how many lanes the best lane
        is to the left; 0 for the best lanes.
        """

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:
        """Return to which side a vehicle must change lanes and cannot, and whether it lets another do so.

        The side is 1 to the left, -1 to the right, 0 if there is none.
        """

    def faces_red(self, vehicle: str) -> bool:
        """Return whether a vehicle is near the end of its lane, and a light there is red for it."""

    def impatient_s(self) -> float:
        """Return the time after which a waiting driver heeds no right of way any more [s]."""

    def dynamics(self, vehicle: str) -> Dynamics:
        """Return length, accelerations and speed factor of a vehicle."""

    def show_brakes(self, vehicle: str) -> None:
        """Tell other vehicles how hard a vehicle brakes, if it brakes harder than they assume."""

    def advise(self, vehicle: str, speed_factor: float) -> None:
        """Set a vehicle's speed factor: its desired speed divided by the speed limit."""

    def jump(self, vehicle: str) -> float | None:
        """Move a vehicle to an edge ahead on its route with space; return the skipped distance [m].

        Return None if there is no space on any edge ahead.
        """

    def heed_lights(self, vehicle: str, *, heeds: bool) -> None:
        """Set whether a gated vehicle obeys red and amber lights."""

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        """Set whether a gated vehicle yields to approaching vehicles by the simulator's right of way."""

    def light(self, light: str) -> Light:
        """Return the state of a traffic light."""

    def light_program(self, light: str) -> Program:
        """Return the present program of a traffic light; it has no phases if the light has none."""

    def expects_more(self) -> bool:
        """Return whether vehicles are on the road or will still depart."""

    def close(self) -> None:
        """End the simulation; a second call does nothing."""
