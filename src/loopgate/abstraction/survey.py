"""Survey of loops under an abstraction: states, shares, loops that meet."""

from collections.abc import Sequence
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Itinerary
from loopgate.model import StateId


@dataclass(frozen=True, slots=True)
class LoopSurvey:
    """A loop in a survey: its length and the share that it has in common with other loops."""

    loop: str
    length_m: float
    states: int
    """Number of positions on the loop's path."""
    visits: int
    """Positions that are shared states."""
    shared_m: float
    """Length in shared states [m]."""
    meets: tuple[str, ...]
    """Other loops with a common state."""

    @property
    def shared(self) -> float:
        """The share of the loop's length that lies in shared states, 0 to 1."""
        return self.shared_m / self.length_m


@dataclass(frozen=True, slots=True)
class ZoneSurvey:
    """A shared state in a survey."""

    state: StateId
    loops: tuple[str, ...]
    """Loops that visit the state."""
    visits: int
    """Number of visits in one round of each loop."""
    length_m: float
    """Length of all visits together [m]."""


@dataclass(frozen=True, slots=True)
class Survey:
    """The result of a survey of loops: all loops and all shared states, the longest first."""

    loops: tuple[LoopSurvey, ...]
    zones: tuple[ZoneSurvey, ...]

    @property
    def private_states(self) -> int:
        """Number of states that a single loop visits."""
        return sum(loop.states - loop.visits for loop in self.loops)

    @property
    def shared(self) -> float:
        """Share of all loops' length in shared states, 0 to 1."""
        length_m = sum(loop.length_m for loop in self.loops)
        return sum(loop.shared_m for loop in self.loops) / length_m if length_m else 0.0


def survey(itineraries: Sequence[Itinerary]) -> Survey:
    """Return lengths and shared states of loops, from one itinerary per loop. O(legs times visitors)."""
    visits: dict[StateId, list[tuple[str, float]]] = {}
    for itinerary in itineraries:
        for leg in itinerary.legs:
            visits.setdefault(leg.state, []).append((itinerary.loop.id, leg.end_m - leg.begin_m))
    loops_of = {state: tuple(dict.fromkeys(loop for loop, _ in found)) for state, found in visits.items()}
    loops = []
    for itinerary in itineraries:
        shared = [leg for leg in itinerary.legs if len(loops_of[leg.state]) > 1]
        meets = dict.fromkeys(loop for leg in shared for loop in loops_of[leg.state])
        loops.append(
            LoopSurvey(
                loop=itinerary.loop.id,
                length_m=itinerary.loop.lap_m,
                states=len(itinerary.legs),
                visits=len(shared),
                shared_m=sum(leg.end_m - leg.begin_m for leg in shared),
                meets=tuple(loop for loop in meets if loop != itinerary.loop.id),
            )
        )
    zones = [
        ZoneSurvey(state, loops_of[state], len(found), sum(metres for _, metres in found))
        for state, found in visits.items()
        if len(loops_of[state]) > 1
    ]
    return Survey(tuple(loops), tuple(sorted(zones, key=lambda zone: -zone.length_m)))
