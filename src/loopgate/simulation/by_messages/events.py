"""What comes at a time of its own, without the air."""

from __future__ import annotations

from typing import NamedTuple

from loopgate.vehicles.post import Kept

__all__ = ["Again", "Mind", "Patience"]


class Patience(NamedTuple):
    """The end of a post's patience with a slot that is kept."""

    place: int
    kept: Kept


class Mind(NamedTuple):
    """Something comes to a vehicle's mind: that it heard of room, or that no post has answered it."""

    number: int
    heard: bool


class Again(NamedTuple):
    """The end of a vehicle's patience with what it asked at this time [s]."""

    number: int
    asked_s: float
