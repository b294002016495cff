"""Simulated radio: range, loss and delay of messages, and the messages under way."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from random import Random
from typing import Any, Generic, TypeVar

from loopgate.errors import ScenarioError
from loopgate.reading import shown

M = TypeVar("M")

CENTRAL, VEHICLES, PROCESSES = "central", "vehicles", "processes"
_LONGEST_S, _FARTHEST_M, _FARTHEST_S = 60.0, 1e6, 1e6


@dataclass(frozen=True, slots=True)
class AirSettings:
    """Range, loss and delay of radio messages.

    Attributes
    ----------
    range_m
        Range of a transmission [m].
    loss
        Share of transmissions that are lost, from 0 to below 1.
    delay_s
        Mean time that a transmission takes [s]; each takes from half to one and a half of it, at random.
    cut_at_s, cut_s
        Time at which the network is cut in two, and duration of the cut [s].
    processes
        Whether the controllers of vehicles are processes of their own.
    kill, kill_at_s, again_s
        Number of controller processes to kill, time of the kill [s], and time until a restart [s].
    """

    range_m: float = 150.0
    loss: float = 0.0
    delay_s: float = 0.1
    cut_at_s: float = 0.0
    cut_s: float = 0.0
    processes: bool = False
    kill: int = 0
    kill_at_s: float = 0.0
    again_s: float = 30.0


_OPTIONS = {
    "range": (1.0, _FARTHEST_M, "range_m", "metres, from 1 to 1e6"),
    "loss": (0.0, 0.95, "loss", "a share from 0 to 0.95"),
    "delay": (0.0, _LONGEST_S, "delay_s", "seconds, from 0 to 60"),
    "cut": (0.0, _FARTHEST_S, "cut_s", "seconds, from 0 to 1e6"),
    "cut_at": (0.0, _FARTHEST_S, "cut_at_s", "seconds, from 0 to 1e6"),
}
_OF_PROCESSES = {
    "kill": (0.0, _FARTHEST_S, "kill", "a whole number of vehicles, from 0 to 1e6"),
    "kill_at": (0.0, _FARTHEST_S, "kill_at_s", "seconds, from 0 to 1e6"),
    "again": (0.0, _FARTHEST_S, "again_s", "seconds, from 0 to 1e6"),
}


def read_decide(spec: str) -> AirSettings | None:
    """Return the radio settings of a text like ``vehicles:range=150,loss=0.1``; None for ``central``.

    ``processes`` has the same options, and some of its own.

    Raises
    ------
    ScenarioError
        If it is neither, or an option is unknown or has no such value.

    Examples
    --------
    >>> read_decide("vehicles:loss=0.1").loss
    0.1
    """
    if spec == CENTRAL:
        return None
    name, colon, rest = spec.partition(":")
    if name not in {VEHICLES, PROCESSES}:
        expected = f"{CENTRAL}, {VEHICLES}:range=150,loss=0.1,delay=0.2, or {PROCESSES}"
        msg = f"decide is {shown(spec)}; expected {expected}"
        raise ScenarioError(msg)
    options = _OPTIONS | (_OF_PROCESSES if name == PROCESSES else {})
    values: dict[str, Any] = {"processes": name == PROCESSES}
    for part in rest.split(",") if colon else ():
        option, _, text = part.partition("=")
        if option not in options:
            msg = f"decide {name}: unknown option {shown(option)}; its options are {', '.join(options)}"
            raise ScenarioError(msg)
        least, most, field, expected = options[option]
        try:
            value = float(text)
        except ValueError:
            value = inf
        whole = field != "kill" or value.is_integer()
        if not isfinite(value) or not least <= value <= most or not whole:
            msg = f"decide {name}: {option} is {shown(text)}; expected {expected}"
            raise ScenarioError(msg)
        values[field] = int(value) if field == "kill" else value
    return AirSettings(**values)


class Air(Generic[M]):
    """Simulated radio: the messages under way.

    Parameters
    ----------
    settings
        Range, loss and delay.
    rng
        Source of randomness for losses and delays.

    Attributes
    ----------
    transmissions
        Number of transmissions, counted for each stretch.
    lost, beyond
        Number of transmissions lost at random, and of transmissions over a stretch longer than the range.
    longest_m
        The longest stretch over which a message was heard [m].
    """

    def __init__(self, settings: AirSettings, rng: Random) -> None:
        self.settings = settings
        self._rng = rng
        self._under_way: list[tuple[float, int, M]] = []
        self.transmissions = self.lost = self.beyond = 0
        self.longest_m = 0.0
        self._sent = 0

    def send(self, now_s: float, message: M, stretches_m: Sequence[float]) -> None:
        """Send a message over several radio stretches; it arrives unless one of them loses it."""
        self.send_together(now_s, [(message, stretches_m)])

    def send_together(self, now_s: float, messages: Sequence[tuple[M, Sequence[float]]]) -> None:
        """Send messages in one transmission to receivers joined by wire: if one hears it, all get it."""
        comes_s = [self._comes_s(now_s, stretches_m) for _, stretches_m in messages]
        heard_s = [at_s for at_s in comes_s if at_s is not None]
        if heard_s:
            for (message, _), at_s in zip(messages, comes_s, strict=True):
                self.wake(min(heard_s) if at_s is None else at_s, message)

    def _comes_s(self, now_s: float, stretches_m: Sequence[float]) -> float | None:
        """Return when a transmission over these stretches comes, if it is heard at the end of each [s]."""
        said, rng, at_s = self.settings, self._rng, now_s
        for far_m in stretches_m:
            self.transmissions += 1
            if far_m > said.range_m:
                self.beyond += 1
                return None
            if said.loss and rng.random() < said.loss:
                self.lost += 1
                return None
            self.longest_m = max(self.longest_m, far_m)
            at_s += said.delay_s * rng.uniform(0.5, 1.5)
        return at_s

    def wake(self, at_s: float, message: M) -> None:
        """Schedule a wake-up call at a time, without the radio."""
        self._sent += 1
        heapq.heappush(self._under_way, (at_s, self._sent, message))

    def next(self, until_s: float) -> tuple[float, M] | None:
        """Return the arrival time of the next message, and the message; None if none arrives by then."""
        if not self._under_way or self._under_way[0][0] > until_s:
            return None
        at_s, _, message = heapq.heappop(self._under_way)
        return at_s, message
