"""A cache of results that a process needs several times, such as networks, loops and layouts."""

import gc
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Generic, TypeVar

T = TypeVar("T")


class Cache(Generic[T]):
    """The last few results of a costly function, by their arguments.

    Keys hold contents (hashes of files, values of options), never names of files: what a key stands for
    cannot change. Results are shared, so nobody may change them.

    `most`: how many results are kept; the one not asked for longest goes first.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._results: OrderedDict[Hashable, T] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the result for a key; call `make` if it is not in the cache. Errors are not kept."""
        found = self._results.pop(key) if key in self._results else make()
        self._results[key] = found
        while len(self._results) > self._most:
            self._results.popitem(last=False)
        return found


@contextmanager
def without_collection() -> Iterator[None]:
    """Let Python's collector rest while millions of objects are made that all stay: it halves the time."""
    resting = not gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if not resting:
            gc.enable()


@contextmanager
def frozen_objects() -> Iterator[None]:
    """Let Python's collector pass over all objects that exist: it would look through them again and again."""
    own = gc.get_freeze_count() == 0
    if own:
        gc.freeze()
    try:
        yield
    finally:
        if own:
            gc.unfreeze()
