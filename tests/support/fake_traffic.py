"""Traffic without SUMO: point masses on loops of their own edges, with SUMO's step and braking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from loopgate.network.stops import Stop
from loopgate.traffic.base import Collision, Dynamics, Insertion, Light, Program, Whereabouts


def whereabouts(**at: tuple[str, float, float]) -> Whereabouts:
    """Return where vehicles are, each on a lane, with a position on it [m] and a speed [m/s]."""
    lanes, *figures = zip(*at.values(), strict=True) if at else ((), (), ())
    return Whereabouts(tuple(at), lanes, *map(np.array, figures))


@dataclass
class FakeVehicle:
    """A vehicle: its edges with their lengths [m], where it starts, how fast it may go."""

    edges: Sequence[tuple[str, float]]
    start_m: float
    top_mps: float = 10.0
    front_m: float = field(init=False)
    speed_mps: float = 0.0
    hold_m: float | None = None
    resting: bool = False
    lane: int = 0
    still: bool = False
    braked: bool = False

    def __post_init__(self) -> None:
        self.front_m = self.start_m

    @property
    def lap_m(self) -> float:
        """Length of its loop [m]."""
        return sum(length for _, length in self.edges)

    def arc(self, edge: str, position_m: float) -> float:
        """Return the first arc length at or after the front at which the edge has that position."""
        begin = 0.0
        for name, length in self.edges:
            if name == edge:
                break
            begin += length
        arc = begin + position_m
        while arc < self.front_m - 1e-9:
            arc += self.lap_m
        return arc


class FakeTraffic:
    """Vehicles that see nobody: only a hold stops them. Records the calls that hold and release."""

    LENGTH_M, ACCEL, DECEL = 5.0, 2.6, 4.5

    def __init__(self, vehicles: Mapping[str, FakeVehicle], *, step_s: float = 1.0) -> None:
        self.fleet = dict(vehicles)
        self.now_s = 0.0
        self.step_s = step_s
        self.gives_way = False
        self.in_this_process = False
        self.holds: list[tuple[float, str]] = []
        self.releases: list[tuple[float, str]] = []
        self.brakes: list[tuple[float, str]] = []
        self.advice: dict[str, float] = {}
        self.misses_by_m = 0.0
        self.gated: set[str] = set()
        self.gaps = True
        self.led: dict[str, tuple[str, ...]] = {}
        self.renewed: list[tuple[str, str]] = []
        self.waiting: dict[str, tuple[str, ...]] = {}
        self.crashes: tuple[Collision, ...] = ()
        self.lights: dict[str, Light] = {}
        self.heedless: set[str] = set()
        self.firsts: set[str] = set()
        self.standing: set[str] = set()
        self.programs: dict[str, Program] = {}
        self._halted: list[str] = []

    def step(self) -> None:
        """Advance all vehicles."""
        self.now_s += self.step_s
        self._halted = []
        if self.now_s == self.step_s:
            return  # the first step inserts them
        for name, vehicle in self.fleet.items():
            self._advance(name, vehicle)

    def _advance(self, name: str, vehicle: FakeVehicle) -> None:
        speed = 0.0 if vehicle.still else min(vehicle.top_mps, vehicle.speed_mps + self.ACCEL * self.step_s)
        if vehicle.hold_m is not None:
            left = vehicle.hold_m - vehicle.front_m
            speed = min(speed, max(0.0, _safe_speed(left, self.DECEL, self.step_s)))
            if speed * self.step_s > left:
                speed = max(0.0, left / self.step_s)
        vehicle.speed_mps = speed
        vehicle.front_m += speed * self.step_s
        if vehicle.hold_m is not None and speed < 0.05 and not vehicle.resting:
            vehicle.resting = True
            self._halted.append(name)

    def outside(self) -> Sequence[str]:
        return ()

    def vehicles(self) -> Sequence[str]:
        """All of them, always."""
        return tuple(self.fleet)

    def odometer(self, vehicle: str) -> float:
        """Like SUMO's: from 0 at the start."""
        return self.fleet[vehicle].front_m - self.fleet[vehicle].start_m

    def odometers(self, vehicles: Sequence[str]) -> list[float]:
        """Return the odometers."""
        return [self.odometer(vehicle) for vehicle in vehicles]

    def lane(self, vehicle: str) -> tuple[str, float]:
        """Return the lane last changed to on its edge, and the position."""
        at = self.fleet[vehicle].front_m % self.fleet[vehicle].lap_m
        for name, length in self.fleet[vehicle].edges:
            if at < length:
                return f"{name}_{self.fleet[vehicle].lane}", at
            at -= length
        raise AssertionError(vehicle)

    def whereabouts_of(self, vehicles: Sequence[str]) -> Whereabouts:
        """Return where some vehicles are."""
        return whereabouts(**{name: (*self.lane(name), self.speed(name)) for name in vehicles})

    def whereabouts(self) -> Whereabouts:
        """Return where all are."""
        return whereabouts(**{name: (*self.lane(name), self.speed(name)) for name in self.fleet})

    def mean_speed(self, edge: str) -> float:  # noqa: ARG002  the protocol's
        """Nobody is there."""
        return -1.0

    def speed(self, vehicle: str) -> float:
        """Return its speed."""
        return self.fleet[vehicle].speed_mps

    def parks(self, vehicle: str) -> bool:  # noqa: ARG002  the protocol's
        """Nobody does."""
        return False

    def position(self, vehicle: str) -> tuple[float, float]:
        """Everything is on the x axis."""
        return self.fleet[vehicle].front_m % self.fleet[vehicle].lap_m, 0.0

    def put_under_gate(self, vehicle: str, *, keeps_lane: bool = False) -> None:
        """Take note."""
        del keeps_lane
        self.gated.add(vehicle)

    def leave_gate(self, vehicle: str) -> None:
        """Take note."""
        self.gated.discard(vehicle)
        if vehicle in self.fleet:
            self.release(vehicle)

    def route(self, vehicle: str) -> tuple[Sequence[str], int]:
        """Return its edges, from the one on which it is."""
        edges = [name for name, _ in self.fleet[vehicle].edges]
        return edges, edges.index(self.lane(vehicle)[0].removesuffix("_0"))

    def route_id(self, vehicle: str) -> str:
        """Return one for each vehicle: its edges stay."""
        return vehicle

    def lead(self, vehicle: str, edges: Sequence[str]) -> None:
        """Take note: it circulates all the same."""
        self.led[vehicle] = tuple(edges)

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        """Nothing to make."""
        del name, edges

    def renew(self, vehicle: str, route: str) -> None:
        """Take note."""
        self.renewed.append((vehicle, route))

    def next_stop(self, vehicle: str) -> None:
        """Return none: only who attaches asks."""
        del vehicle

    def lane_index(self, vehicle: str) -> int:
        """Return the lane last changed to."""
        return self.fleet[vehicle].lane

    def change_lane(self, vehicle: str, lane_index: int) -> None:
        """Change at once, unless a test forbids it or the vehicle stands at a stop."""
        if self.gaps and not self.fleet[vehicle].resting:
            self.fleet[vehicle].lane = lane_index

    def stand(self, vehicle: str, *, stands: bool) -> None:
        (self.standing.add if stands else self.standing.discard)(vehicle)

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        """Take note of who stands."""
        self.fleet[vehicle].still = speed_mps == 0.0

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        """Bind the hold to the next time the vehicle gets there, as SUMO does."""
        if lane_index != self.fleet[vehicle].lane:
            return False
        self.holds.append((self.now_s, vehicle))
        self.fleet[vehicle].hold_m = self.fleet[vehicle].arc(edge, position_m) + self.misses_by_m
        return True

    def close_lanes(self, lanes: Sequence[str], *, closed: bool) -> None:
        """No lane is ever closed."""

    def lost_hold(self, vehicle: str) -> bool:  # noqa: ARG002  the protocol's
        """Nobody takes a hold away."""
        return False

    def release(self, vehicle: str) -> None:
        """Let it go."""
        self.releases.append((self.now_s, vehicle))
        self.fleet[vehicle].hold_m = None
        if self.fleet[vehicle].braked:
            self.fleet[vehicle].braked = self.fleet[vehicle].still = False
        self.fleet[vehicle].resting = False

    def brake(self, vehicle: str, *, hard: bool = True) -> None:  # noqa: ARG002  the protocol's
        """Stand at once."""
        self.brakes.append((self.now_s, vehicle))
        self.fleet[vehicle].braked = self.fleet[vehicle].still = True

    def show_brakes(self, vehicle: str) -> None:
        """All drive alike."""

    def stay_braked(self) -> None:
        """Nobody else tells vehicles anything."""

    def put_on_lane(self, vehicle: str, lane_index: int) -> bool:
        """There is always room."""
        self.fleet[vehicle].lane = lane_index
        return True

    def forget_stops(self, vehicle: str, edge: str, route: str, alone: str) -> bool:
        """Nothing to forget."""
        del vehicle, edge, route, alone
        return True

    def halted(self) -> Sequence[str]:
        """Return who came to rest in the last step."""
        return tuple(self._halted)

    def set_stop(self, vehicle: str, stop: Stop) -> None:
        """Take it that nobody stops on the way."""

    def drop_stop(self, vehicle: str, stop: Stop) -> None:
        """Take it that nobody stops on the way."""

    def stops_ahead(self, vehicle: str) -> int:
        """Return none."""
        del vehicle
        return 0

    def departed(self) -> tuple[str, ...]:
        """Return nobody."""
        return ()

    def arrived(self) -> tuple[str, ...]:
        """Return nobody."""
        return ()

    def put_in(self, vehicle: str, how: Insertion) -> None:
        """Take it that nobody departs later."""

    def take_out(self, vehicle: str) -> None:
        """Do nothing."""

    def at_own_stop(self, vehicle: str) -> bool:  # noqa: ARG002  the protocol's
        """No vehicle stops."""
        return False

    def awaits_lot(self, vehicle: str) -> bool:  # noqa: ARG002  as above
        """Return False."""
        return False

    def stays_s(self, vehicle: str) -> float:  # noqa: ARG002  the protocol's
        """No vehicle stops."""
        return 0.0

    def stay(self, vehicle: str, for_s: float) -> None:
        """No vehicle stops."""

    def awaits(self, vehicle: str) -> bool:  # noqa: ARG002  the protocol's
        """No vehicle stops."""
        return False

    def lot_ahead_m(self, vehicle: str, stop: Stop) -> float:  # noqa: ARG002  the protocol's
        """No vehicle parks."""
        return 0.0

    def is_full(self, car_park: str) -> bool:  # noqa: ARG002  the protocol's
        """There is no car park."""
        return False

    def stops_begun(self) -> tuple[str, ...]:
        """Return nobody."""
        return ()

    def stops_ended(self) -> tuple[str, ...]:
        """Return nobody."""
        return ()

    def collisions(self) -> Sequence[Collision]:
        """Return what a test has put there."""
        return self.crashes

    def teleports(self) -> Sequence[str]:
        """Nobody."""
        return ()

    def size(self, vehicle: str) -> tuple[float, float]:  # noqa: ARG002  the protocol's
        """Return the same for everybody."""
        return self.LENGTH_M, 2.5

    def goes_on(self, vehicle: str) -> Sequence[tuple[Sequence[str], float, int]]:  # noqa: ARG002
        """There is one lane."""
        return []

    def persons_at(self, bus_stop: str) -> int | None:  # noqa: ARG002  the protocol's
        """Nobody walks here."""
        return None

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:  # noqa: ARG002  the protocol's
        """There is one lane."""
        return 0, False

    def faces_red(self, vehicle: str) -> bool:  # noqa: ARG002  the protocol's
        """There is no light."""
        return False

    def impatient_s(self) -> float:
        """Return SUMO's default."""
        return 180.0

    def dynamics(self, vehicle: str) -> Dynamics:
        """All alike."""
        del vehicle
        return Dynamics(self.LENGTH_M, self.ACCEL, self.DECEL, 1.0)

    def advise(self, vehicle: str, speed_factor: float) -> None:
        """Take note of it."""
        self.advice[vehicle] = speed_factor

    def jump(self, vehicle: str) -> float | None:
        """Never."""
        del vehicle
        return None

    def heed_lights(self, vehicle: str, *, heeds: bool) -> None:
        """Take note of who drives on whatever lights show."""
        (self.heedless.discard if heeds else self.heedless.add)(vehicle)

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        """Take note of who gives way to nobody who only comes."""
        (self.firsts.discard if gives else self.firsts.add)(vehicle)

    def light(self, light: str) -> Light:
        """Return what a test has put there."""
        return self.lights[light]

    def light_program(self, light: str) -> Program:
        """Return what a test has put there."""
        return self.programs[light]

    def expects_more(self) -> bool:
        """They circulate for ever."""
        return True

    def configured_end_s(self) -> float | None:
        """None is configured."""
        return None

    def close(self) -> None:
        """Nothing to free."""


def _safe_speed(left_m: float, decel: float, step_s: float) -> float:
    """Return the highest speed from which braking by `decel` per step stops within `left_m`."""
    steps = 0
    while decel * step_s * step_s * (steps + 1) * (steps + 2) / 2 <= left_m:
        steps += 1
    whole = decel * step_s * step_s * steps * (steps + 1) / 2
    return decel * step_s * steps + (left_m - whole) / (step_s * (steps + 1))
