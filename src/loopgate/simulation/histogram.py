"""Quantiles of a stream in constant memory."""

from __future__ import annotations

import math

__all__ = ["Histogram"]

_PER_DECADE = 100
_DECADES = 10
_LOWEST = 1e-2


class Histogram:
    """Counts of positive numbers in logarithmic classes 2.3 % wide, from 0.01 up to 1e8.

    Meant for microseconds; quantiles are exact to the class, the maximum is exact.
    """

    def __init__(self) -> None:
        self._counts = [0] * (_PER_DECADE * _DECADES + 1)
        self.count = 0
        self.total = 0.0
        self.max = 0.0

    def add(self, value: float) -> None:
        """Count `value`."""
        self.count += 1
        self.total += value
        self.max = max(self.max, value)
        index = int(math.log10(max(value, _LOWEST) / _LOWEST) * _PER_DECADE)
        self._counts[min(index, _PER_DECADE * _DECADES)] += 1

    def quantile(self, q: float) -> float:
        """Return the `q`-quantile, ``0 <= q <= 1``; 0 if nothing was counted."""
        rank = math.ceil(q * self.count)
        seen = 0
        for index, count in enumerate(self._counts):
            seen += count
            if count and seen >= rank:
                return min(self.max, _LOWEST * 10 ** ((index + 0.5) / _PER_DECADE))
        return 0.0

    def summary(self) -> dict[str, float]:
        """Return ``median``, ``p99`` and ``max``."""
        return {
            "median": round(self.quantile(0.5), 3),
            "p99": round(self.quantile(0.99), 3),
            "max": round(self.max, 3),
        }
