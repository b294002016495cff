"""Quantiles of a stream in constant memory."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

__all__ = ["Histogram"]

_PER_DECADE = 100
_DECADES = 10
_LOWEST = 1e-2
_BATCH = 4096


class Histogram:
    """Counts of positive numbers in logarithmic classes 2.3 % wide, from 0.01 up to 1e8.

    Meant for microseconds; quantiles are exact to the class, the maximum is exact.

    Parameters
    ----------
    parts
        What these have counted counts as well.
    """

    def __init__(self, parts: Iterable[Histogram] = ()) -> None:
        self._counts = np.zeros(_PER_DECADE * _DECADES + 1, dtype=np.int64)
        self._recent: list[float] = []
        self._total = 0.0
        self._max = 0.0
        for part in parts:
            self._counts += part.counts
            self._total += part.total
            self._max = max(self._max, part.max)

    def add(self, value: float, *, times: int = 1) -> None:
        """Count `value`, as often as `times` says."""
        self._recent += [value] * times
        if len(self._recent) >= _BATCH:
            self._sort_in()

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many numbers there are in each class."""
        self._sort_in()
        return self._counts

    @property
    def count(self) -> int:
        """How many numbers were counted."""
        return int(self._counts.sum()) + len(self._recent)

    @property
    def total(self) -> float:
        """Their sum."""
        self._sort_in()
        return self._total

    @property
    def max(self) -> float:
        """The largest of them; 0 if nothing was counted."""
        self._sort_in()
        return self._max

    def quantile(self, q: float) -> float:
        """Return the `q`-quantile, ``0 <= q <= 1``; 0 if nothing was counted."""
        self._sort_in()
        if not self._counts.any():
            return 0.0
        rank = max(1, math.ceil(q * self.count))
        index = int(np.searchsorted(np.cumsum(self._counts), rank))
        return min(self._max, _LOWEST * 10 ** ((index + 0.5) / _PER_DECADE))

    def summary(self) -> dict[str, float]:
        """Return ``median``, ``p99`` and ``max``."""
        return {
            "median": round(self.quantile(0.5), 3),
            "p99": round(self.quantile(0.99), 3),
            "max": round(self.max, 3),
        }

    def _sort_in(self) -> None:
        if not self._recent:
            return
        values = np.array(self._recent)
        self._recent.clear()
        self._total += float(values.sum())
        self._max = max(self._max, float(values.max()))
        classes = (np.log10(np.maximum(values, _LOWEST) / _LOWEST) * _PER_DECADE).astype(np.int64)
        np.add.at(self._counts, np.minimum(classes, _PER_DECADE * _DECADES), 1)
