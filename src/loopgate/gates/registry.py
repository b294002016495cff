"""Gates by name, found through the entry-point group ``loopgate.gates``.

A package of yours adds a gate with two lines in its pyproject.toml::

    [project.entry-points."loopgate.gates"]
    mine = "my_package.my_gate:MyGate"

and it works wherever a gate is named: ``loopgate run --gate mine``, ``mine:option=3``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from typing import cast

from loopgate.errors import GateError
from loopgate.gates.base import Gate, TimedGate
from loopgate.model import System
from loopgate.spec import SpecError, make_from_spec

__all__ = ["check_gate", "gate_names", "make_gate"]

_GROUP = "loopgate.gates"


def gate_names() -> list[str]:
    """Return the names of all installed gates, sorted."""
    return sorted({point.name for point in entry_points(group=_GROUP)})


def check_gate(spec: str) -> None:
    """Check a gate's name and options before there is a system to make it for.

    Names, options and the kinds of their values are checked for every gate; what the values mean, for gates
    that have a static method ``check_options``.

    Raises
    ------
    GateError
        If no gate has that name, the gate has no such option, or an option has no such value.
    """

    def check(factory: Callable[..., object], options: Mapping[str, object]) -> None:
        checks = getattr(factory, "check_options", None)
        if checks is not None:
            checks(**options)

    try:
        make_from_spec("gate", _GROUP, spec, check)
    except SpecError as error:
        raise GateError(str(error)) from error


def make_gate(spec: str, system: System, clock: Callable[[], float] | None = None) -> Gate:
    """Make the gate that `spec` names (``name`` or ``name:option=value,...``), for `system`.

    A gate with a budget of time measures it with `clock` [s]; without one its time has no limit.

    Raises
    ------
    GateError
        If no gate has that name, the gate has no such option, or the gate refuses the system's start.
    """
    try:
        gate = make_from_spec("gate", _GROUP, spec, lambda f, o: cast("Gate", f(system, **o)))
    except SpecError as error:
        raise GateError(str(error)) from error
    if clock is not None and isinstance(gate, TimedGate):
        gate.use_clock(clock)
    return gate
