"""Ruin and recreate, compiled: take streets out of neighbouring tours and insert them where they cost least.

Schrimpf, Schneider, Stamm-Wilbrandt, Dueck, "Record breaking optimization results using the ruin and recreate
principle", J. Comput. Phys. 159, 2000; the strings are those of Christiaens and Vanden Berghe, "Slack
induction by string removals for vehicle routing problems", Transp. Sci. 54, 2020.
"""

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.kernel_cache import kernel

_MOST_STRINGS = 3
_OF_LONGEST = 0.3
_SHUFFLED, _FARTHEST_FIRST = 0.5, 0.8
_BLINK = 0.01
"""So often streets are taken from the longest tour; put in in random order, the farthest first, or else in
order of removal; and so often a place to put one in is overlooked."""

_LEAST_GAIN = 1e-6

POWER = 12
"""A tour of length x is worth ``x**POWER + share * x``, in units of a scale."""


@kernel
def worth(length: float, scale: float, share: float) -> float:
    """Return the cost of a tour; less is better."""
    x = length / scale
    return float(x**POWER + share * x)


@kernel
def nearest(rows: Floats, count: int) -> Ints:
    """Return the columns of the least values of each row, in ascending order."""
    size = len(rows)
    found = np.empty((size, count), np.int64)
    for row in range(size):
        values, least = rows[row], found[row]
        held = 0
        for place in range(rows.shape[1] if count else 0):
            if held == count and values[place] >= values[least[count - 1]]:
                continue
            at = min(held, count - 1)
            while at > 0 and values[least[at - 1]] > values[place]:
                least[at] = least[at - 1]
                at -= 1
            least[at] = place
            held = min(held + 1, count)
    return found


@kernel
def _begin_at(on: Ints, lengths: Floats) -> int:
    """Return the street round which to take strings out."""
    centre = np.random.randint(len(on))
    if np.random.random() < _OF_LONGEST:
        longest = np.argmax(lengths)
        while on[centre] != longest:
            centre = np.random.randint(len(on))
    return centre


@kernel
def _take_out(cost: Floats, links: Ints, on: Ints, tour: int, first: int, last: int, lengths: Floats) -> None:
    """Take a string out of its tour; its own links stay, so that it can be put back."""
    before, behind = links[0, first], links[1, last]
    street = first
    while True:
        lengths[tour] -= cost[links[0, street], street]
        on[street] = -1
        if street == last:
            break
        street = links[1, street]
    lengths[tour] += cost[before, behind] - cost[last, behind]
    links[1, before], links[0, behind] = behind, before


@kernel
def _ruin(
    cost: Floats,
    around: Ints,
    state: tuple[Ints, Ints, Ints, Floats],
    longest_string: int,
    out: Ints,
    strings: Ints,
) -> tuple[int, int]:
    """Take out strings; return how many streets and how many strings."""
    links, on, sizes, lengths = state
    centre = _begin_at(on, lengths)
    wanted = 1 + np.random.randint(_MOST_STRINGS)
    streets = count = 0
    for street in around[centre]:
        tour = on[street]
        if tour < 0 or sizes[tour] == 1:
            continue
        length = 1 + np.random.randint(min(longest_string, sizes[tour] - 1))
        first = street
        for _ in range(np.random.randint(length)):
            first = links[0, first]
        last = first
        out[streets] = first
        for k in range(1, length):
            last = links[1, last]
            out[streets + k] = last
        _take_out(cost, links, on, tour, first, last, lengths)
        sizes[tour] -= length
        strings[count, 0], strings[count, 1], strings[count, 2] = tour, first, last
        streets += length
        count += 1
        if count == wanted:
            break
    return streets, count


@kernel
def _order(cost: Floats, out: Ints, count: int) -> Ints:
    """Return the streets taken out in the order in which to put them in."""
    rule = np.random.random()
    chosen = out[:count].copy()
    if rule < _SHUFFLED:
        np.random.shuffle(chosen)
    elif rule < _FARTHEST_FIRST:
        keys = np.empty(count)
        for k in range(count):
            keys[k] = -cost[chosen[k], chosen[k]]
        chosen = chosen[np.argsort(keys)]
    return chosen


@kernel
def _put_in(
    cost: Floats,
    near: Ints,
    state: tuple[Ints, Ints, Ints, Floats],
    scale: float,
    share: float,
    street: int,
) -> bool:
    """Put a street in where it costs least; return whether there was a place."""
    links, on, sizes, lengths = state
    least, where, more = np.inf, -1, 0.0
    for side in range(2):
        for beside in near[side, street]:
            tour = on[beside]
            if tour < 0:
                continue
            before = beside if side == 0 else links[0, beside]
            behind = links[1, before]
            extra = cost[before, street] + cost[street, behind] - cost[before, behind]
            if extra > 0.0 and share * extra >= least * scale:
                continue  # what tours are worth grows by no less
            price = worth(lengths[tour] + extra, scale, share) - worth(lengths[tour], scale, share)
            if price < least and np.random.random() >= _BLINK:
                least, where, more = price, before, extra
    if where < 0:
        return False
    behind, tour = links[1, where], on[where]
    links[0, street], links[1, street] = where, behind
    links[1, where] = links[0, behind] = street
    on[street] = tour
    sizes[tour] += 1
    lengths[tour] += more
    return True


@kernel
def rebuild(
    cost: Floats,
    near: Ints,
    around: Ints,
    state: tuple[Ints, Ints, Ints, Floats],
    scale: float,
    share: float,
    bound: float,
    heat: float,
    tries: int,
    longest_string: int,
    seed: int,
) -> tuple[Ints, Ints, Ints, Floats]:
    """Take streets out of tours and insert them again, many times; return the best tours found.

    Parameters
    ----------
    cost
        Between streets, shape (n, n); on the diagonal the closed walk through one alone.
    near
        Shape (2, n, k): the streets from which each is near, and those that are near from it.
    around
        Shape (n, k): the streets around each, itself first.
    state
        Links (before and behind each street, shape (2, n)), the tour it is on, and the number of streets on
        and the length of each tour. Overwritten.
    scale, share
        Of what tours are worth.
    bound
        Where the longest is no longer than this, the least total is best.
    heat
        Simulated annealing: what may be lost at the beginning; falls to nothing.
    tries, longest_string, seed
        How often, how many streets in a string at most, and the seed.
    """
    np.random.seed(seed)
    links, on, sizes, lengths = state
    best = links.copy(), on.copy(), sizes.copy(), lengths.copy()
    best_longest, best_total = max(lengths.max(), bound), lengths.sum()
    out = np.empty(_MOST_STRINGS * longest_string, np.int64)
    strings = np.empty((_MOST_STRINGS, 3), np.int64)
    kept_sizes, kept_lengths = sizes.copy(), lengths.copy()
    for number in range(tries):
        kept_sizes[:], kept_lengths[:] = sizes, lengths
        count, cut = _ruin(cost, around, state, longest_string, out, strings)
        inside = links[:, out[:count]].copy()
        placed, done = _order(cost, out, count), 0
        while done < count and _put_in(cost, near, state, scale, share, placed[done]):
            done += 1
        change = 0.0
        for tour in range(len(lengths)):
            if lengths[tour] != kept_lengths[tour]:
                change += worth(lengths[tour], scale, share) - worth(kept_lengths[tour], scale, share)
        limit = -heat * (1.0 - number / tries) ** 2 * np.log(1.0 - np.random.random())
        if done < count or change > limit:
            for k in range(done - 1, -1, -1):
                a, b = links[0, placed[k]], links[1, placed[k]]
                links[1, a], links[0, b] = b, a
            for k in range(count):
                links[0, out[k]], links[1, out[k]] = inside[0, k], inside[1, k]
            for k in range(cut - 1, -1, -1):
                tour, first, last = strings[k]
                links[1, links[0, first]], links[0, links[1, last]] = first, last
                street = first
                while True:
                    on[street] = tour
                    if street == last:
                        break
                    street = links[1, street]
            sizes[:], lengths[:] = kept_sizes, kept_lengths
            continue
        longest, total = max(lengths.max(), bound), lengths.sum()
        if longest < best_longest - _LEAST_GAIN or (
            longest <= best_longest + _LEAST_GAIN and total < best_total - _LEAST_GAIN
        ):
            best_longest, best_total = longest, total
            best[0][:], best[1][:], best[2][:], best[3][:] = links, on, sizes, lengths
    return best
