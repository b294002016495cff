"""The set of visited configurations: open addressing over 64-bit words, flags in the words' high bits.

A word is the configuration's key plus one (so that an empty slot is 0) with flags above bit 58. Compiled.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["KEY_PART", "LIVE", "VISITED", "find", "has_flag", "insert", "moved_over", "new_table", "set_flag"]

KEY_PART: Final = np.uint64((1 << 58) - 1)
LIVE: Final = np.uint64(1 << 63)
VISITED: Final = np.uint64(1 << 62)

_MIX: Final = np.uint64(0x9E3779B97F4A7C15)
_HALF: Final = np.uint64(32)
_ONE: Final = np.uint64(1)
_NONE: Final = np.uint64(0)


def new_table(log2_slots: int) -> NDArray[np.uint64]:
    """Return an empty table of ``2 ** log2_slots`` slots."""
    return np.zeros(1 << log2_slots, np.uint64)


@njit(cache=True, inline="always")
def _slot(table: NDArray[np.uint64], key: np.uint64) -> np.uint64:
    """Return the slot of `key`, or the empty slot where it belongs."""
    last = np.uint64(table.size - 1)
    mixed = key * _MIX
    slot = (mixed ^ (mixed >> _HALF)) * _MIX >> _HALF & last
    word = key + _ONE
    while table[slot] != _NONE and table[slot] & KEY_PART != word:
        slot = (slot + _ONE) & last
    return slot


@njit(cache=True, inline="always")
def insert(table: NDArray[np.uint64], key: np.uint64, flags: np.uint64) -> bool:
    """Put `key` into the table with `flags`; return whether it was not there. The table must have room."""
    slot = _slot(table, key)
    if table[slot] != _NONE:
        return False
    table[slot] = (key + _ONE) | flags
    return True


@njit(cache=True, inline="always")
def set_flag(table: NDArray[np.uint64], key: np.uint64, flag: np.uint64) -> bool:
    """Set `flag` of `key`; return whether the key is there and did not have it."""
    slot = _slot(table, key)
    if table[slot] == _NONE or table[slot] & flag:
        return False
    table[slot] |= flag
    return True


@njit(cache=True, inline="always")
def has_flag(table: NDArray[np.uint64], key: np.uint64, flag: np.uint64) -> bool:
    """Return whether `key` is in the table with `flag`."""
    return bool(table[_slot(table, key)] & flag)


@njit(cache=True)
def find(table: NDArray[np.uint64], key: np.uint64) -> bool:
    """Return whether `key` is in the table."""
    return bool(table[_slot(table, key)] != _NONE)


@njit(cache=True)
def moved_over(old: NDArray[np.uint64], new: NDArray[np.uint64]) -> None:
    """Put all words of `old` into `new`, a larger empty table."""
    for word in old:
        if word != _NONE:
            new[_slot(new, (word & KEY_PART) - _ONE)] = word
