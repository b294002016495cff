"""Keeps vehicles to the lanes of their loops where the simulator has a choice, and lets them change lanes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Pin
from loopgate.errors import TrafficError
from loopgate.simulation.driver import Driver
from loopgate.simulation.fleet import Fleet
from loopgate.traffic.base import Traffic

__all__ = ["Steering"]

_STANDING_MPS = 0.1
_AT_PIN_M = 1.0


@dataclass(slots=True)
class _Way:
    """What is left of a vehicle's way between two states: its pins, and where the first state ended [m]."""

    driver: Driver
    pins: deque[Pin]
    from_m: float
    still: bool = False


class Steering:
    """Sets the stops, `Pin`, by which vehicles keep to their lanes, and drops them in time.

    While a vehicle is steered it does not ask for its next state: it can stop at each pin, and in the state
    it has been granted. A vehicle changes lanes in the stretch made for that, its rear out of the state
    before; if nobody lets it in, it stands at the pin until somebody does. The stretch is its own by the
    exclusion of crossings, and there is a slot for it beyond, so those that stand in its way there move up.

    Parameters
    ----------
    traffic
        The running simulation.
    fleet
        Where the vehicles are.
    """

    def __init__(self, traffic: Traffic, fleet: Fleet) -> None:
        self._traffic = traffic
        self._fleet = fleet
        self._ways: dict[int, _Way] = {}

    def begin(self, driver: Driver) -> None:
        """Set the first pin of the way to the state just granted, if it has any."""
        leg = driver.granted - 1
        pins = driver.track.pins[driver.position(leg)] if driver.track.pins else ()
        if pins:
            self._ways[driver.robot] = _Way(driver, deque(pins), driver.end_m(leg))
            self._set(driver, pins[0])

    @property
    def steers(self) -> bool:
        """Whether any vehicle is steered."""
        return bool(self._ways)

    def busy(self, driver: Driver) -> bool:
        """Return whether the vehicle is steered, and may not ask for its next state."""
        return driver.robot in self._ways

    def renew(self, driver: Driver) -> None:
        """Set a stop again that lies on the edge where SUMO has just renewed the route, see `Engine`."""
        way = self._ways.get(driver.robot)
        if way is not None and way.pins[0].edge == driver.track.rerouted_on and not way.still:
            self._traffic.release(driver.id)
            self._set(driver, way.pins[0])

    def step(self) -> list[Driver]:
        """Move the steered vehicles on; return those that need it no longer."""
        done: list[Driver] = []
        for robot, way in list(self._ways.items()):
            if self._reached(way):
                self._drop(way)
            if not way.pins:
                del self._ways[robot]
                done.append(way.driver)
        return done

    def _reached(self, way: _Way) -> bool:
        """Return whether the first pin has done its work; else let the vehicle change lanes if it may."""
        driver, pin = way.driver, way.pins[0]
        past_m = self._fleet.fronts[driver.robot] - way.from_m - pin.from_m
        if pin.to_lane is None:
            if past_m < 0:
                return False
            lane = self._traffic.lane_index(driver.id)
            if lane != pin.lane:
                msg = f"vehicle {driver.id}: SUMO took it to lane {lane} of {pin.edge}, not lane {pin.lane}"
                raise TrafficError(msg)
            return True
        if past_m < driver.length:
            return False
        if self._traffic.lane_index(driver.id) == pin.to_lane:
            return True
        if not way.still and self._fleet.speeds[driver.robot] < _STANDING_MPS and self._at(driver, pin):
            way.still = True
            self._traffic.stand(driver.id, still=True)
            self._traffic.release(driver.id)
        self._traffic.change_lane(driver.id, pin.to_lane)
        return False

    def _at(self, driver: Driver, pin: Pin) -> bool:
        # Only there is it clear of those that wait behind the stretch: further back they could block it.
        return self._traffic.lane(driver.id)[1] > pin.position_m - _AT_PIN_M

    def _drop(self, way: _Way) -> None:
        vehicle = way.driver.id
        way.pins.popleft()
        if way.still:
            way.still = False
            self._traffic.stand(vehicle, still=False)
        else:
            self._traffic.release(vehicle)
        if way.pins:
            self._set(way.driver, way.pins[0])

    def _set(self, driver: Driver, pin: Pin) -> None:
        self._traffic.hold(driver.id, pin.edge, pin.lane, pin.position_m)
