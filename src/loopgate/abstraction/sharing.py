"""Limits the share of each loop's length that lies in zones with other loops."""

from collections.abc import Iterable
from typing import NamedTuple

from loopgate.abstraction.segments import DEFAULT_RHO_M, ZoneVisit, cover, needed_length_m
from loopgate.network.contacts import lane_contacts
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE


class _Near(NamedTuple):
    """Stretches of two lanes near each other, as fractions: begin and end here, lane and stretch there."""

    begin: float
    end: float
    lane: str
    lane_begin: float
    lane_end: float


class _Use(NamedTuple):
    """A loop on a lane: the loop's number, arc length where the lane begins, length of the lane [m]."""

    loop: int
    begin_m: float
    length_m: float


class SharingBound:
    """Accepts loops one by one as long as no loop shares more than a limit with the others.

    Shared is the length that lies in zones (`loopgate.abstraction.segments`) once these are fitted to
    vehicles of the default type, as a share of the loop's length. Visits that touch are taken apart here,
    which can only overestimate.

    Parameters
    ----------
    max_shared
        Largest share, 0 to 1.
    rho_m
        Safe radius [m].
    """

    def __init__(self, network: RoadNetwork, max_shared: float, *, rho_m: float = DEFAULT_RHO_M) -> None:
        self._max_shared = max_shared
        self._need_m = needed_length_m(DEFAULT_TYPE.length_m, DEFAULT_TYPE.min_gap_m)
        shapes = {lane.id: lane.shape for edge in network.edges.values() for lane in edge.lanes}
        shapes |= {lane: network.lanes[lane].shape for c in network.connections for lane in c.via}
        contacts = lane_contacts(shapes, 2.0 * rho_m)
        self._near: dict[str, list[_Near]] = {lane: [] for lane in contacts.lanes}
        for one, other, a, b, c, d in zip(
            contacts.one.tolist(),
            contacts.other.tolist(),
            contacts.one_begin.tolist(),
            contacts.one_end.tolist(),
            contacts.other_begin.tolist(),
            contacts.other_end.tolist(),
            strict=True,
        ):
            here, there = contacts.lanes[one], contacts.lanes[other]
            self._near[here].append(_Near(a, b, there, c, d))
            if one != other:
                self._near[there].append(_Near(c, d, here, a, b))
        self._loops: list[Loop] = []
        self._stretches: list[list[tuple[float, float]]] = []
        self._users: dict[str, list[_Use]] = {}

    def admits(self, loop: Loop) -> bool:
        """Return whether a further loop keeps all loops within the limit; if so, count it.

        Costs time in proportion to the loop's lanes times the loops that come near them.
        """
        number = len(self._loops)
        mine: list[tuple[float, float]] = []
        added: dict[int, list[tuple[float, float]]] = {}
        uses = [
            (lane_id, _Use(number, span.begin_m, span.length_m))
            for span in loop.spans
            for lane_id in span.lane_ids
        ]
        for lane, use in uses:
            for near in self._near[lane]:
                for other in self._users.get(near.lane, ()):
                    mine.append(_stretch(use, near.begin, near.end))
                    added.setdefault(other.loop, []).append(_stretch(other, near.lane_begin, near.lane_end))
        if self.share(loop, mine) > self._max_shared:
            return False
        for k, stretches in added.items():
            if self.share(self._loops[k], self._stretches[k] + stretches) > self._max_shared:
                return False
        self._loops.append(loop)
        self._stretches.append(mine)
        for k, stretches in added.items():
            self._stretches[k] += stretches
        for lane, use in uses:
            self._users.setdefault(lane, []).append(use)
        return True

    def share(self, loop: Loop, stretches: Iterable[tuple[float, float]]) -> float:
        """Return the share of a loop's length that lies in zones with other loops."""
        visits = [ZoneVisit(begin, end, k) for k, (begin, end) in enumerate(sorted(set(stretches)))]
        if not visits:
            return 0.0
        from networkx.utils import UnionFind  # noqa: PLC0415  most runs do without it

        grown = cover(loop, visits, self._need_m, UnionFind(range(len(visits))))
        return sum(visit.length_m for visit in grown) / loop.length_m


def _stretch(use: _Use, begin: float, end: float) -> tuple[float, float]:
    return use.begin_m + begin * use.length_m, use.begin_m + end * use.length_m
