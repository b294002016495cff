"""The ways before gated vehicles, in tables of ordinary traffic (`loopgate.drive.around`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from loopgate.abstraction.track import Track
from loopgate.drive.around import AcrossRow, ApproachRow, CrossedRow, PlaceRow, WayRow
from loopgate.drive.codes import NOBODY
from loopgate.drive.rows import table
from loopgate.simulation.around.crossing_ways import CrossingWays, Movement
from loopgate.simulation.around.roads import Roads

__all__ = ["Ways"]


class Ways:
    """The tables of the crossings ahead on all loops.

    Parameters
    ----------
    find
        Object that finds the crossings ahead.
    roads
        The row numbers of lanes and junctions.
    tracks
        Paths of vehicles, at least one on each loop.
    code
        Mapping of words to numbers.
    """

    def __init__(
        self, find: CrossingWays, roads: Roads, tracks: Iterable[Track], code: Callable[[str], int]
    ) -> None:
        self._roads = roads
        self._lists: list[int] = []
        self._ways: list[tuple[float, ...]] = []
        self._crossed: list[tuple[float, ...]] = []
        self._across: list[tuple[float, ...]] = []
        self._approaches: list[tuple[float, ...]] = []
        self._places: dict[str, int] = {}
        """States by name, and the first leg that each is on."""
        self.lit: dict[str, list[tuple[int, int]]] = {}
        """By light, the approaches that have a link of it, and the link."""
        loops = {track.loop: track for track in tracks}
        at = {code(loop): self._add(find, track) for loop, track in loops.items()}
        way_at = np.full(max(at, default=-1) + 1, NOBODY, dtype=np.int64)
        way_at[list(at)] = list(at.values())
        self.tables: Mapping[str, NDArray[Any]] = {
            "ways": _filled(WayRow, self._ways),
            "crossed": _filled(CrossedRow, self._crossed),
            "across": _filled(AcrossRow, self._across),
            "approaches": _filled(ApproachRow, self._approaches),
            "places": table(
                PlaceRow, {"way": list(self._places.values()), "state": NOBODY}, length=len(self._places)
            ),
            "way_at": way_at,
            "lane_lists": np.array(self._lists, dtype=np.int64),
        }

    @property
    def states(self) -> Sequence[str]:
        """The states of all places, by number."""
        return list(self._places)

    def place_on_lanes(self, lanes: Any) -> None:  # noqa: ANN401  a table, by column
        """Enter in each lane the first place on it."""
        lanes["place"] = NOBODY
        where = [(self._ways[way], number) for number, way in enumerate(self._places.values())]
        for (_, _, lane, *_), number in sorted(where, key=lambda one: one[0][3], reverse=True):
            lanes["place"][int(lane)] = number

    def _add(self, find: CrossingWays, track: Track) -> int:
        """Add the legs of a loop; return the number of the first."""
        first = len(self._ways)
        numbers = {str(name): number for number, name in enumerate(self._places)}
        for position, (leg, way) in enumerate(zip(track.legs, find.of(track), strict=True)):
            state = str(leg.state)
            if state not in self._places:
                self._places[state], numbers[state] = len(self._ways), len(numbers)
            place = find.place(track, position)
            into, between = self._listed(place.into), self._listed(way.between)
            begin = len(self._crossed)
            for movement in way.movements:
                self._cross(movement)
            stretch = self._roads.lanes[place.lane], place.begin_m, place.end_m
            row = (numbers[state], leg.away, *stretch, *into, *between, begin, len(self._crossed))
            self._ways.append(row)
        return first

    def _listed(self, lanes: Iterable[str]) -> tuple[int, int]:
        begin = len(self._lists)
        self._lists += (self._roads.lanes[lane] for lane in lanes)
        return begin, len(self._lists)

    def _cross(self, movement: Movement) -> None:
        across, approaches = len(self._across), len(self._approaches)
        for lane in movement.across:
            past_m, unseen = movement.past_m.get(lane, math.inf), lane in movement.unseen
            self._across.append((self._roads.lanes[lane], past_m, unseen))
        for approach in movement.approaches:
            if approach.signal is not None:
                light, link = approach.signal
                self.lit.setdefault(light, []).append((len(self._approaches), link))
            junction = self._roads.junctions[approach.from_edge, approach.to_edge]
            self._approaches.append((junction, approach.signal is None))
        figures = movement.from_m, movement.length_m, movement.speed_mps, movement.wait_m
        lists = across, len(self._across), approaches, len(self._approaches)
        self._crossed.append((*figures, movement.waits_in_way, *lists))


def _filled(row: type, rows: Sequence[tuple[float, ...]]) -> NDArray[Any]:
    made = table(row, length=len(rows))
    made[:] = rows
    return made
