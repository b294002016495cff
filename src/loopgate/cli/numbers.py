"""Numbers on the command line: finite and in range, or refused before the command starts."""

from math import isnan

import click

_LONGEST_M = 1e6


class FiniteRange(click.FloatRange):
    """A range of numbers without `nan`; the range of click includes it."""

    def convert(self, value: float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fail if it is out of range or not a number."""
        number: float = super().convert(value, param, ctx)
        if isnan(number):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


class _LengthRange(click.ParamType[tuple[float, float]]):
    name = "MIN:MAX"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        if isinstance(value, tuple):
            return value
        low, _, high = str(value).partition(":")
        try:
            found = float(low), float(high)
        except ValueError:
            self.fail(f"{value!r} is no range of lengths; write two numbers, like 400:2000", param, ctx)
        if not 0.0 < found[0] <= found[1] <= _LONGEST_M:
            self.fail(f"{value!r}: expected 0 < shortest <= longest <= {_LONGEST_M:g}", param, ctx)
        return found


LENGTH_RANGE = _LengthRange()
"""Shortest and longest length [m], written ``400:2000``."""
