"""Even spacing of the vehicles on each loop: by holding them at gates, or by advice on their speeds.

Without it vehicles bunch behind slow ones, and streets wait long for a bunch. Each vehicle is delayed while
it is ahead of the middle between its neighbours on its loop; so spacing evens out without a timetable
(Bartholdi and Eisenstein, "A self-coordinating bus route to resist bus bunching", Transp. Res. B 46, 2012).
Who may move is decided as ever.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from loopgate.arrays import Floats
from loopgate.drive import spacing
from loopgate.drive.engine import Engine
from loopgate.drive.tables import Numbers
from loopgate.network import Loop, RoadNetwork, VehicleType
from loopgate.traffic.base import Traffic

_EVERY_S = 5.0
_SLOWEST, _FASTEST = 0.8, 1.1
"""Shares of the speed limit; drivers of SUMO's own choice differ as much."""

_LEAST_CHANGE = 0.005

_HOLD_S = 48.0
"""For how long one is held who is ahead by the even spacing [s]. Where one driver is slow the others stay as
far ahead as the delays of a lap take: to hold for longer keeps them nearer to even, but costs kilometres."""


def advised_type(kind: VehicleType) -> VehicleType:
    """Return a type for vehicles that follow speed advice, up to the fastest advice."""
    return replace(kind, attributes={**kind.attributes, "speedFactor": f"{_FASTEST}", "speedDev": "0"})


class Neighbours:
    """How far vehicles are ahead of the middle between their neighbours, each on its loop.

    Parameters
    ----------
    laps_s, loops
        Time of a lap [s] and number of the loop, of each vehicle.
    """

    def __init__(self, laps_s: Floats, loops: Numbers) -> None:
        self._laps_s = laps_s
        self._order = np.argsort(loops, kind="stable")
        grouped = loops[self._order]
        changes = np.flatnonzero(grouped[1:] != grouped[:-1]) + 1
        self._begins = np.r_[0, changes, len(loops)]

    def leads(self, times_s: Floats) -> Floats:
        """Return how far each vehicle is ahead.

        Parameters
        ----------
        times_s
            Where each is, as time from its loop's beginning at the speeds allowed [s].

        Returns
        -------
        ndarray
            In units of even spacing: 0 in the middle, 1 where the one ahead is two spacings nearer than the
            one behind. 0 for one vehicle alone. O(n) where they keep their order.
        """
        return spacing.leads(times_s % self._laps_s, self._laps_s, self._begins, self._order)


class Leads:
    """The vehicles ahead of the middle between their neighbours, and by how much; see `Neighbours`.

    Parameters
    ----------
    network, each
        The roads, and the loop of each vehicle, in the engine's order.
    """

    def __init__(self, network: RoadNetwork, each: Sequence[Loop]) -> None:
        loops = list({loop.id: loop for loop in each}.values())
        number = {loop.id: k for k, loop in enumerate(loops)}
        self._loops = np.array([number[loop.id] for loop in each], dtype=np.int64)
        ends = [times_along(network, loop) for loop in loops]
        lengths, laps = (np.array([float(end[of][-1]) for end in ends]) for of in (0, 1))
        begins_m = np.r_[0.0, np.cumsum(lengths)]
        begins_s = np.r_[0.0, np.cumsum(laps)]
        # All loops one behind the other: one look-up for all vehicles.
        self._ends_m = np.concatenate(
            [end[0] + at for end, (at, _) in zip(ends, pairwise(begins_m), strict=True)]
        )
        self._ends_s = np.concatenate(
            [end[1] + at for end, (at, _) in zip(ends, pairwise(begins_s), strict=True)]
        )
        self._begins_m, self._begins_s = begins_m[self._loops], begins_s[self._loops]
        self._lengths_m = lengths[self._loops]
        self._neighbours = Neighbours(laps[self._loops], self._loops)

    def __call__(self, fronts_m: Floats) -> Floats:
        """Return the leads of all vehicles, by their fronts [m]."""
        at_m = self._begins_m + fronts_m % self._lengths_m
        return self._neighbours.leads(np.interp(at_m, self._ends_m, self._ends_s) - self._begins_s)


class _Spacing:
    """Knows the leads of the vehicles that there are.

    Parameters
    ----------
    network, loops
        The roads, and the loop of each vehicle, by name.
    """

    def __init__(self, network: RoadNetwork, loops: Mapping[str, Loop], engine: Engine) -> None:
        self._network, self._loops, self._engine = network, loops, engine
        self._changes = -1

    def _early(self) -> Floats:
        """Return the leads of all vehicles."""
        engine = self._engine
        if not engine.drivers:
            return np.zeros(0)
        if self._changes != engine.changes:
            self._changes = engine.changes
            self._leads = Leads(self._network, [self._loops[driver.id] for driver in engine.drivers])
        return self._leads(engine.vehicles["front"])


class Holding(_Spacing):
    """Says for how long the drive may pass over the request of each vehicle that is ahead."""

    def look(self) -> None:
        """Renew how long each vehicle may be held; below 0 for a vehicle that is behind."""
        self._engine.vehicles["spare_s"] = _HOLD_S * self._early()


class SpeedAdvice(_Spacing):
    """Tells vehicles how fast to drive, every few seconds; for fleets driven by machine.

    Parameters
    ----------
    network, loops, engine
        See `Holding`.
    """

    def __init__(
        self, network: RoadNetwork, loops: Mapping[str, Loop], engine: Engine, traffic: Traffic
    ) -> None:
        super().__init__(network, loops, engine)
        self._traffic = traffic
        self._next_s = 0.0
        self._told: dict[str, float] = {}

    def look(self) -> None:
        """Give advice if it is time; called after each step."""
        if self._traffic.now_s < self._next_s:
            return
        self._next_s = self._traffic.now_s + _EVERY_S
        early = self._early()
        self._engine.vehicles["spare_s"] = np.minimum(early, 0.0)
        factors = np.clip(1.0 - early / 2.0, _SLOWEST, _FASTEST)
        for driver, factor in zip(self._engine.drivers, factors.tolist(), strict=True):
            if abs(factor - self._told.get(driver.id, _FASTEST)) > _LEAST_CHANGE:
                self._told[driver.id] = factor
                self._traffic.advise(driver.id, factor)


def times_along(network: RoadNetwork, loop: Loop) -> tuple[Floats, Floats]:
    """Return arc lengths at the ends of a loop's lanes [m], and the times there at the speeds allowed [s]."""
    took = [span.length_m / network.lanes[span.lane_id].speed_mps for span in loop.spans]
    ends = [0.0, *(span.end_m for span in loop.spans)]
    return np.array(ends), np.concatenate(([0.0], np.cumsum(took)))
