"""Decides which ready vehicle asks first: pressure, computed from what each vehicle has heard."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from random import Random

from loopgate.negotiation.formulas import pressure
from loopgate.simulation.by_messages.motor import Motor
from loopgate.vehicles.keeper import Way
from loopgate.vehicles.post import Post

__all__ = ["Turns"]


class Turns:
    """The order in which ready vehicles ask.

    Parameters
    ----------
    motor
        Knows each vehicle's place, and since when it wants to go on.
    posts
        The posts, by place; vehicles know their numbers of slots.
    conflicts
        For each place, the pairs of ways over the crossing before it that exclude each other.
    loss
        Share of transmissions that are not heard.
    lots
        Random numbers that choose these transmissions.
    """

    def __init__(
        self,
        motor: Motor,
        posts: Sequence[Post],
        conflicts: Mapping[int, frozenset[tuple[Way, Way]]],
        loss: float,
        lots: Random,
    ) -> None:
        self._motor, self._conflicts = motor, conflicts
        self._slots = [post.slots for post in posts]
        self._heard: dict[tuple[int, int], int] = {}
        """For a vehicle and a place, how many vehicles were there when the vehicle last heard of it."""
        self._loss, self._lots = loss, lots

    def way(self, number: int) -> Way:
        """Return the way over its crossing that a vehicle wants."""
        return self._motor.where.place(number), self._motor.where.wanted(number)

    def hears(self, way: Way, asked: Iterable[Way]) -> bool:
        """Return whether a vehicle that wants `way` hears a request for the same place or in conflict."""
        conflicts = self._conflicts[way[1]]
        near = (other[1] == way[1] or (way, other) in conflicts for other in asked)
        return any(one and not self._deaf() for one in near)

    def pressure(self, number: int, now_s: float) -> float:
        """Return the pressure of a vehicle, by shares of slots and its wait."""
        ahead, here = self.shares(number)
        return pressure(here, ahead, now_s - self._motor.since_s(number))

    def shares(self, number: int) -> tuple[float, float]:
        """Return the shares of slots taken in the place that a vehicle wants and in its own, as heard."""
        here, ahead = (self._heard.get((number, place), 0) / self._slots[place] for place in self.way(number))
        return ahead, here

    def hears_of(self, number: int, place: int, there: int) -> None:
        """Note how many vehicles are in a place, as a vehicle has heard its post say."""
        self._heard[number, place] = there

    def _deaf(self) -> bool:
        return bool(self._loss) and self._lots.random() < self._loss
