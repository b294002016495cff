"""Routes of vehicles in SUMO."""

from collections.abc import Callable, Sequence
from math import inf
from typing import Any

from loopgate.errors import TrafficError

_RENEW_EVERY_S = 10.0
"""A route that SUMO has refused is tried again in this interval [s]."""


class SumoRoutes:
    """The calls of `Traffic` that are about routes; `read` finds a reading by its name."""

    def __init__(
        self,
        api: Any,  # noqa: ANN401  no types
        error: type[Exception] | tuple[type[Exception], ...],
        read: Callable[[str], Callable[..., Any]],
    ) -> None:
        self._vehicle, self._error, self._add_route = api.vehicle, error, api.route.add
        self._route_id = read("vehicle_getRouteID")
        self._unrenewed: dict[str, str] = {}
        """The routes that SUMO has refused, by vehicle."""
        self._renew_again_s = -inf

    def lead(self, vehicle: str, edges: Sequence[str]) -> None:
        try:
            self._vehicle.setRoute(vehicle, list(edges))
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO does not take the route {' '.join(edges)}: {error}"
            raise TrafficError(msg) from error

    def route(self, vehicle: str) -> tuple[Sequence[str], int]:
        return self._vehicle.getRoute(vehicle), int(self._vehicle.getRouteIndex(vehicle))

    def route_id(self, vehicle: str) -> str:
        return str(self._route_id(vehicle))

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        self._add_route(name, list(edges))

    def renew(self, vehicle: str, route: str) -> None:
        try:
            self._vehicle.setRouteID(vehicle, route)
        except self._error:  # a street on it is closed to the vehicle
            self._unrenewed[vehicle] = route

    @property
    def without_way(self) -> tuple[str, ...]:
        """The vehicles whose routes SUMO does not renew, because a street is closed."""
        return tuple(sorted(self._unrenewed))

    def renew_again(self, now_s: float) -> None:
        """Try again to renew the routes that SUMO has refused; call it after each step."""
        if not self._unrenewed or now_s < self._renew_again_s:
            return
        self._renew_again_s = now_s + _RENEW_EVERY_S
        there, again = set(self._vehicle.getIDList()), self._unrenewed
        self._unrenewed = {}
        for vehicle in sorted(there & again.keys()):
            self.renew(vehicle, again[vehicle])
