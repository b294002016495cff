"""Vehicles that turn to other ways between places: by the rule of the drive, everyone still arrives."""

from __future__ import annotations

from random import Random

import pytest

PLACES, ROOM, AWAY = 6, 2, -1


def way(rng: Random, begin: int) -> list[int]:
    """Return places from one on, none twice in a row, and then away."""
    places = [begin]
    while len(places) < rng.randint(2, 9):
        places.append(rng.choice([place for place in range(PLACES) if place != places[-1]]))
    return [*places, AWAY]


class Streets:
    """Places of two, first in first out; each vehicle has its way, its own place first."""

    def __init__(self, rng: Random) -> None:
        self.lines: list[list[list[int]]] = [[] for _ in range(PLACES)]
        for place, line in enumerate(self.lines):
            line += [way(rng, place) for _ in range(rng.randint(0, ROOM - 1))]

    def is_full(self, place: int) -> bool:
        """Return whether a place has no slot."""
        return place != AWAY and len(self.lines[place]) >= ROOM

    def leads_round(self, wanted: int, place: int) -> bool:
        """Return whether full places lead from one round to another, each by what its first wants."""
        for _ in range(PLACES + 1):
            if wanted == place or not self.is_full(wanted):
                return wanted == place
            wanted = self.lines[wanted][0][1]
        return False

    def may_move(self, place: int) -> bool:
        """Return whether the first of a place may go on: there is a slot, and it closes no full circle."""
        wanted = self.lines[place][0][1]
        if wanted == AWAY:
            return True
        if self.is_full(wanted):
            return False
        if len(self.lines[wanted]) + 1 < ROOM:
            return True
        first = self.lines[wanted][0] if self.lines[wanted] else self.lines[place][0][1:]
        was_full, self_leaves = self.is_full(place), place
        here = first[1]
        for _ in range(PLACES + 1):
            if here == wanted:
                return False
            if here == AWAY or (here == self_leaves and was_full) or not self.is_full(here):
                return True
            here = self.lines[here][0][1]
        return True

    def may_turn(self, place: int, at: int, other: list[int]) -> bool:
        """Return whether the vehicle at a number in the line may take another way: the rule of the drive."""
        return at > 0 or not self.is_full(place) or not self.leads_round(other[1], place)


@pytest.mark.parametrize("seed", range(400))
def test_everyone_arrives_who_turns_finitely_often(seed: int) -> None:
    """Random streets, random turns, random order of moves; some of the firsts may always go on."""
    rng = Random(seed)
    streets = Streets(rng)
    turns = 60
    while any(streets.lines):
        place = rng.choice([k for k, line in enumerate(streets.lines) if line])
        if turns and rng.random() < 0.5:
            at = rng.randrange(len(streets.lines[place]))
            other = way(rng, place)
            if streets.may_turn(place, at, other):
                streets.lines[place][at] = other
                turns -= 1
        may = [k for k, line in enumerate(streets.lines) if line and streets.may_move(k)]
        assert may, "nobody may go on"
        going = rng.choice(may)
        vehicle = streets.lines[going].pop(0)[1:]
        if vehicle[0] != AWAY:
            streets.lines[vehicle[0]].append(vehicle)


def test_without_the_rule_for_turns_somebody_is_stuck() -> None:
    """The first of a full place turns towards another full one that leads back."""
    streets = Streets(Random(0))
    streets.lines = [[] for _ in range(PLACES)]
    streets.lines[0] = [[0, 2, AWAY], [0, AWAY]]
    streets.lines[1] = [[1, 0, AWAY], [1, AWAY]]
    assert not streets.may_turn(0, 0, [0, 1, AWAY])
    assert streets.may_turn(0, 1, [0, 1, AWAY])
    streets.lines[0][0] = [0, 1, AWAY]
    assert not any(streets.may_move(place) for place in (0, 1))
