"""Loops as the queues abstraction sees them: places, crossings with their conflicts, loops it refuses."""

from dataclasses import dataclass

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.stretches import Stretch
from loopgate.network.loop import Loop


@dataclass(frozen=True, slots=True)
class PlaceSurvey:
    """A place: a lane, or the part of one, on which vehicles queue."""

    id: str
    lane: str
    """`id` and `lane`: its state, and the lane it lies on."""
    begin_m: float
    length_m: float
    """`begin_m` and `length_m`: where on the lane it begins, and its length."""
    capacity: int
    at_start: int
    """`capacity` and `at_start`: how many vehicles it holds, and how many may start there."""
    loops: tuple[str, ...]
    """Loops that visit it."""


@dataclass(frozen=True, slots=True)
class ConflictSurvey:
    """A conflict, seen from one of its two movements."""

    foe: str
    """The other movement; its own name where vehicles that make it exclude each other."""
    begin_m: float | None
    end_m: float | None
    """`begin_m` and `end_m`: the stretch shared with it, in metres from this movement's beginning; None for
    all of it."""
    listed: bool
    """False for movements over one junction whose conflict the request matrix does not list: only the
    geometry shows it."""

    @property
    def shared_m(self) -> float | None:
        """Length of the shared stretch along this movement."""
        return None if self.begin_m is None or self.end_m is None else self.end_m - self.begin_m


@dataclass(frozen=True, slots=True)
class CrossingSurvey:
    """A movement over a junction, or over a stretch of an edge on which nobody waits."""

    id: str
    from_lane: str
    to_lane: str
    junction: str
    stretch: Stretch | None
    """`junction` and `stretch`: the one of the two that it leads over; the other is empty or None."""
    length_m: float
    loops: tuple[str, ...]
    """Loops that make it."""
    conflicts: tuple[ConflictSurvey, ...]
    """With other movements of the loops, by name."""


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
    """All of it."""

    loops: tuple[Loop, ...]
    itineraries: tuple[Itinerary, ...]
    """`loops` and `itineraries`: the loops that work, in the order given, and how they are cut."""
    places: tuple[PlaceSurvey, ...]
    crossings: tuple[CrossingSurvey, ...]
    joined: tuple[JoinedLane, ...]
    """`places`, `crossings` and `joined`: in the order of first use."""
    refused: tuple[RefusedLoop, ...]
    """The loops that do not work, in the order given."""
    even: int
    """How many vehicles can start if the loops get them in turn."""

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
