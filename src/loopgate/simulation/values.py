"""Rules for the values of a scenario's keys, and their checks."""

import numbers
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NoReturn

from loopgate.errors import ScenarioError
from loopgate.reading import is_plain, shown

_LARGEST_AMOUNT = 1e6

_LONGEST_TEXT = 4096
"""Most characters of a text; a path can be this long."""


@dataclass(frozen=True, slots=True)
class Rule:
    """The rule for one kind of value.

    Attributes
    ----------
    expected
        The allowed values, in words for messages.
    accept
        Returns a value in the form in which the scenario has it; raises TypeError or ValueError if the value
        is not allowed.
    words
        The words of a choice; empty for other kinds of value.
    """

    expected: str
    accept: Callable[[object], object]
    words: tuple[str, ...] = ()


def checked(key: str, value: object, rule: Rule) -> object:
    """Return a value in the form in which the scenario has it; refuse a value that is not allowed.

    Raises
    ------
    ScenarioError
        If the key does not allow the value. The text lists the values that it allows.
    """
    try:
        return rule.accept(value)
    except (TypeError, ValueError, OverflowError) as error:
        msg = f"{key} is {shown(value)}; expected {rule.expected}"
        raise ScenarioError(msg) from error


def real(least: float, most: float) -> Rule:
    """Return the rule for a finite number within two bounds."""
    return Rule(f"a number from {least:g} to {most:g}", lambda value: _number(value, least, most))


def whole(least: int, most: int) -> Rule:
    """Return the rule for a whole number within two bounds."""

    def accept(value: object) -> int:
        _of_type(value, numbers.Integral)
        number = operator.index(value)  # type: ignore[arg-type]  # numpy's whole numbers have one too
        return number if least <= number <= most else _refuse()

    return Rule(f"a whole number from {least} to {most}", accept)


def length_range(most: float) -> Rule:
    """Return the rule for two lengths [m] above 0, the shorter first, also written ``400:2000``."""

    def accept(value: object) -> tuple[float, float]:
        pair = [float(part) for part in value.split(":")] if isinstance(value, str) else value
        if not isinstance(pair, list | tuple):
            raise TypeError
        low, high = (_number(part, 0.0, most) for part in pair)
        return (low, high) if 0.0 < low <= high else _refuse()

    return Rule(f"two numbers, shortest and longest, above 0 and up to {most:g}", accept)


def text() -> Rule:
    """Return the rule for a text without control characters, which can be a file name."""

    def accept(value: object) -> str:
        if not isinstance(value, str):
            raise TypeError
        return value if len(value) <= _LONGEST_TEXT and is_plain(value) else _refuse()

    return Rule(f"a text of at most {_LONGEST_TEXT} characters, none of them control characters", accept)


def amounts(*, whole_only: bool) -> Rule:
    """Return the rule for positive amounts by name, as a table or ``one=2,other=0.5``."""
    kind = "whole numbers" if whole_only else "numbers"

    def accept(value: object) -> str:
        if isinstance(value, Mapping):
            value = ",".join(f"{name}={amount}" for name, amount in value.items())
        read = parse_amounts(str(text().accept(value)))
        if not all(0.0 < x <= _LARGEST_AMOUNT and not (whole_only and x % 1) for x in read.values()):
            _refuse()
        return ",".join(f"{name}={amount:g}" for name, amount in read.items())

    return Rule(f"names with {kind} above 0: one=2,other=3", accept)


def parse_amounts(words: str) -> dict[str, float]:
    """Return amounts by name, in order; raise `ValueError` if the text is invalid."""
    read: dict[str, float] = {}
    for word in filter(None, words.split(",")):
        name, _, amount = word.rpartition("=")
        if not name.strip() or name.strip() in read:
            _refuse()
        read[name.strip()] = float(amount)
    return read


def choice(words: tuple[str, ...]) -> Rule:
    """Return the rule for a choice of words; the empty word stands for a default."""
    named = tuple(filter(None, words))
    accept: Callable[[object], object] = lambda value: value if value in words else _refuse()  # noqa: E731
    return Rule(f"one of {', '.join(named)}", accept, named)


def flag() -> Rule:
    """Return the rule for yes or no."""
    return Rule("true or false", lambda value: value if isinstance(value, bool) else _refuse())


def _number(value: object, least: float, most: float) -> float:
    _of_type(value, numbers.Real)
    number = float(value)  # type: ignore[arg-type]  # numpy's numbers too
    return number if least <= number <= most else _refuse()


def _of_type(value: object, kind: type) -> None:
    if not isinstance(value, kind) or isinstance(value, bool):
        raise TypeError


def _refuse() -> NoReturn:
    raise ValueError
