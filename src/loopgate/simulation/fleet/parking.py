"""Vehicles that park beside the road: they give up their slots, and return when the gate grants a slot."""

from collections.abc import Callable, Mapping, Sequence

from loopgate.drive.changing import ChangingEngine
from loopgate.drive.driver import Driver
from loopgate.drive.sense import STANDING_MPS, braking_m
from loopgate.network.stops import Stop
from loopgate.traffic.base import Traffic

_SOON_STEPS = 3
"""SUMO puts a vehicle back on the road a step before its stop ends: before that it can be told to stay."""

_GO_STEPS = 2
"""With so many left it is on the road in the next step, if there is a gap."""

_LONGER_STEPS = 5
"""For so many steps more it is told to stay."""

_GAP_M, _REACTION_S = 2.5, 1.0
"""Gap that drivers keep when they stand [m], and time in which they react [s]: SUMO's defaults."""

_ROUNDING_M = 0.5

_PATIENCE_S = 20.0
"""A vehicle that has waited so long for its way back keeps others out of its place for as long, now and
then [s]."""


class Parking:
    """Vehicles that park give up their slots, and stay parked until they have a slot again.

    One is let back when its stop is over, its place has a slot that the gate lets it have, and room among
    ordinary vehicles; it then stands in the line of its place, as far from the end as it is. When it drives
    off is for SUMO to say, which lets it into a gap. What it holds is what it held: on other gates than the
    certified one under the chain rule vehicles keep their slots.

    Parameters
    ----------
    has_room
        Whether there is room for a vehicle in its place, ordinary vehicles considered.
    """

    def __init__(
        self, traffic: Traffic, engine: ChangingEngine, has_room: Callable[[Driver], bool] = lambda _: True
    ) -> None:
        self._traffic, self._engine, self._has_room = traffic, engine, has_room
        self._coming: set[str] = set()
        """The vehicles that have a slot again and are not on the road yet."""
        self._braked: dict[str, int] = {}
        """Vehicles that stand still until they are on the road and held, or granted a leg after this one."""
        self._since_s: dict[str, float] = {}
        """Since when those wait whose stops are over [s]."""
        self._late_s = 0.0
        self._latest_s = 0.0

    @property
    def gives_up(self) -> bool:
        """Whether a vehicle that parks gives up its slot."""
        return self._engine.sets_aside

    def notes(self, stops: Mapping[str, Sequence[Stop]]) -> tuple[str, ...]:
        """Return the warning about vehicles that keep their slots while they park."""
        names = [stop.name for some in stops.values() for stop in some if stop.parks]
        if self.gives_up or not names:
            return ()
        return (f"stops: while a vehicle parks, as at {names[0]}, no other vehicle enters its place",)

    def begin(self, driver: Driver) -> bool:
        """Take the slot of a vehicle that has just parked; return whether it gave it up."""
        return self._engine.step_aside(driver.id)

    def figures(self) -> dict[str, float]:
        """Return for how long vehicles stood parked beyond their stops, in all and at most [s]."""
        return {"late_back_s": round(self._late_s, 3), "longest_late_back_s": round(self._latest_s, 3)}

    def look(self) -> None:
        """Let parked vehicles return to the road if possible; keep the others parked."""
        engine = self._engine
        if self._braked:
            self._let_go()
        if not engine.beside:
            return
        now, step_s = self._traffic.now_s, self._traffic.step_s
        for driver in [driver for driver in engine.drivers if driver.id in engine.beside]:
            vehicle = driver.id
            if vehicle in self._coming and self._traffic.lane(vehicle)[0]:
                engine.is_back(driver)
                self._coming.discard(vehicle)
                self._since_s.pop(vehicle, None)
                continue
            left_s = self._traffic.stays_s(vehicle)
            if left_s > _SOON_STEPS * step_s:
                continue
            if vehicle not in self._coming and self._traffic.awaits(vehicle):
                self._traffic.stay(vehicle, _LONGER_STEPS * step_s)
                continue
            goes = self._may_go(driver)
            if goes and vehicle not in self._braked and self._starts_over_its_line(driver):
                self._braked[vehicle] = driver.granted
                self._traffic.keep_to(vehicle, 0.0)
            if goes and left_s > _GO_STEPS * step_s:
                continue  # not before its time
            self._traffic.stay(vehicle, (_GO_STEPS if goes else _LONGER_STEPS) * step_s)
            since_s = self._since_s.setdefault(vehicle, now)
            self._late_s += step_s if now > since_s else 0.0
            self._latest_s = max(self._latest_s, now - since_s)
            if (now - since_s) % (2 * _PATIENCE_S) >= _PATIENCE_S:
                engine.shut(driver.leg(driver.granted).state)

    def _may_go(self, driver: Driver) -> bool:
        """Return whether a vehicle may drive onto the road in the next step; see to its slot."""
        engine = self._engine
        room = self._has_room(driver)
        if driver.id in self._coming:
            engine.take_turn(driver)
        elif room and engine.has_slot_for(driver):
            engine.come_back(driver)
            self._coming.add(driver.id)
        return room and driver.id in self._coming and self._is_clear(driver)

    def _let_go(self) -> None:
        """Let vehicles drive that are on the road again, and held at their line or granted more."""
        for vehicle, leg in list(self._braked.items()):
            driver = self._engine.driver_of.get(vehicle)
            if driver is None or vehicle in self._engine.beside:
                continue
            if driver.row["held"] or driver.granted != leg:
                del self._braked[vehicle]
                self._traffic.keep_to(vehicle, None)

    def _starts_over_its_line(self, driver: Driver) -> bool:
        """Return whether a vehicle beside the road would pass the end of its place before it is held."""
        if not driver.track.rounds and driver.granted >= len(driver.track.legs) - 1:
            return False  # its way ends there
        step_s = self._traffic.step_s
        speed_mps = driver.accel_mps2 * step_s
        way_m = speed_mps * step_s + braking_m(speed_mps, float(driver.row["decel"]), step_s)
        return driver.left_m(driver.leg(driver.granted).state) < way_m + _ROUNDING_M

    def _is_clear(self, driver: Driver) -> bool:
        """Return whether vehicles from behind can brake for it: SUMO lets it in before others at speed.

        They drive on for a step, and then have a second to react. One that stands before its own stop, as at
        a car park that is full, does not start before this one has gone.
        """
        step_s = self._traffic.step_s
        place = driver.leg(driver.granted).state
        rear_m = driver.inside_m(place) - driver.length_m
        for other in self._engine.holding(place):
            gap_m = rear_m - other.inside_m(place)
            if other.id in self._engine.beside:
                continue
            if gap_m < -driver.length_m:  # ahead: they may have parked side by side
                if gap_m > -driver.length_m - other.length_m - _GAP_M:
                    return False
                continue
            fast = min(other.top_mps, other.speed_mps + other.accel_mps2 * step_s)
            decel = float(other.row["decel"])
            if gap_m >= 0.0 and other.speed_mps <= STANDING_MPS and other.stops_here:
                continue
            if gap_m < _GAP_M + fast * (step_s + _REACTION_S) + braking_m(fast, decel, step_s):
                return False
        return True
