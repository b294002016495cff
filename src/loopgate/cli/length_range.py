"""The option type of ``--length MIN:MAX``."""

from __future__ import annotations

import click

__all__ = ["LENGTH_RANGE"]

_LONGEST_M = 1e6


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
