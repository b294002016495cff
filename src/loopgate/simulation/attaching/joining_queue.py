"""Lets vehicles of an owner's simulation join the gate, follows the owner's changes, and releases them."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from loopgate.errors import TrafficError
from loopgate.network import Loop, RoadNetwork, VehicleType
from loopgate.simulation.attaching.fleet import Fleet
from loopgate.simulation.attaching.moves import MOVED_M, Moves
from loopgate.simulation.attaching.newcomers import Newcomer
from loopgate.simulation.attaching.plan import Plan
from loopgate.simulation.settings import brakes_late
from loopgate.traffic.base import Traffic

GONE = "gone"
"""The reason for the end of a vehicle that is no longer on the road."""

_AGAIN_S = 1.0
"""A newcomer that was refused is tried again after this time [s]."""

_SETTLES_S = 60.0
"""Grants are withheld this long at most, to lay detours round standing vehicles [s]."""

_LONGER_M = 0.01


class JoiningQueue:
    """The vehicles that wait to join a gate.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    fleet
        The vehicles under the gate; it is empty.

    Notes
    -----
    A newcomer that is refused waits on the road. So a place may hold one vehicle more than its slots.

    A new loop changes the plan. Where the places of the vehicles under the gate stay as they are, these drive
    on. Otherwise the gate withholds all grants until each vehicle holds one place only. Then all vehicles
    join anew, by the new plan.
    """

    def __init__(self, network: RoadNetwork, traffic: Traffic, fleet: Fleet) -> None:
        self._traffic = traffic
        self.plan = Plan(network, ())
        self._next: Plan | None = None
        self.fleet = fleet
        """The vehicles under the gate."""
        self._moves = Moves(network, traffic)
        self.newcomers: dict[str, Newcomer] = {}
        self._spare: tuple[Plan | None, float] = None, math.inf
        """The plan without the detours laid last, and when it is used if some vehicle does not settle [s]."""
        self.before_asking: Callable[[], None] = lambda: None
        """Called in each step before vehicles ask."""
        self.mended = 0
        """How often the line of a place was not in the order on the road."""

    def add(self, newcomers: Sequence[Newcomer]) -> None:
        """Add vehicles to the queue; each joins the gate as soon as possible.

        Raises
        ------
        RefusedLoopError
            If a loop of theirs cannot work as queues; then none is added.
        """
        loops = [(newcomer.loop, newcomer.kind) for newcomer in newcomers]
        plan = (self._next or self.plan).extended(loops)
        if plan is not self.plan:
            self._next = plan
        other, until_s = self._spare
        if math.isfinite(until_s):
            without = (other or self.plan).extended(loops)
            self._spare = None if without is self.plan else without, until_s
        self.newcomers.update((newcomer.vehicle, newcomer) for newcomer in newcomers)

    @property
    def coming(self) -> Plan | None:
        """The plan that vehicles will follow next, if it is not in use yet."""
        return self._next

    def lay(self, ways: Sequence[tuple[Loop, VehicleType]], *, all_settle: bool) -> bool:
        """Add loops to the plan; return whether vehicles can follow it, at once or when all have settled.

        Parameters
        ----------
        all_settle
            Whether every vehicle can come to hold one place only. If not, loops are added only if
            existing places, and the roads between them, stay as they are.
        """
        before = self._next or self.plan
        plan = before.extended(ways)
        if not all_settle and not plan.goes_on_with(before):
            return False
        self._spare = None if before is self.plan else before, self._traffic.now_s + _SETTLES_S
        self._next = plan
        return True

    def drop(self, vehicles: Iterable[str], reason: str) -> None:
        """Release vehicles, whether under the gate or waiting to join."""
        gone = set(vehicles)
        for vehicle in sorted(gone & self.newcomers.keys()):
            del self.newcomers[vehicle]
            self._traffic.leave_gate(vehicle)
        if self.fleet.let_go(gone, reason):
            self.fleet.answer()

    def after_step(self) -> None:
        """Drive the vehicles under the gate after a step, and let newcomers join."""
        self._notice()
        if self.fleet.diaries:
            self._traffic.stay_braked()
            self._heed_dynamics()
            self._heed_stops()
            self.before_asking()
            self.fleet.after_step()
            self.mended += self.fleet.mend_order()
        self._take_in()

    def _heed_dynamics(self) -> None:
        """Read accelerations and speeds, which the owner may have set.

        Raises
        ------
        TrafficError
            If a vehicle is longer than it was: places have no space for it.
        """
        for name, diary in self.fleet.diaries.items():
            can, make = self._traffic.dynamics(name), diary.vehicle.make
            if can.length_m > make.length_m + _LONGER_M:
                msg = (
                    f"vehicle {name}: its length was {make.length_m:g} m when it came under the gate "
                    f"and is {can.length_m:g} m; let it leave the gate, and add it again"
                )
                raise TrafficError(msg)
            if can.decel_mps2 > make.decel:
                self._traffic.show_brakes(name)
            self.fleet.leads.drives_like(name, can)

    def _heed_stops(self) -> None:
        """Read the stops that the owner has set.

        If SUMO lists such a stop after the stop that holds the vehicle, it lies beyond the vehicle's stop
        line.
        """
        for diary in self.fleet.diaries.values():
            before_m, stop, at_m = diary.vehicle.stop_m, self._traffic.next_stop(diary.vehicle.name), math.inf
            if stop is not None:
                edge, position_m, beyond = stop
                at_m = diary.track.ahead(
                    edge, position_m, diary.vehicle.line_m if beyond else diary.vehicle.front_m - MOVED_M
                )
            self.fleet.stops_at(diary.vehicle.name, at_m, anew=at_m > before_m + MOVED_M)

    def _notice(self) -> None:
        """Drop vehicles that are gone, and let vehicles that the owner has moved join anew."""
        if not self.fleet.diaries and not self.newcomers:
            return
        present = set(self._traffic.vehicles())
        known = [
            *self.fleet.diaries,
            *(newcomer.vehicle for newcomer in self.newcomers.values() if newcomer.seen),
        ]
        self.drop([vehicle for vehicle in known if vehicle not in present], GONE)
        self._rejoin(self._moves.find(self.fleet.diaries.values()), "moved")
        for newcomer in self.newcomers.values():
            newcomer.seen |= newcomer.vehicle in present

    def _rejoin(self, vehicles: Sequence[str], reason: str) -> None:
        kinds = {loop.id: (loop, kind) for loop, kind in self.plan.users}
        now = self._traffic.now_s
        again = [Newcomer(v, *kinds[self.fleet.diaries[v].track.loop], now, seen=True) for v in vehicles]
        self.drop(vehicles, reason)
        self.newcomers = {newcomer.vehicle: newcomer for newcomer in again} | self.newcomers  # they go first

    def _take_in(self) -> None:
        """Hold newcomers at places of their loops, and let the ones join that are wholly in a place."""
        if self._next is not None and not self._replan(self._next):
            return
        now = self._traffic.now_s
        on_road = [newcomer for newcomer in self.newcomers.values() if newcomer.seen]
        for newcomer in on_road:
            newcomer.look(self._traffic, self.plan)
        ready = [n for n in on_road if n.inside and now >= n.tried_s + _AGAIN_S]
        if not ready or self._try(ready) or len(ready) == 1:
            return
        for newcomer in ready:
            self._try([newcomer])

    def _replan(self, plan: Plan) -> bool:
        """Change to another plan if that can be done now; otherwise withhold grants until it can."""
        goes_on = not self.fleet.diaries or plan.goes_on_with(self.plan)
        if not goes_on and not self.fleet.settled:
            other, until_s = self._spare
            if self._traffic.now_s >= until_s:  # a vehicle stands that does not settle
                self._next, self._spare = other, (other, math.inf)
                self.fleet.pause(pauses=False)
                return False
            self.fleet.pause(pauses=True)
            return False
        self.fleet.pause(pauses=False)
        for newcomer in self.newcomers.values():
            newcomer.let_go(self._traffic)
        if not goes_on:
            self._rejoin(list(self.fleet.diaries), "another plan")
        self._next, self._spare, self.plan = None, (None, math.inf), plan
        self.fleet.drive_by(plan)
        return True

    def _try(self, newcomers: Sequence[Newcomer]) -> bool:
        """Let newcomers join together if places and gate allow it."""
        for newcomer in newcomers:
            newcomer.tried_s = self._traffic.now_s
        tracks = [
            replace(
                self.plan.track(n.vehicle, n.loop.id, front_m=n.arc_m, position=n.position or 0),
                brakes_late=brakes_late(n.kind),
            )
            for n in newcomers
        ]
        if not self.fleet.take_in(tracks, beyond=1):
            return False
        self._heed_stops()
        self.fleet.answer()
        for newcomer in newcomers:
            del self.newcomers[newcomer.vehicle]
        return True
