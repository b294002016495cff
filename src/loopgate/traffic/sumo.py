"""Traffic in SUMO, through libsumo or traci: both offer the same calls."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import inf
from typing import Any

import numpy as np

from loopgate.arrays import Floats
from loopgate.errors import TrafficError
from loopgate.traffic.base import Collision, Dynamics, Insertion, Whereabouts
from loopgate.traffic.sumo_lights import SumoLights
from loopgate.traffic.sumo_routes import SumoRoutes
from loopgate.traffic.sumo_stops import SumoStops
from loopgate.traffic.sumo_waits import RoadWaits

GATED_SPEED_MODE = 23
"""SUMO's speed mode of gated vehicles: safe speed, accelerations and red lights hold. The gate replaces the
right of way, but vehicles that are inside a junction still count (bit 5 unset)."""

YIELDING_SPEED_MODE = 31
"""The same with SUMO's right of way, for runs with ordinary traffic."""

_CLOCK_DIGITS = 3
"""SUMO counts milliseconds."""

_ANY_LIGHT = ~16
"""Mask that removes lights from a speed mode, for a vehicle that drives on at any light."""

_LANE_CHANGE_FOR_ROUTE_ONLY = 0b01_00_00_00_01
"""Lane changes only where the route demands them, and never into an occupied gap."""

_LANE_CHANGE_AS_TOLD_ONLY = 0b11_00_00_00_00
"""Lane changes only by `SumoTraffic.change_lane`, and only if no vehicle must brake hard."""

_ANY_DECELERATION = ~4
"""Mask that removes the limit on deceleration from a speed mode (bit 2)."""


class SumoTraffic(SumoStops, SumoLights, SumoRoutes):
    """A SUMO simulation with the interface `Traffic`, which documents the calls.

    Parameters
    ----------
    api
        The libsumo module or a traci connection, started.
    error
        The exception types that `api` raises.
    yields
        Whether gated vehicles also obey SUMO's right of way, because there is ordinary traffic.
    shared
        Whether other code may set stops for gated vehicles.
    reads
        Faster replacements of calls of ``api``, by domain and name, such as ``vehicle_getSpeed``.
    close
        Function that ends the simulation; by default that of `api`.
    """

    def __init__(
        self,
        api: Any,  # noqa: ANN401  neither API has types
        error: type[Exception] | tuple[type[Exception], ...],
        *,
        yields: bool = False,
        shared: bool = True,
        reads: Mapping[str, Callable[..., Any]] | None = None,
        close: Callable[[], None] | None = None,
    ) -> None:
        def read(name: str) -> Callable[..., Any]:
            domain, _, call = name.partition("_")
            found: Callable[..., Any] = (reads or {}).get(name) or getattr(getattr(api, domain), call)
            return found

        SumoStops.__init__(self, api, error, read, shared=shared)
        SumoLights.__init__(self, api, read)
        SumoRoutes.__init__(self, api, error, read)
        self._yields = yields
        self._speed_mode = YIELDING_SPEED_MODE if yields else GATED_SPEED_MODE
        self._heedless: set[str] = set()
        self._first: set[str] = set()
        """The vehicles that ignore the right of way."""
        self._running = True
        self._close: Callable[[], None] = close or api.close
        self._odometer, *self._place_and_speed = (
            read(f"vehicle_{name}") for name in ("getDistance", "getLanePosition", "getSpeed")
        )
        self._vehicles, self._arrived = read("vehicle_getIDList"), read("simulation_getArrivedIDList")
        self._like = [
            read(f"vehicle_{name}")
            for name in ("getLength", "getAccel", "getDecel", "getSpeedFactor", "getMinGap")
        ]
        self._seen, self._seen_s = Whereabouts(), -inf
        self._now = float(api.simulation.getTime())
        self._step_s = float(api.simulation.getDeltaT())
        self._waits = RoadWaits(api, self._holds)
        self._braked: dict[str, float] = {}
        """For each braked vehicle, its speed one step before [m/s]."""
        self._slowed: set[str] = set()
        self._modes: dict[str, tuple[int, int]] = {}
        """For each gated vehicle, its speed mode and lane-change mode from before."""

    @property
    def now_s(self) -> float:
        return self._now

    @property
    def step_s(self) -> float:
        return self._step_s

    @property
    def gives_way(self) -> bool:
        return self._yields

    def step(self) -> None:
        try:
            self._api.simulationStep()
        except self._error as error:
            msg = f"SUMO stopped at {self._now:.0f} s: {error}"
            raise TrafficError(msg) from error
        self._now, self._seen_s = round(self._now + self._step_s, _CLOCK_DIGITS), -inf
        self.renew_again(self._now)

    def look_at_clock(self) -> None:
        """Note that a step was made, possibly by other code."""
        self._now, self._seen_s = float(self._simulation.getTime()), -inf
        self.renew_again(self._now)

    def vehicles(self) -> Sequence[str]:
        ids: Sequence[str] = self._vehicles()
        return ids

    def departed(self) -> Sequence[str]:
        ids: Sequence[str] = self._simulation.getDepartedIDList()
        return ids

    def arrived(self) -> Sequence[str]:
        ids: Sequence[str] = self._arrived()
        return ids

    def put_in(self, vehicle: str, how: Insertion) -> None:
        own = how.attributes
        try:
            self._vehicle.add(
                vehicle,
                how.route,
                typeID=how.kind,
                departLane=str(how.lane_index),
                departPos=f"{how.position_m:.3f}",
                departSpeed="max" if how.rolling else "0",
                arrivalPos=own.get("arrivalPos", "max"),
                arrivalSpeed=own.get("arrivalSpeed", "current"),
                line=own.get("line", ""),
                personNumber=int(own.get("personNumber", "0")),
            )
            for name, value in how.parameters.items():
                self._vehicle.setParameter(vehicle, name, value)
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO does not take it: {error}"
            raise TrafficError(msg) from error

    def take_out(self, vehicle: str) -> None:
        self._seen_s = -inf
        self._holds.pop(vehicle, None)
        with suppress(*((self._error,) if isinstance(self._error, type) else self._error)):
            self._vehicle.remove(vehicle)

    def odometer(self, vehicle: str) -> float:
        return float(self._odometer(vehicle))

    def odometers(self, vehicles: Sequence[str]) -> Floats:
        try:
            return np.fromiter(map(self._odometer, vehicles), np.float64, len(vehicles))
        except self._error as error:
            msg = (
                f"{error} SUMO has taken it out: calibrators, rerouters and the like must leave vehicles on "
                f"loops alone; give them vTypes"
            )
            raise TrafficError(msg) from error

    def whereabouts(self) -> Whereabouts:
        """Return the positions of all vehicles; they are read again after a step or a removal."""
        if self._seen_s != self._now:
            self._seen_s, vehicles, before = self._now, self.vehicles(), self._seen.vehicles
            if vehicles == before:
                vehicles = before  # the same object is faster to compare
            self._seen = self.whereabouts_of(vehicles)
        return self._seen

    def whereabouts_of(self, vehicles: Sequence[str]) -> Whereabouts:
        figures = (
            np.fromiter(map(read, vehicles), np.float64, len(vehicles)) for read in self._place_and_speed
        )
        return Whereabouts(vehicles, [*map(self._lane_of, vehicles)], *figures)

    def lane(self, vehicle: str) -> tuple[str, float]:
        return self._lane_of(vehicle), float(self._place_and_speed[0](vehicle))

    def speed(self, vehicle: str) -> float:
        return float(self._place_and_speed[1](vehicle))

    def parks(self, vehicle: str) -> bool:
        return bool(self._vehicle.isStoppedParking(vehicle))

    def position(self, vehicle: str) -> tuple[float, float]:
        x, y = self._vehicle.getPosition(vehicle)
        return float(x), float(y)

    def show(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        """Show the part of the map between two corners [m] in the window."""
        self._api.gui.setBoundary(self._api.gui.getIDList()[0], *low, *high)

    def paint(self, vehicle: str, colour: tuple[int, int, int]) -> None:
        """Give a vehicle a colour: red, green, blue from 0 to 255."""
        self._vehicle.setColor(vehicle, (*colour, 255))

    def put_under_gate(self, vehicle: str, *, keeps_lane: bool = False) -> None:
        """Set the modes of a gated vehicle for speed and lane changes."""
        get = self._vehicle
        self._modes.setdefault(vehicle, (get.getSpeedMode(vehicle), get.getLaneChangeMode(vehicle)))
        get.setSpeedMode(vehicle, self._speed_mode)
        mode = _LANE_CHANGE_AS_TOLD_ONLY if keeps_lane else _LANE_CHANGE_FOR_ROUTE_ONLY
        get.setLaneChangeMode(vehicle, mode)

    def leave_gate(self, vehicle: str) -> None:
        """Undo every hold, and restore the vehicle's modes."""
        modes = self._modes.pop(vehicle, None)
        self._heedless.discard(vehicle)
        self._first.discard(vehicle)
        if vehicle in self.arrived() or vehicle not in self._vehicle.getIDList():
            self._holds.pop(vehicle, None)
            self._braked.pop(vehicle, None)
            self._slowed.discard(vehicle)
            return
        self.release(vehicle)
        if vehicle in self._slowed:
            self.keep_to(vehicle, None)
        if modes is not None:
            self._vehicle.setSpeedMode(vehicle, modes[0])
            self._vehicle.setLaneChangeMode(vehicle, modes[1])

    def mean_speed(self, edge: str) -> float:
        return float(self._api.edge.getLastStepMeanSpeed(edge))

    def lane_index(self, vehicle: str) -> int:
        return int(self._vehicle.getLaneIndex(vehicle))

    def change_lane(self, vehicle: str, lane_index: int) -> None:
        """Ask for the lane until the end of the next step."""
        self._vehicle.changeLane(vehicle, lane_index, self._step_s)

    def put_on_lane(self, vehicle: str, lane_index: int) -> bool:
        """Move the vehicle sideways, if all vehicles on that lane keep their gaps."""
        get = self._vehicle
        lane = f"{get.getRoadID(vehicle)}_{lane_index}"
        front_m = float(get.getLanePosition(vehicle))
        rear_m = front_m - get.getLength(vehicle) - get.getMinGap(vehicle)
        for other in self._api.lane.getLastStepVehicleIDs(lane):
            ahead_m = float(get.getLanePosition(other))
            if ahead_m > rear_m and ahead_m - get.getLength(other) - get.getMinGap(vehicle) < front_m:
                return False
        try:
            get.moveTo(vehicle, lane, front_m)
        except self._error:
            return False
        self._seen_s = -inf
        return True

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        (self._slowed.discard if speed_mps is None else self._slowed.add)(vehicle)
        self._vehicle.setSpeed(vehicle, -1.0 if speed_mps is None else speed_mps)

    def release(self, vehicle: str) -> None:
        """Drop the stop by which the vehicle is held, reached or not, and no other stop."""
        if vehicle in self._braked:
            del self._braked[vehicle]
            self._vehicle.setSpeed(vehicle, -1.0)
            self._vehicle.setSpeedMode(vehicle, self._mode(vehicle))
        self.drop_hold(vehicle)

    def heed_lights(self, vehicle: str, *, heeds: bool) -> None:
        (self._heedless.discard if heeds else self._heedless.add)(vehicle)
        self._set_mode(vehicle)

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        """Set whether a gated vehicle keeps SUMO's right of way, or yields only to vehicles inside."""
        (self._first.discard if gives else self._first.add)(vehicle)
        self._set_mode(vehicle)

    def _set_mode(self, vehicle: str) -> None:
        if vehicle not in self._braked:
            try:
                self._vehicle.setSpeedMode(vehicle, self._mode(vehicle))
            except self._error:  # it has just arrived
                self._heedless.discard(vehicle)
                self._first.discard(vehicle)

    def _mode(self, vehicle: str) -> int:
        mode = GATED_SPEED_MODE if vehicle in self._first else self._speed_mode
        return mode & _ANY_LIGHT if vehicle in self._heedless else mode

    def brake(self, vehicle: str, *, hard: bool = True) -> None:
        self._braked[vehicle] = float(self._vehicle.getSpeed(vehicle))
        if hard:
            self._vehicle.setSpeedMode(vehicle, self._speed_mode & _ANY_DECELERATION)
        self._vehicle.setSpeed(vehicle, 0.0)

    def stay_braked(self) -> None:
        for vehicle, before_mps in list(self._braked.items()):
            self.brake(vehicle, hard=self._vehicle.getSpeed(vehicle) >= before_mps > 0.0)

    def collisions(self) -> Sequence[Collision]:
        if not self._simulation.getCollidingVehiclesNumber():
            return ()
        return tuple(Collision(c.collider, c.victim, c.lane) for c in self._simulation.getCollisions())

    def teleports(self) -> Sequence[str]:
        if not self._simulation.getStartingTeleportNumber():
            return ()
        return tuple(self._simulation.getStartingTeleportIDList())

    def pauses(self, vehicle: str) -> bool:
        return self.at_own_stop(vehicle) or self._waits.faces_red(vehicle)

    def waits_for(self, vehicle: str, *, guess: bool) -> Sequence[str]:
        """Return the vehicles of which each blocks a standing vehicle; see `RoadWaits`.

        No vehicle blocks a vehicle at a stop of its own, which goes on by itself.
        """
        if self.at_own_stop(vehicle):
            return ()
        return self._waits.of(vehicle, guess=guess)

    def dynamics(self, vehicle: str) -> Dynamics:
        return Dynamics(*(float(read(vehicle)) for read in self._like))

    def show_brakes(self, vehicle: str) -> None:
        """Set SUMO's `apparentDecel`, which `setDecel` leaves as it was."""
        decel = self._vehicle.getDecel(vehicle)
        if decel > self._vehicle.getApparentDecel(vehicle):
            self._vehicle.setApparentDecel(vehicle, decel)

    def advise(self, vehicle: str, speed_factor: float) -> None:
        self._vehicle.setSpeedFactor(vehicle, speed_factor)

    def jump(self, vehicle: str) -> float | None:
        """Put the vehicle on the first edge ahead on its route where SUMO finds room for it."""
        get = self._vehicle
        route = get.getRoute(vehicle)
        length = get.getLength(vehicle)
        for edge in route[get.getRouteIndex(vehicle) + 1 :]:
            for index in range(self._api.edge.getLaneNumber(edge)):
                if self._api.lane.getLength(f"{edge}_{index}") <= length:
                    continue
                skipped = float(get.getDrivingDistance(vehicle, edge, length, index))
                try:
                    get.moveTo(vehicle, f"{edge}_{index}", length)
                except self._error:
                    continue
                self._seen_s = -inf
                return skipped
        return None

    def expects_more(self) -> bool:
        return bool(self._simulation.getMinExpectedNumber() > 0)

    def configured_end_s(self) -> float | None:
        """Return the configuration's end time, which SUMO itself ignores when it is controlled [s]."""
        end = float(self._simulation.getEndTime())
        return end if end >= 0 else None

    def close(self) -> None:
        if self._running:
            self._running = False
            self._close()
