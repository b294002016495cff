"""Lays each path of a vehicle out as legs over places, once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from loopgate.abstraction.itinerary import Track
from loopgate.control.diary import Diary
from loopgate.control.layout import Drawings, Layout
from loopgate.control.places import Leg


class Paths:
    """The paths that have been laid out, in a layout.

    Vehicles with the same drawn legs share a path.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._laid: dict[int, tuple[Drawings, list[Leg]]] = {}
        """The drawn legs and their path, by identity of the drawn legs."""
        self.places = layout.places
        """The places, by name."""

    def of(self, track: Track) -> list[Leg]:
        """Return the legs of a path; it is laid out when it is first asked for."""
        key = id(track.legs)
        laid = self._laid.get(key)
        if laid is None:
            laid = self._laid[key] = track.legs, self._layout.path(track.legs)
        return laid[1]

    def lay(self, tracks: Iterable[Track]) -> None:
        """Lay paths out before vehicles come."""
        for track in tracks:
            self.of(track)

    def lay_more(
        self, slots: Mapping[str, int], ways: Mapping[str, Drawings], diaries: Sequence[Diary]
    ) -> None:
        """Lay more paths out while vehicles drive; the places that exist stay.

        Parameters
        ----------
        slots
            The slots of all places.
        ways
            The drawn legs of all paths, by the name of the loop.
        diaries
            The diaries of the vehicles on the road.
        """
        laid = {id(diary.path): (diary.path, ways[diary.track.loop]) for diary in diaries}
        self._layout.extend(slots, list(ways.values()), list(laid.values()))
        self._laid.clear()

    def lay_anew(self, layout: Layout) -> None:
        """Use another layout; no vehicle is on the road."""
        self._layout, self.places = layout, layout.places
        self._laid.clear()
