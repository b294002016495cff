"""Makes the places, movements and paths of the ledger from the legs that an abstraction draws."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from math import inf
from types import MappingProxyType

from loopgate.abstraction.itinerary import Crossing, DrawnLeg, Overlap, PlaceRoom
from loopgate.control.lamps import Signal
from loopgate.control.lights import is_at_line
from loopgate.control.places import ChangeStretch, ConflictGroup, Foe, Leg, Movement, Pass, Place, joined

Drawings = Sequence[DrawnLeg]


class PlaceLayout:
    """Places by name, and paths.

    Parameters
    ----------
    slots
        Number of slots of each place, by name.
    ways
        The legs of each path, in driving order. Their crossings give the movements.
    signals
        The lights that are obeyed, by movement; none by default.
    on_path
        Called with each new path. With ordinary traffic it adds what vehicles on the path look out for.
    rooms
        The places whose slots depend on the lengths of the vehicles that come, by name.
    walked
        The movements that persons may cross, by name.
    """

    def __init__(
        self,
        slots: Mapping[str, int],
        ways: Sequence[Drawings],
        signals: Mapping[str, Signal] = MappingProxyType({}),
        on_path: Callable[[list[Leg], Drawings], None] | None = None,
        rooms: Mapping[str, PlaceRoom] = MappingProxyType({}),
        walked: AbstractSet[str] = frozenset(),
    ) -> None:
        self._signals, self._on_path, self._rooms, self._walked = signals, on_path, rooms, walked
        self.is_lit = bool(signals)
        """Whether some movement has a light that is obeyed."""
        self.places: dict[str, Place] = {}
        self._movements: dict[str, Movement] = {}
        self._stretches: dict[str, ChangeStretch] = {}
        self.extend(slots, ways)

    def extend(
        self,
        slots: Mapping[str, int],
        ways: Sequence[Drawings],
        laid: Sequence[tuple[Sequence[Leg], Drawings]] = (),
    ) -> None:
        """Add places and movements; keep what exists, and the grants over it.

        `slots`, `ways`: all of them, as for a new layout. `laid`: the paths that vehicles drive on, each with
        its legs as they are drawn now.
        """
        self.places |= {
            name: self._place(name, least) for name, least in slots.items() if name not in self.places
        }
        crossings = {c.id: c for way in ways for leg in way for c in leg.crossings}
        together = _together(crossings, ways)
        junctions: dict[str, ConflictGroup] = {}
        before = {movement.junction: None for movement in self._movements.values()}
        for name in sorted(crossings):
            junction = junctions.setdefault(together[name], ConflictGroup())
            if name in self._movements:
                self._movements[name].junction = junction
            else:
                self._movements[name] = Movement(name, junction)
        for trip in sorted((t for one in before for t in one.trips), key=lambda trip: trip.number):
            trip.over.movement.junction.trips.append(trip)
        for path, way in laid:
            for leg, drawn in zip(path, way, strict=True):
                for over, crossing in zip(leg.passes, drawn.crossings, strict=True):
                    over.foes = self._foes(crossing)
        for exits in _exits(ways).values():
            for name in exits:
                self._movements[name].beside = [self._movements[other] for other in exits if other != name]

    def _place(self, name: str, least: int) -> Place:
        room = self._rooms.get(name)
        if room is None:
            return Place(name, least)
        place = Place(name, least, room.length_m, room.slot_m, room.most_kept_m, room.overhang_m)
        if room.stretch:
            place.stretch = self._stretches.setdefault(room.stretch, ChangeStretch())
            place.stretch.behind.append(place)
        return place

    @property
    def movements(self) -> Iterable[Movement]:
        """All movements."""
        return self._movements.values()

    def path(self, way: Drawings) -> list[Leg]:
        """Return the path over some legs; it is closed unless vehicles arrive on its last leg."""
        legs = [
            Leg(self.places[drawn.state], number, float(drawn.begin_m), float(drawn.end_m))
            for number, drawn in enumerate(way)
        ]
        for leg, drawn in zip(legs, way, strict=True):
            leg.guided, leg.slot_m = bool(drawn.guides), float(drawn.slot_m)
            leg.guide_m = float(drawn.guides[0].stop_m) if drawn.guides else inf
            leg.passes = [self._pass(c, first=k == 0) for k, c in enumerate(drawn.crossings)]
            for crossing in drawn.crossings:
                stretch = self._stretches.get(crossing.stretch)
                if stretch is not None:
                    leg.change = stretch
            leg.inner = [over for over in leg.passes if over.signal is not None and not is_at_line(over, leg)]
        joined(legs, closed=not way[-1].away)
        for leg in legs:
            leg.nears = leg.change or (leg.after.change if leg.after is not None else None)
            if leg.nears is not None and leg.place not in leg.nears.before:
                leg.nears.before.append(leg.place)
        if self._on_path is not None:
            self._on_path(legs, way)
        return legs

    def _pass(self, crossing: Crossing, *, first: bool) -> Pass:
        movement, signal = self._movements[crossing.id], self._signals.get(crossing.id)
        wait_m, ahead_m = float(crossing.wait_m), float(crossing.ahead_m)
        over = Pass(movement, float(crossing.speed_mps), wait_m, ahead_m, signal, first=first)
        over.foes = self._foes(crossing)
        over.walked = crossing.id in self._walked
        return over

    def _foes(self, crossing: Crossing) -> dict[Movement, Foe]:
        foes: dict[Movement, Foe] = {}
        for name in sorted(crossing.foes & self._movements.keys()):
            movement, sized = self._movements[name], crossing.sized.get(name)
            foe = foes[movement] = _foe(movement, crossing, crossing.overlaps.get(name, (0.0, inf)))
            if sized is not None:
                foe.sizes = list(sized.sizes)
                foe.among = [[o and _foe(movement, crossing, o) for o in row] for row in sized.among]
        return foes


def _foe(movement: Movement, crossing: Crossing, overlap: Overlap) -> Foe:
    from_m, to_m = overlap
    soonest_s, least = crossing.soonest(from_m)
    until_s = crossing.soonest(to_m)[0] if to_m < inf else 0.0
    mean = to_m / until_s if until_s > 0.0 else least
    return Foe(movement, float(from_m), float(to_m), float(soonest_s), float(least), float(mean))


def _exits(ways: Sequence[Drawings]) -> dict[str, list[str]]:
    """Return, for each place, the movements that begin at its end."""
    exits: dict[str, set[str]] = {}
    for way in ways:
        for leg in way:
            exits.setdefault(leg.state, set()).update(c.id for c in leg.crossings[:1])
    return {place: sorted(names) for place, names in exits.items()}


def _together(crossings: Mapping[str, Crossing], ways: Sequence[Drawings]) -> dict[str, str]:
    """Return a representative for each movement: movements that conflicts link have the same."""
    root = {name: name for name in crossings}

    def find(name: str) -> str:
        while root[name] != name:
            root[name] = root[root[name]]
            name = root[name]
        return name

    for name in sorted(crossings):
        for foe in sorted(crossings[name].foes & crossings.keys()):
            root[find(foe)] = find(name)
    for exits in _exits(ways).values():
        for name in exits[1:]:
            root[find(name)] = find(exits[0])
    return {name: find(name) for name in crossings}
