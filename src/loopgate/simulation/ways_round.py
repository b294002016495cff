"""The paths that vehicles of a loop can take: the loop, and the detours round blocked parts of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from math import inf

from loopgate.abstraction.itinerary import DrawnLeg, Track, continues
from loopgate.control.diary import Diary
from loopgate.network import Edge

_SAME_M = 0.1


@dataclass(frozen=True, slots=True)
class TurnOff:
    """A vehicle's change of path: at leg `leg` of its own path, to leg `position` of path `way`."""

    leg: int
    way: str
    position: int


class WaysRound:
    """Knows the paths for each loop, the places on each edge and lane, and how far a path is free.

    Parameters
    ----------
    roads
        The edges of the network, by name.
    every
        A path on each loop, and on each detour.
    own
        By name of a detour, the name of the loop that it replaces.
    """

    def __init__(self, roads: Mapping[str, Edge], every: Iterable[Track], own: Mapping[str, str]) -> None:
        self._roads = roads
        rounds = {track.loop: track for track in every if track.rounds}
        tracks = {loop: [track] for loop, track in rounds.items() if loop not in own}
        for detour in (one for one in own if one in rounds):
            tracks[own[detour]].append(rounds[detour])
        self._ways = tracks | {detour: tracks[loop] for detour, loop in own.items()}
        self._shut: frozenset[str] = frozenset()
        self._stuck: frozenset[str] = frozenset()
        self._free: dict[tuple[str, int], float] = {}
        """Number of free places ahead, by path and index of a place."""
        self._through: dict[tuple[str, str, float], Sequence[tuple[Track, int]]] = {}
        """Paths and indices on them, by loop, place, and where the place ends on the loop [m]."""
        self.on_edge: defaultdict[str, set[str]] = defaultdict(set)
        """The places on each edge."""
        self.on_lane: defaultdict[str, set[str]] = defaultdict(set)
        """The places whose stop line is on each lane."""
        for some in self._ways.values():
            for track in some:
                self._take(track)

    def _take(self, track: Track) -> None:
        begins = [begin_m for begin_m, _ in track.edges]
        for leg in track.legs:
            self.on_lane[f"{leg.line.edge}_{leg.line.lane}"].add(leg.state)
            self.on_edge[leg.line.edge].add(leg.state)
            for (begin_m, edge), end_m in zip(track.edges, [*begins[1:], track.lap_m], strict=True):
                if min(end_m, leg.end_m) - max(begin_m, leg.begin_m) > _SAME_M:
                    self.on_edge[edge].add(leg.state)

    def own(self, track: Track) -> Track | None:
        """Return the loop of a path; None for the path of a vehicle that drives once."""
        return self._ways[track.loop][0] if track.loop in self._ways else None

    def others(self, diary: Diary) -> Sequence[tuple[Track, int]]:
        """Return the paths of a vehicle's loop through its place, with the index of that place on each."""
        here, loop = diary.drawn(diary.vehicle.granted), diary.track.loop
        key = loop, here.state, here.end_m
        if key not in self._through:
            tracks = self._ways.get(loop, ())
            self._through[key] = [
                (track, n) for track in tracks for n, leg in enumerate(track.legs) if continues(here, leg)
            ]
        return self._through[key]

    def junction(self, leg: DrawnLeg) -> str:
        """Return the junction behind the stop line of a place."""
        return self._roads[leg.line.edge].to_junction

    def avoid(self, shut: AbstractSet[str], stuck: AbstractSet[str]) -> None:
        """Set the places and junctions that vehicles are led round."""
        if shut != self._shut or stuck != self._stuck:
            self._shut, self._stuck = frozenset(shut), frozenset(stuck)
            self._free.clear()

    def free_legs(self, track: Track, position: int) -> float:
        """Return how many places after an index on a path can be driven to; infinity if all can."""
        count = len(track.legs)
        key = track.loop, position % count
        if key not in self._free:
            self._free[key] = next(
                (n for n in range(count - 1) if not self._leads_on(track, position + n)), inf
            )
        return self._free[key]

    def _leads_on(self, track: Track, position: int) -> bool:
        """Return whether vehicles may be led to the next place on a path."""
        here, ahead = (track.legs[(position + n) % len(track.legs)] for n in (0, 1))
        return ahead.state not in self._shut and not (self._stuck and self.junction(here) in self._stuck)
