"""Gates by name, found through the entry-point group ``loopgate.gates``.

A package of yours adds a gate with three lines in its pyproject.toml::

    [project.entry-points."loopgate.gates"]
    mine = "my_package.my_gate:MyGate"

and it works wherever a gate is named: ``loopgate run --gate mine``, ``mine:option=3``.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import cast

from loopgate.errors import GateError
from loopgate.gates.base import Gate
from loopgate.model import System

__all__ = ["gate_names", "make_gate"]

_GROUP = "loopgate.gates"


def gate_names() -> list[str]:
    """Return the names of all installed gates, sorted."""
    return sorted({point.name for point in entry_points(group=_GROUP)})


def make_gate(spec: str, system: System) -> Gate:
    """Make the gate that `spec` names, for `system`.

    Parameters
    ----------
    spec
        A gate's name, with options behind a colon: ``algorithm2`` or ``algorithm2:lookahead=2,cap=9``.
        Option values are whole numbers, decimal numbers, ``true`` or ``false``, else text.

    Raises
    ------
    GateError
        If no gate has that name or the gate has no such option.
    """
    name, _, rest = spec.partition(":")
    options = dict(_option(spec, part) for part in rest.split(",")) if rest else {}
    points = [point for point in entry_points(group=_GROUP) if point.name == name]
    if not points:
        msg = f"gate {name}: there is no such gate; installed are {', '.join(gate_names())}"
        raise GateError(msg)
    factory = cast("Callable[..., Gate]", points[0].load())
    known = list(inspect.signature(factory).parameters)[1:]
    for option in options:
        if option not in known:
            has = f"its options are {', '.join(known)}" if known else "it has no options"
            msg = f"gate {name}: unknown option {option!r}; {has}"
            raise GateError(msg)
    return factory(system, **options)


def _option(spec: str, part: str) -> tuple[str, object]:
    key, equals, text = part.partition("=")
    if not key or not equals:
        msg = f"gate {spec}: {part!r} is no option; write name=value"
        raise GateError(msg)
    return key.strip(), _value(text.strip())


def _value(text: str) -> object:
    if text in {"true", "false"}:
        return text == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
