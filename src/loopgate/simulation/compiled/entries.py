"""The ways into the compiled drive, from Python.

Tables come as plain tuples of those of `Books` and `Orders`: numba, which looks at all that it is given each
time, takes half as long for these as for named ones.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from loopgate.simulation.compiled import driving
from loopgate.simulation.compiled.driving import Orders
from loopgate.simulation.compiled.tables import Books
from loopgate.simulation.sensing import Floats, Numbers

__all__ = ["answer", "begin", "look", "turn"]


@njit(cache=True, error_model="numpy")
def begin(now_s: float, step_s: float, tables: tuple[Any, ...], orders: tuple[Any, ...]) -> None:
    """See `driving.begin`."""
    driving.begin(now_s, step_s, Books(*tables), Orders(*orders))


@njit(cache=True, error_model="numpy")
def look(
    odometer: Floats,
    halted: Numbers,
    now_s: float,
    step_s: float,
    tables: tuple[Any, ...],
    orders: tuple[Any, ...],
) -> None:
    """See `driving.look`."""
    driving.look(odometer, halted, now_s, step_s, Books(*tables), Orders(*orders))


@njit(cache=True, error_model="numpy")
def answer(
    freed: Numbers,
    now_s: float,
    step_s: float,
    pressure: tuple[float, float, float],
    tables: tuple[Any, ...],
    orders: tuple[Any, ...],
) -> None:
    """See `driving.answer`."""
    driving.answer(freed, now_s, step_s, pressure, Books(*tables), Orders(*orders))


@njit(cache=True, error_model="numpy")
def turn(
    odometer: Floats,
    halted: Numbers,
    now_s: float,
    step_s: float,
    pressure: tuple[float, float, float],
    tables: tuple[Any, ...],
    orders: tuple[Any, ...],
) -> None:
    """`look` and `answer` in one, where nothing else is to be done in between."""
    books, rows = Books(*tables), Orders(*orders)
    driving.look(odometer, halted, now_s, step_s, books, rows)
    driving.answer(halted[:0], now_s, step_s, pressure, books, rows)
