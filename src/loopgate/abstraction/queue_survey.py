"""What the queues abstraction makes of loops: places, crossings with their conflicts, loops it refuses."""

from __future__ import annotations

from dataclasses import dataclass

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.stretches import Stretch
from loopgate.network.loop import Loop


@dataclass(frozen=True, slots=True)
class PlaceSurvey:
    """A place: a lane, or the part of one, on which vehicles queue.

    Attributes
    ----------
    id, lane
        Its state, and the lane it lies on.
    begin_m, length_m
        Where on the lane it begins, and its length.
    capacity, at_start
        How many vehicles it holds, and how many may start there.
    loops
        Loops that visit it.
    """

    id: str
    lane: str
    begin_m: float
    length_m: float
    capacity: int
    at_start: int
    loops: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ConflictSurvey:
    """A conflict, seen from one of its two movements.

    Attributes
    ----------
    foe
        The other movement; its own name where vehicles that make it exclude each other.
    begin_m, end_m
        The stretch shared with it, in metres from this movement's beginning; None for all of it.
    listed
        False for movements over one junction whose conflict the request matrix does not list: only the
        geometry shows it.
    """

    foe: str
    begin_m: float | None
    end_m: float | None
    listed: bool

    @property
    def shared_m(self) -> float | None:
        """Length of the shared stretch along this movement."""
        return None if self.begin_m is None or self.end_m is None else self.end_m - self.begin_m


@dataclass(frozen=True, slots=True)
class CrossingSurvey:
    """A movement over a junction, or over a stretch of an edge on which nobody waits.

    Attributes
    ----------
    junction, stretch
        The one of the two that it leads over; the other is empty or None.
    loops
        Loops that make it.
    conflicts
        With other movements of the loops, by name.
    """

    id: str
    from_lane: str
    to_lane: str
    junction: str
    stretch: Stretch | None
    length_m: float
    loops: tuple[str, ...]
    conflicts: tuple[ConflictSurvey, ...]


@dataclass(frozen=True, slots=True)
class JoinedLane:
    """A lane too short to queue on, which belongs to the crossing it lies in."""

    lane: str
    length_m: float
    loops: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RefusedLoop:
    """Why a loop cannot work, and the edge at which, if it is one."""

    loop: Loop
    reason: str
    edge: str | None


@dataclass(frozen=True, slots=True)
class QueueSurvey:
    """All of it.

    Attributes
    ----------
    loops, itineraries
        The loops that work, in the order given, and how they are cut.
    places, crossings, joined
        In the order of first use.
    refused
        The loops that do not work, in the order given.
    even
        How many vehicles can start if the loops get them in turn.
    """

    loops: tuple[Loop, ...]
    itineraries: tuple[Itinerary, ...]
    places: tuple[PlaceSurvey, ...]
    crossings: tuple[CrossingSurvey, ...]
    joined: tuple[JoinedLane, ...]
    refused: tuple[RefusedLoop, ...]
    even: int

    @property
    def holds(self) -> int:
        """How many vehicles all places hold."""
        return sum(place.capacity for place in self.places)

    @property
    def at_start(self) -> int:
        """How many vehicles can start, each on a loop of its choice, so that everybody can move."""
        return sum(place.at_start for place in self.places)

    @property
    def conflicts(self) -> int:
        """How many pairs of movements conflict."""
        return len({frozenset((one.id, other.foe)) for one in self.crossings for other in one.conflicts})

    @property
    def unlisted(self) -> tuple[tuple[str, str], ...]:
        """Pairs of movements whose conflict only the geometry shows."""
        return tuple(
            (crossing.id, conflict.foe)
            for crossing in self.crossings
            for conflict in crossing.conflicts
            if not conflict.listed and crossing.id < conflict.foe
        )
