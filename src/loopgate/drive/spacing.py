"""How far vehicles are ahead of the middle between their neighbours on their loops: the compiled part."""

from __future__ import annotations

import numpy as np

from loopgate.drive.tables import Floats, Numbers
from loopgate.kernel_cache import kernel

__all__ = ["leads"]


@kernel
def leads(times_s: Floats, laps_s: Floats, begins: Numbers, order: Numbers) -> Floats:
    """Return how far each vehicle is ahead, in units of even spacing.

    Parameters
    ----------
    times_s, laps_s
        Where each is, as time from its loop's beginning, and the time of a lap there [s].
    begins
        Where the vehicles of each loop begin in `order`, and its length.
    order
        The vehicles loop by loop, in any order there, best that of the last time; they are put in order.
    """
    found = np.empty(len(times_s))
    for loop in range(len(begins) - 1):
        begin, end = begins[loop], begins[loop + 1]
        for n in range(begin + 1, end):
            one, k = order[n], n
            while k > begin and (times_s[order[k - 1]], order[k - 1]) > (times_s[one], one):
                order[k] = order[k - 1]
                k -= 1
            order[k] = one
        lap_s = laps_s[order[begin]]
        behind_s = times_s[order[begin]] - times_s[order[end - 1]] + lap_s
        for n in range(begin, end):
            here_s, last = times_s[order[n]], n + 1 == end
            ahead_s = times_s[order[begin if last else n + 1]] - here_s
            if last:
                ahead_s += lap_s
            found[order[n]] = (behind_s - ahead_s) / (2.0 * lap_s / (end - begin))
            behind_s = ahead_s
    return found
