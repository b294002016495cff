"""Events that a vehicle or a post sets for a later time, as the end of a wait; they are not messages."""

from __future__ import annotations

from typing import NamedTuple

from loopgate.vehicles.post import Kept

__all__ = ["Again", "Heard", "Mind", "Patience"]


class Patience(NamedTuple):
    """A post's wait for a vehicle for which it keeps a slot is over."""

    place: int
    kept: Kept


class Mind(NamedTuple):
    """A reminder to a vehicle: it has heard of a free slot (`heard`), or no post has answered it."""

    number: int
    heard: bool


class Heard(NamedTuple):
    """A vehicle overhears how many vehicles a place has."""

    number: int
    place: int
    there: int


class Again(NamedTuple):
    """The wait of a vehicle for an answer to its request of `asked_s` [s] is over."""

    number: int
    asked_s: float
