"""Searches for several closed tours whose longest is short: large-neighbourhood search in rounds."""

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.network.cover.ruin import POWER, StreetMover, Tours, worth
from loopgate.network.cover.tours import assigned, cut_in_two, split

ROUNDS, _IDLE = 16, 4
_MOVES, _MOVES_OF_EACH, _MOVES_OF_ALL = 150_000, 500, 200_000_000
_PAIRS, _PAIR_CELLS = 150, 5_000_000
"""Effort of each round: moves of each street (fewer with many streets), and pairs of tours that are made
again (fewer with large tours). The search ends after `_IDLE` rounds without a gain."""

_SHARE, _SHARE_AT_BOUND = 0.3, 3.0
"""Share of the total in what tours are worth, in units of the longest."""

_HEAT, _MOST_HEAT, _PAIR_HEAT = 27.0, 0.3, 0.003
"""Tolerance for worse tours when streets move, by a street's share of a tour and at most; and for pairs."""

_NEAR, _AROUND = 25, 60
_STRING = 10, 20
_LONGEST_FIRST, _NEAREST = 0.4, 0.35
_NOISE = (0.0, 0.02, 0.02, 0.1, 0.1, 0.3, 0.3)
_AT_BOUND = 0.04
"""A longest tour within this of the bound is short enough: then the total length is reduced."""

_FEWEST = 3
"""With fewer tours than this, no tour is given up."""


@dataclass(frozen=True, slots=True)
class TourPlan:
    """Closed tours through required streets, given by their rank, with the lengths of the tours."""

    tours: tuple[Ints, ...]
    lengths: tuple[float, ...]

    @property
    def longest(self) -> float:
        """Length of the longest tour."""
        return max(self.lengths)

    @property
    def total(self) -> float:
        """Length of all tours."""
        return sum(self.lengths)


def search(cost: Floats, tours: Sequence[Ints], count: int, bound: float, *, seed: int) -> Iterator[TourPlan]:
    """Yield better and better plans, `ROUNDS` + 1 in all; the last plan is the best.

    The search begins by cutting one tour through all streets; several given tours are improved, in half as
    many rounds. In each round strings of streets are moved between tours, and pairs of tours are made again:
    the cheapest assignment over both, joined to one tour and cut in two.

    Parameters
    ----------
    cost
        Between streets, shape (n, n); on the diagonal the closed walk through one street alone.
    tours
        Tours through all streets: one, or the result of an earlier search.
    count
        Number of tours; at most one for each street.
    bound
        Lower bound on the longest tour: near it, the total length is reduced.
    seed
        Seed of the search; the same seed gives the same tours.
    """
    best = _plan(cost, tours) if len(tours) > 1 else _begin(cost, tours[0], count, bound)
    yield best
    rng = np.random.default_rng(seed)
    moving = _searching(cost)
    warmth = min(_HEAT * len(best.tours) / len(cost), _MOST_HEAT)
    idle = 0
    for number in range(ROUNDS // 2 if len(tours) > 1 else 0, ROUNDS):
        heat = 1.0 - number / ROUNDS
        now = _given_up(cost, best, bound) if number % 2 else best
        now = _moved(cost, moving, now, bound, warmth * heat, int(rng.integers(2**31)))
        if len(best.tours) > 1:
            now = _paired(cost, now, bound, _PAIR_HEAT * heat, rng)
        idle = 0 if _better(now, best, bound) else idle + 1
        best = best if idle else now
        yield best
        if idle == _IDLE:
            return


def _length(cost: Floats, tour: Ints) -> float:
    return float(cost[tour, np.roll(tour, -1)].sum())


def _plan(cost: Floats, tours: Sequence[Ints]) -> TourPlan:
    return TourPlan(tuple(tours), tuple(_length(cost, tour) for tour in tours))


def _begin(cost: Floats, tour: Ints, count: int, bound: float) -> TourPlan:
    tours = split(cost, tour, count, bound)
    while len(tours) < min(count, len(cost)):
        tours.sort(key=lambda t: (len(t) > 1, _length(cost, t)))
        tours += cut_in_two(cost, tours.pop(), 2, bound)
    return _plan(cost, tours)


def _searching(cost: Floats) -> StreetMover:
    """Return the search that moves streets, with the neighbours of each street."""
    far = cost.copy()
    np.fill_diagonal(far, np.inf)
    either = np.minimum(far, far.T)
    np.fill_diagonal(either, -1.0)
    some = min(_NEAR, len(cost) - 1)
    rows = [array("d", row.tolist()) for row in cost]
    return StreetMover(rows, _nearest_of(far.T, some), _nearest_of(far, some), _nearest_of(either, _AROUND))


def _nearest_of(rows: Floats, count: int) -> list[list[int]]:
    """Return the columns of the least values of each row, in ascending order."""
    return [np.argsort(row, kind="stable")[:count].tolist() for row in rows]


def _better(one: TourPlan, other: TourPlan, bound: float) -> bool:
    least = bound * (1.0 + _AT_BOUND)
    return (max(one.longest, least), one.total) < (max(other.longest, least), other.total)


def _moved(
    cost: Floats, moving: StreetMover, plan: TourPlan, bound: float, heat: float, seed: int
) -> TourPlan:
    before, behind, on = ([0] * len(cost) for _ in range(3))
    for number, tour in enumerate(plan.tours):
        order = tour.tolist()
        for here, following in zip(order, order[1:] + order[:1], strict=True):
            on[here], behind[here], before[following] = number, following, here
    tours = Tours(before, behind, on, [len(tour) for tour in plan.tours], list(plan.lengths))
    string = min(max(len(cost) // len(plan.tours) // 2, _STRING[0]), _STRING[1])
    least = bound * (1.0 + _AT_BOUND)
    made = moving.rebuild(
        tours,
        plan.longest,
        _SHARE if plan.longest > least else _SHARE_AT_BOUND,
        least,
        heat,
        min(max(_MOVES, _MOVES_OF_ALL // len(cost)), _MOVES_OF_EACH * len(cost)) // string,
        string,
        seed,
    )
    return _plan(cost, [np.array(order) for order in made.orders()])


def _given_up(cost: Floats, plan: TourPlan, bound: float) -> TourPlan:
    """Return a plan in which the shortest tour is divided among others, and the longest is cut in two.

    Strings move between neighbours only, so a tour with few streets near it would stay short.
    """
    longest = plan.tours[int(np.argmax(plan.lengths))]
    if len(plan.tours) < _FEWEST or len(longest) == 1 or plan.longest <= bound * (1.0 + _AT_BOUND):
        return plan
    order = np.argsort(plan.lengths).tolist()
    tours = [plan.tours[k] for k in order[1:-1]]
    lengths = np.array([plan.lengths[k] for k in order[1:-1]])
    for street in plan.tours[order[0]].tolist():
        extra = [
            cost[tour, street] + cost[street, np.roll(tour, -1)] - cost[tour, np.roll(tour, -1)]
            for tour in tours
        ]
        least = np.array([more.min() for more in extra])
        on = int(np.argmin(_worths(lengths + least, plan.longest) - _worths(lengths, plan.longest)))
        tours[on] = np.insert(tours[on], int(extra[on].argmin()) + 1, street)
        lengths[on] += least[on]
    return _plan(cost, [*tours, *cut_in_two(cost, longest, POWER, plan.longest)])


def _worths(lengths: Floats, scale: float) -> Floats:
    return np.array([worth(length, scale, _SHARE) for length in lengths])


def _paired(cost: Floats, plan: TourPlan, bound: float, heat: float, rng: np.random.Generator) -> TourPlan:
    tours, lengths, best = list(plan.tours), list(plan.lengths), plan
    scale = plan.longest

    size = 2 * len(cost) / len(tours)
    for _ in range(int(min(_PAIRS, len(cost), max(_PAIR_CELLS / size**2, 2)))):
        one = int(np.argmax(lengths)) if rng.random() < _LONGEST_FIRST else int(rng.integers(len(tours)))
        near = _nearest(cost, tours, one)
        other = near[min(int(rng.geometric(_NEAREST)) - 1, len(near) - 1)]
        made = _remade(
            cost, np.concatenate((tours[one], tours[other])), scale, float(rng.choice(_NOISE)), rng
        )
        after = np.array([_length(cost, t) for t in made])
        change = float(
            _worths(after, scale).sum() - _worths(np.array([lengths[one], lengths[other]]), scale).sum()
        )
        if change < 0.0 or rng.random() < math.exp(-change / heat):
            for number, tour in zip((one, other), made, strict=True):
                tours[number], lengths[number] = tour, _length(cost, tour)
            now = TourPlan(tuple(tours), tuple(lengths))
            best = now if _better(now, best, bound) else best
    return best


def _nearest(cost: Floats, tours: Sequence[Ints], one: int) -> list[int]:
    """Return the other tours, the nearest first, by the way there and back."""
    away, back = cost[tours[one]].min(axis=0), cost[:, tours[one]].min(axis=1)
    apart = [float(away[tour].min() + back[tour].min()) for tour in tours]
    return sorted((k for k in range(len(tours)) if k != one), key=lambda k: (apart[k], k))


def _remade(cost: Floats, both: Ints, scale: float, noise: float, rng: np.random.Generator) -> list[Ints]:
    """Return two tours made from the streets of two tours, by an assignment with randomised costs."""
    between = cost[np.ix_(both, both)]
    tour = assigned(between * (1.0 + noise * rng.random(between.shape)))
    found = []
    for piece in cut_in_two(between, tour, POWER, scale):
        again = piece[assigned(between[np.ix_(piece, piece)])]
        found.append(both[min(piece, again, key=lambda t: _length(between, t))])
    return found
