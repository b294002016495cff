"""The radio of a run: over which distances messages go, and how many, of what kind and size."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise
from random import Random
from typing import Any, Generic, TypeVar, cast

from loopgate.simulation.by_messages.whereabouts import DistancesToPosts
from loopgate.vehicles.air import Air, AirSettings
from loopgate.vehicles.messages import (
    Changed,
    Clear,
    Goes,
    Left,
    Message,
    Moved,
    Probe,
    Room,
    ToPost,
    ToVehicle,
)
from loopgate.vehicles.wire import as_json, encode

__all__ = ["Radio"]

E = TypeVar("E")

_SPOT_M = 0.01
"""Antennas nearer to each other than this are at the same spot [m]."""


class Radio(Generic[E]):
    """The channel that carries all messages of a run.

    Parameters
    ----------
    settings
        Settings of the radio channel.
    seed
        Seed of losses and delays.

    Attributes
    ----------
    air
        Messages under way, and timed events.
    sent, sent_bytes
        Number of transmissions and their size as JSON [bytes], by kind.
    cut_off
        Number of messages that the cut of the network stopped.
    far_side
        The places on one side of the cut.
    """

    def __init__(self, settings: AirSettings, seed: int) -> None:
        self.settings = settings
        self.air: Air[Message | E] = Air(settings, Random(f"air {seed}"))
        self.sent: Counter[str] = Counter()
        self.sent_bytes: Counter[str] = Counter()
        self.cut_off = 0
        self.far_side: frozenset[int] = frozenset()

    def over(self, where: DistancesToPosts) -> None:
        """Use `where` for the distances that messages travel."""
        self.where = where

    def _is_cut(self, now_s: float, places: Iterable[int], vehicle: int = -1) -> bool:
        """Return whether the cut separates these places, or a vehicle from them, now."""
        begin_s, lasts_s = self.settings.cut_at_s, self.settings.cut_s
        if not begin_s <= now_s < begin_s + lasts_s:
            return False
        ends = [*places, *([self.where.place(vehicle)] if vehicle >= 0 else [])]
        if len({end in self.far_side for end in ends}) == 1:
            return False
        self.cut_off += 1
        return True

    def say_as(self, number: int, out: Sequence[Message], now_s: float) -> None:
        """Send a vehicle's messages; messages to both posts at a crossing are one transmission.

        Each post hears it or not by itself. A wire joins the two, so that both know what one of them hears.
        """
        together: list[list[Message]] = []
        for message in out:
            if together and _is_of_one(together[-1][-1], message):
                together[-1].append(message)
            else:
                together.append([message])
        for one in together:
            comes = []
            for at, message in enumerate(one):
                place = cast("ToPost", message).place
                stretches_m = [self.where.to_m(number, place)]
                if isinstance(message, Left) and stretches_m[0] > self.settings.range_m:
                    stretches_m = self.where.back_to_m(number, place)
                self._count(message, len(stretches_m), again=at > 0)
                if not self._is_cut(now_s, [place], number):
                    comes.append((message, stretches_m))
            self.air.send_together(now_s, comes)

    def say_from(self, place: int, message: Message, now_s: float) -> None:
        """Send a message of a post."""
        places, vehicle = [place], -1
        if isinstance(message, Probe):
            stretches_m, places = [self.where.over_m[place, message.place]], [place, message.place]
        elif isinstance(message, Clear | Changed):
            back = list(reversed(list(pairwise(message.path))))
            stretches_m, places = [self.where.over_m[pair] for pair in back], [place, *message.path]
        else:
            vehicle = cast("ToVehicle", message).vehicle
            stretches_m = [self.where.to_m(vehicle, place)]
            if isinstance(message, Room) and stretches_m[0] > self.settings.range_m:
                stretches_m = self.where.back_to_m(vehicle, place)[::-1]
        self._count(message, len(stretches_m))
        if not self._is_cut(now_s, places, vehicle):
            self.air.send(now_s, message, stretches_m)

    def say(
        self,
        message: Any,  # noqa: ANN401  of either protocol
        stretches_m: Sequence[float],
        now_s: float,
        places: Sequence[int],
        vehicle: int = -1,
    ) -> None:
        """Send a message over these distances, between these places, and to or from a vehicle.

        A wire joins antennas at the same spot: it takes no transmission and loses nothing.
        """
        apart = [far_m for far_m in stretches_m if far_m > _SPOT_M]
        self._count(message, len(apart))
        if not self._is_cut(now_s, places, vehicle):
            self.air.send(now_s, message, apart)

    def overhear(self, place: int, number: int, event: E, now_s: float) -> None:
        """Let vehicle `number` hear an event that the post of a place sends to another vehicle."""
        if not self._is_cut(now_s, [place], number):
            self.air.send(now_s, event, [self.where.to_m(number, place)])

    def _count(self, message: Message, times: int, *, again: bool = False) -> None:
        """Count a message that is sent so many times, or that is the second half of a transmission."""
        kind = type(message).__name__
        self.sent[kind] += 0 if again else times
        self.sent_bytes[kind] += times * len(as_json(encode(message)))

    def report(self, moves: int) -> dict[str, Any]:
        """Return the figures of the messages."""
        sent = {kind.lower(): many for kind, many in sorted(self.sent.items()) if many}
        sizes = {kind.lower(): many for kind, many in sorted(self.sent_bytes.items())}
        return {
            "range_m": self.settings.range_m,
            "loss": self.settings.loss,
            "delay_s": self.settings.delay_s,
            "moves": moves,
            "messages": sum(sent.values()),
            "per_move": round(sum(sent.values()) / max(1, moves), 3),
            "by_kind": sent,
            "bytes": sum(sizes.values()),
            "bytes_per_move": round(sum(sizes.values()) / max(1, moves), 1),
            "bytes_by_kind": sizes,
            "lost": self.air.lost,
            "too_far": self.air.beyond,
            "cut_off": self.cut_off,
            "longest_m": round(self.air.longest_m, 1),
        }


def _is_of_one(before: Message, message: Message) -> bool:
    """Return whether two messages are halves of one transmission."""
    if isinstance(message, Moved):
        return isinstance(before, Goes)
    return isinstance(message, Goes) and isinstance(before, Left)
