"""Ruin and recreate: take streets out of neighbouring tours and insert them where they cost least.

Schrimpf, Schneider, Stamm-Wilbrandt, Dueck, "Record breaking optimization results using the ruin and recreate
principle", J. Comput. Phys. 159, 2000; the strings are those of Christiaens and Vanden Berghe, "Slack
induction by string removals for vehicle routing problems", Transp. Sci. 54, 2020.

Lists of plain numbers, for this is compiled with the ledger, where a C compiler is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, log
from random import Random
from typing import Final

_MOST_STRINGS: Final = 3
_OF_LONGEST: Final = 0.3
_SHUFFLED: Final = 0.5
_FARTHEST_FIRST: Final = 0.8
_BLINK: Final = 0.01
"""So often streets are taken from the longest tour; put in in random order, the farthest first, or else in
order of removal; and so often a place to put one in is overlooked."""

_LEAST_GAIN: Final = 1e-6

POWER: Final = 12
"""A tour of length x is worth ``x**POWER + share * x``, in units of a scale."""


def worth(length: float, scale: float, share: float) -> float:
    """Return the cost of a tour; less is better."""
    x = length / scale
    x4 = x * x * x * x
    return x4 * x4 * x4 + share * x


class Tours:
    """Closed tours through streets 0, 1, 2, ...

    `before`, `behind`: the neighbours of each street on its tour. `on`: its tour, -1 while it is taken out.
    `sizes`, `lengths`: of each tour, the number of streets and the length.
    """

    def __init__(
        self, before: list[int], behind: list[int], on: list[int], sizes: list[int], lengths: list[float]
    ) -> None:
        self.before, self.behind, self.on = before, behind, on
        self.sizes, self.lengths = sizes, lengths

    def copy(self) -> Tours:
        """Return tours that do not change with these."""
        return Tours(self.before[:], self.behind[:], self.on[:], self.sizes[:], self.lengths[:])

    def orders(self) -> list[list[int]]:
        """Return the streets of each tour in their order."""
        found = []
        first: dict[int, int] = {}
        for street, tour in enumerate(self.on):
            first.setdefault(tour, street)
        for tour in range(len(self.sizes)):
            order = [first[tour]]
            while self.behind[order[-1]] != order[0]:
                order.append(self.behind[order[-1]])
            found.append(order)
        return found


class StreetMover:
    """Takes streets out of tours and inserts them again, many times.

    Parameters
    ----------
    cost
        Between streets, a row for each; on the diagonal the closed walk through one alone.
    near_in, near_out
        For each street those that it is near from, and those that are near from it.
    around
        For each street the streets around it, itself first.
    """

    def __init__(
        self,
        cost: Sequence[Sequence[float]],
        near_in: list[list[int]],
        near_out: list[list[int]],
        around: list[list[int]],
    ) -> None:
        self._cost, self._near_in, self._near_out, self._around = cost, near_in, near_out, around

    def rebuild(
        self,
        tours: Tours,
        scale: float,
        share: float,
        bound: float,
        heat: float,
        tries: int,
        longest_string: int,
        seed: int,
    ) -> Tours:
        """Return the best tours found.

        Parameters
        ----------
        tours
            Where the search begins; they change.
        scale, share
            Of what tours are worth.
        bound
            Where the longest is no longer than this, the least total is best.
        heat
            Simulated annealing: what may be lost at the beginning; falls to nothing.
        tries, longest_string, seed
            How often, how many streets in a string at most, and the seed.
        """
        random = Random(seed)
        best = tours.copy()
        best_longest, best_total = max(bound, *tours.lengths), sum(tours.lengths)
        for number in range(tries):
            sizes, lengths = tours.sizes[:], tours.lengths[:]
            out: list[int] = []
            strings: list[tuple[int, int, int]] = []
            self._ruin(tours, longest_string, out, strings, random)
            before = [tours.before[street] for street in out]
            behind = [tours.behind[street] for street in out]
            placed: list[int] = []
            whole = True
            for street in self._order(out, random):
                if not self._put_in(tours, scale, share, street, random):
                    whole = False
                    break
                placed.append(street)
            change = 0.0
            for tour in range(len(lengths)):
                now, was = tours.lengths[tour], lengths[tour]
                if now != was:
                    change += worth(now, scale, share) - worth(was, scale, share)
            cooled = 1.0 - number / tries
            if not whole or change > -heat * cooled * cooled * log(1.0 - random.random()):
                self._put_back(tours, placed, out, before, behind, strings)
                tours.sizes, tours.lengths = sizes, lengths
                continue
            longest, total = max(bound, *tours.lengths), sum(tours.lengths)
            if longest < best_longest - _LEAST_GAIN or (
                longest <= best_longest + _LEAST_GAIN and total < best_total - _LEAST_GAIN
            ):
                best_longest, best_total = longest, total
                best = tours.copy()
        return best

    def _centre(self, tours: Tours, random: Random) -> int:
        """Return the street round which to take strings out."""
        on = tours.on
        centre = int(random.random() * len(on))
        if random.random() < _OF_LONGEST:
            longest = tours.lengths.index(max(tours.lengths))
            while on[centre] != longest:
                centre = int(random.random() * len(on))
        return centre

    def _ruin(
        self,
        tours: Tours,
        longest_string: int,
        out: list[int],
        strings: list[tuple[int, int, int]],
        random: Random,
    ) -> None:
        """Take out strings, each from another tour; add streets to `out`, tour and ends to `strings`."""
        wanted = 1 + int(random.random() * _MOST_STRINGS)
        before, behind, on, sizes = tours.before, tours.behind, tours.on, tours.sizes
        for street in self._around[self._centre(tours, random)]:
            tour = on[street]
            if tour < 0 or sizes[tour] == 1:
                continue
            length = 1 + int(random.random() * min(longest_string, sizes[tour] - 1))
            first = street
            for _ in range(int(random.random() * length)):
                first = before[first]
            last = first
            out.append(first)
            for _ in range(length - 1):
                last = behind[last]
                out.append(last)
            self._take_out(tours, tour, first, last)
            sizes[tour] -= length
            strings.append((tour, first, last))
            if len(strings) == wanted:
                return

    def _take_out(self, tours: Tours, tour: int, first: int, last: int) -> None:
        """Take a string out of its tour; its own links stay, so that it can be put back."""
        cost, before, behind = self._cost, tours.before, tours.behind
        away, back = before[first], behind[last]
        street, length = first, 0.0
        while True:
            length += cost[before[street]][street]
            tours.on[street] = -1
            if street == last:
                break
            street = behind[street]
        tours.lengths[tour] += cost[away][back] - cost[last][back] - length
        behind[away], before[back] = back, away

    def _order(self, out: list[int], random: Random) -> list[int]:
        """Return the streets taken out in the order in which to put them in."""
        rule, chosen = random.random(), out[:]
        if rule < _SHUFFLED:
            random.shuffle(chosen)
        elif rule < _FARTHEST_FIRST:
            chosen.sort(key=self._alone, reverse=True)
        return chosen

    def _alone(self, street: int) -> float:
        return self._cost[street][street]

    def _put_in(self, tours: Tours, scale: float, share: float, street: int, random: Random) -> bool:
        """Put a street in where it costs least; return whether there was a place."""
        cost, before, behind, on, lengths = self._cost, tours.before, tours.behind, tours.on, tours.lengths
        from_here = cost[street]
        least, where, more = inf, -1, 0.0
        dearest = inf
        for side in range(2):
            for beside in (self._near_out if side else self._near_in)[street]:
                tour = on[beside]
                if tour < 0:
                    continue
                first = before[beside] if side else beside
                second = behind[first]
                row = cost[first]
                extra = row[street] + from_here[second] - row[second]
                if share * extra >= dearest and extra > 0.0:
                    continue  # what tours are worth grows by no less
                length = lengths[tour]
                price = worth(length + extra, scale, share) - worth(length, scale, share)
                if price < least and random.random() >= _BLINK:
                    least, where, more = price, first, extra
                    dearest = least * scale
        if where < 0:
            return False
        second, tour = behind[where], on[where]
        before[street], behind[street] = where, second
        behind[where] = street
        before[second] = street
        on[street] = tour
        tours.sizes[tour] += 1
        lengths[tour] += more
        return True

    @staticmethod
    def _put_back(
        tours: Tours,
        placed: list[int],
        out: list[int],
        before: list[int],
        behind: list[int],
        strings: list[tuple[int, int, int]],
    ) -> None:
        """Undo a try: take out what was put in, and put the strings back where they were."""
        for street in reversed(placed):
            first, second = tours.before[street], tours.behind[street]
            tours.behind[first], tours.before[second] = second, first
        for k, street in enumerate(out):
            tours.before[street], tours.behind[street] = before[k], behind[k]
        for tour, first, last in reversed(strings):
            tours.behind[tours.before[first]] = first
            tours.before[tours.behind[last]] = last
            street = first
            while True:
                tours.on[street] = tour
                if street == last:
                    break
                street = tours.behind[street]
