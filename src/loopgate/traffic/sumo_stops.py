"""Stops in SUMO: the stops that hold vehicles, and the stops of their routes."""

from collections.abc import Callable, Iterable, Sequence
from math import dist
from typing import Any

from shapely import LineString, Point

from loopgate.errors import ClosedLaneError, TrafficError
from loopgate.network.stops import Stop

_FOR_EVER_S = 1e7

_SAME_STOP_M = 0.05
"""Largest distance between a stop in SUMO and the position that was asked for [m]."""

_FLAGS = {"lane": 0, "busStop": 8, "containerStop": 16, "chargingStation": 32, "parkingArea": 64}
_PARKS, _TRIGGERS = 1, {"person": 2, "container": 4}
"""SUMO's flags of stops."""

_NONE_S = -(2.0**30)
"""SUMO's number for a missing time."""

_LEFT, _RIGHT = 1, -1  # SUMO's numbers for directions


class SumoStops:
    """The calls of `Traffic` about stops.

    `api`, `error`, `shared`: as in `loopgate.traffic.sumo.SumoTraffic`. `read`: returns the function for a
    call by its name.
    """

    def __init__(
        self,
        api: Any,  # noqa: ANN401  neither API has types
        error: type[Exception] | tuple[type[Exception], ...],
        read: Callable[[str], Callable[..., Any]],
        *,
        shared: bool,
    ) -> None:
        self._api = api
        self._error = error
        self._shared = shared
        self._vehicle = api.vehicle
        self._simulation = api.simulation
        self._lane_of, self._stops_of = read("vehicle_getLaneID"), read("vehicle_getStops")
        self._insert_stop, self._set_stop = read("vehicle_insertStop"), read("vehicle_setStop")
        self._replace_stop = read("vehicle_replaceStop")
        self._stops_starting = read("simulation_getStopStartingVehiclesIDList")
        self._holds: dict[str, tuple[str, float]] = {}
        """For each held vehicle, its lane and the position of the hold there [m]."""
        self._stopping: set[str] = set()
        """The vehicles with stops of their own."""
        self._lets_change: dict[tuple[str, str], bool] = {}
        self._classes: dict[str, str] = {}
        """The vehicle classes that other code cannot change."""

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        """Set a stop on this pass that only `release` ends.

        Raises `TrafficError` if SUMO refuses it, because the vehicle is too near to brake or the lane is not
        on its route; `ClosedLaneError` if the lane is closed to it.
        """
        lane = f"{edge}_{lane_index}"
        here = self._lane_of(vehicle)
        on_edge = here == lane
        if not on_edge and here.rpartition("_")[0] == edge:
            return False
        stop = position_m, lane_index, _FOR_EVER_S
        alone = vehicle not in self._holds if self._is_ours(vehicle) else not self._stops_of(vehicle, 1)
        try:
            if on_edge and alone and self._may_insert(edge, self._class_of(vehicle)):
                self._insert_stop(vehicle, 0, edge, *stop)
            else:
                self._set_stop(vehicle, edge, *stop)
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO cannot hold it on {lane} at {position_m:.1f} m: {error}"
            closed = self._vehicle.getVehicleClass(vehicle) in self._api.lane.getDisallowed(lane)
            raise (ClosedLaneError if closed else TrafficError)(msg) from error
        self._holds[vehicle] = lane, position_m
        taken = self._stops_of(vehicle, 1) if alone else self._stop_number(vehicle) is not None
        if not taken:
            del self._holds[vehicle]
            msg = f"vehicle {vehicle}: SUMO has not taken the stop on {lane} at {position_m:.1f} m"
            raise TrafficError(msg)
        return True

    def _is_ours(self, vehicle: str) -> bool:
        """Return whether the vehicle has no stops of its own."""
        return not (self._shared or vehicle in self._stopping)

    def _class_of(self, vehicle: str) -> str:
        vclass = self._classes.get(vehicle)
        if vclass is None:
            vclass = str(self._vehicle.getVehicleClass(vehicle))
            if not self._shared:
                self._classes[vehicle] = vclass
        return vclass

    def _may_insert(self, edge: str, vclass: str) -> bool:
        """Return whether `insertStop` sets a stop on this pass of a vehicle without other stops.

        `setStop` always does so, but SUMO 1.28 never frees 0.9 kB for each call. `insertStop` starts its
        search where a vehicle can still choose another way: at the next edge if the vehicle is inside a
        junction, or on an edge on which some vehicles must not change lanes. On a route of two rounds the
        stop would then lie a lap later. Before other stops it would be in the wrong order.
        """
        key = edge, vclass
        free = self._lets_change.get(key)
        if free is None:
            free = self._lets_change[key] = self._may_change_anywhere(edge, vclass)
        return free

    def _may_change_anywhere(self, edge: str, vclass: str) -> bool:
        may = self._api.lane.getChangePermissions
        lanes = [f"{edge}_{index}" for index in range(self._api.edge.getLaneNumber(edge))]
        return all(vclass in may(lane, way) for lane in lanes for way in (_LEFT, _RIGHT))

    def _stop_number(self, vehicle: str) -> int | None:
        """Return the index of the stop that holds the vehicle, or None."""
        stops = self._stops_of(vehicle, 0)
        if self._is_ours(vehicle):
            return 0 if stops else None
        return next((number for number, stop in enumerate(stops) if self._is_hold(vehicle, stop)), None)

    def _is_hold(self, vehicle: str, stop: Any) -> bool:  # noqa: ANN401  neither API has types
        """Return whether a stop is the stop that holds the vehicle."""
        lane, position_m = self._holds.get(vehicle, ("", 0.0))
        lasts, off_m = stop.duration >= _FOR_EVER_S / 2, abs(stop.endPos - position_m)
        return bool(stop.lane == lane and lasts and off_m < _SAME_STOP_M)

    def find_holds(self, vehicles: Iterable[str]) -> None:
        """Find the stops that hold vehicles anew, after another state has been loaded."""
        there = set(self._vehicle.getIDList())
        for vehicle in vehicles:
            self._holds.pop(vehicle, None)
            stops = self._stops_of(vehicle, 0) if vehicle in there else ()
            for stop in (stop for stop in stops if stop.duration >= _FOR_EVER_S / 2):
                self._holds[vehicle] = stop.lane, stop.endPos

    def drop_hold(self, vehicle: str) -> None:
        """Remove the stop that holds a vehicle, whether reached or not, and no other stop."""
        if vehicle not in self._holds:
            return
        number = 0 if self._is_ours(vehicle) else self._stop_number(vehicle)
        del self._holds[vehicle]
        if number is None:
            return
        try:
            self._replace_stop(vehicle, number, "")
        except self._error:
            if self._stops_of(vehicle, 1):
                raise  # otherwise no stop is left: it was on a route that the vehicle has left

    def forget_stops(self, vehicle: str, edge: str, route: str, alone: str) -> bool:
        """Lead a vehicle off the edges of its stops and back: SUMO keeps only stops on the present route."""
        if self._vehicle.getRoadID(vehicle) != edge or self._stops_of(vehicle, 1):
            return False  # SUMO would also forget a stop ahead that loopgate has not set
        self._vehicle.setRouteID(vehicle, alone)
        self._vehicle.setRouteID(vehicle, route)
        return True

    def halted(self) -> Sequence[str]:
        """Return the held vehicles that came to rest in the last step at the stop that holds them."""
        if not self._holds:
            return ()
        ids = self._stops_starting()
        held = [vehicle for vehicle in ids if vehicle in self._holds]
        return [vehicle for vehicle in held if self._is_ours(vehicle) or self._stop_number(vehicle) == 0]

    def next_stop(self, vehicle: str) -> tuple[str, float, bool] | None:
        for number, stop in enumerate(self._stops_of(vehicle, 2)):
            if not self._is_hold(vehicle, stop):
                return stop.lane.rpartition("_")[0], stop.endPos, number > 0
        return None

    def set_stop(self, vehicle: str, stop: Stop) -> None:
        flags = (
            _FLAGS[stop.kind] | (_PARKS if stop.parks else 0) | sum(_TRIGGERS[one] for one in stop.triggers)
        )
        times = {"duration": stop.duration_s, "until": _NONE_S if stop.until_s is None else stop.until_s}
        where: dict[str, float] = {}
        if stop.kind == "lane":
            index = int(stop.lane.rpartition("_")[2])
            where = {"pos": stop.end_m, "laneIndex": index, "startPos": stop.start_m}
        get = self._vehicle
        self._stopping.add(vehicle)
        try:
            get.setStop(vehicle, stop.edge if where else stop.name, flags=flags, **where, **times)
            for name, value in stop.told:
                get.setStopParameter(vehicle, self._number_of(vehicle, stop), name, value)
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO does not take the stop at {stop.name}: {error}"
            raise TrafficError(msg) from error

    def _number_of(self, vehicle: str, stop: Stop) -> int:
        """Return the index of the vehicle's last stop at a place."""
        stops = self._stops_of(vehicle, 0)
        for number in range(len(stops) - 1, -1, -1):
            there = stops[number].lane == stop.lane and (
                abs(stops[number].endPos - stop.end_m) < _SAME_STOP_M
                if stop.kind == "lane"
                else stops[number].stoppingPlaceID == stop.name
            )
            if there:
                return number
        msg = f"vehicle {vehicle}: SUMO knows of no stop at {stop.name}"
        raise TrafficError(msg)

    def drop_stop(self, vehicle: str, stop: Stop) -> None:
        self._vehicle.replaceStop(vehicle, self._number_of(vehicle, stop), "")

    def stops_ahead(self, vehicle: str) -> int:
        held = vehicle in self._holds and self._stop_number(vehicle) is not None
        return len(self._stops_of(vehicle, 0)) - held

    def stays_s(self, vehicle: str) -> float:
        """Return for how long a vehicle will stand at its stop [s]; SUMO counts down."""
        stops = self._stops_of(vehicle, 1)
        return float(stops[0].duration) if stops and self._vehicle.isStopped(vehicle) else 0.0

    def stay(self, vehicle: str, for_s: float) -> None:
        self._vehicle.setStopParameter(vehicle, 0, "duration", f"{for_s:g}")

    def awaits(self, vehicle: str) -> bool:
        return bool(self._vehicle.isStoppedTriggered(vehicle))

    def lot_ahead_m(self, vehicle: str, stop: Stop) -> float:
        """Return the distance to the vehicle's lot; SUMO puts it back on its lane beside that lot."""
        lot, at_m = self._vehicle.getPosition(vehicle), float(self._vehicle.getLanePosition(vehicle))
        if any(dist(lot, space) < _SAME_STOP_M for space in stop.spaces):
            return stop.end_m - at_m
        lane = LineString(self._api.lane.getShape(stop.lane))
        return float(lane.project(Point(lot)) * self._api.lane.getLength(stop.lane) / lane.length) - at_m

    def is_full(self, car_park: str) -> bool:
        taken, lots = (
            int(self._simulation.getParameter(car_park, f"parkingArea.{what}"))
            for what in ("occupancy", "capacity")
        )
        return taken >= lots

    def stops_begun(self) -> Sequence[str]:
        return [v for v in self._stops_starting() if self.at_own_stop(v)]

    def at_own_stop(self, vehicle: str) -> bool:
        """Return whether a vehicle stands at a stop that does not hold it."""
        held = vehicle in self._holds and self._stop_number(vehicle) == 0
        return not held and bool(self._vehicle.isStopped(vehicle))  # a held one was released

    def stops_ended(self) -> Sequence[str]:
        ids: Sequence[str] = self._simulation.getStopEndingVehiclesIDList()
        return ids
