"""What values the keys of a scenario may have: stated once, beside each field, and checked in one place."""

from __future__ import annotations

import math
import numbers
import operator
from dataclasses import dataclass
from typing import Protocol

from loopgate.errors import ScenarioError
from loopgate.reading import is_plain, shown

__all__ = ["Choice", "Flag", "LengthRange", "Real", "Rule", "Text", "Whole", "checked"]


class Rule(Protocol):
    """A kind of value."""

    @property
    def expected(self) -> str:
        """What is expected, for messages."""
        ...

    def __call__(self, value: object) -> object:
        """Return the value as it is kept; raise ValueError if it is none of this kind."""
        ...


def checked(key: str, value: object, rule: Rule) -> object:
    """Return the value as it is kept.

    Raises
    ------
    ScenarioError
        If it is none that the key may have; the text says which it may.
    """
    try:
        return rule(value)
    except (ValueError, OverflowError) as error:
        msg = f"{key} is {shown(value)}; expected {rule.expected}"
        raise ScenarioError(msg) from error


@dataclass(frozen=True, slots=True)
class Real:
    """A number, both bounds included; so it is finite."""

    least: float
    most: float

    @property
    def expected(self) -> str:
        return f"a number from {self.least:g} to {self.most:g}"

    def __call__(self, value: object) -> float:
        return _number(value, self.least, self.most)


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number, both bounds included."""

    least: int
    most: int

    @property
    def expected(self) -> str:
        return f"a whole number from {self.least} to {self.most}"

    def __call__(self, value: object) -> int:
        if not isinstance(value, numbers.Integral) or isinstance(value, bool):
            raise ValueError
        if not self.least <= (whole := operator.index(value)) <= self.most:
            raise ValueError
        return whole


@dataclass(frozen=True, slots=True)
class LengthRange:
    """Two lengths [m], the shorter first, also written ``400:2000``; above 0 and up to `most`."""

    most: float

    @property
    def expected(self) -> str:
        return f"two numbers, shortest and longest, above 0 and up to {self.most:g}"

    def __call__(self, value: object) -> tuple[float, float]:
        pair = [float(part) for part in value.split(":")] if isinstance(value, str) else value
        if not isinstance(pair, list | tuple):
            raise ValueError
        low, high = (_number(part, 0.0, self.most) for part in pair)
        if not 0.0 < low <= high:
            raise ValueError
        return low, high


@dataclass(frozen=True, slots=True)
class Text:
    """A text that can be printed and be the name of a file."""

    longest: int = 4096

    @property
    def expected(self) -> str:
        return f"a text of at most {self.longest} characters, without control characters"

    def __call__(self, value: object) -> str:
        if not isinstance(value, str) or len(value) > self.longest or not is_plain(value):
            raise ValueError
        return value


@dataclass(frozen=True, slots=True)
class Choice:
    """One of some words; the empty one, if it is among them, stands for a default."""

    words: tuple[str, ...]

    @property
    def expected(self) -> str:
        return f"one of {', '.join(word for word in self.words if word)}"

    def __call__(self, value: object) -> str:
        if not isinstance(value, str) or value not in self.words:
            raise ValueError
        return value


@dataclass(frozen=True, slots=True)
class Flag:
    """Yes or no."""

    @property
    def expected(self) -> str:
        return "true or false"

    def __call__(self, value: object) -> bool:
        if not isinstance(value, bool):
            raise ValueError  # noqa: TRY004  `checked` words all refusals alike
        return value


def _number(value: object, least: float, most: float) -> float:
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        raise ValueError
    number = float(value)
    if math.isnan(number) or not least <= number <= most:
        raise ValueError
    return number
