"""Negotiations by name, through the entry-point group ``loopgate.negotiations``."""

from __future__ import annotations

from importlib.metadata import entry_points
from random import Random
from typing import cast

from loopgate.errors import ScenarioError
from loopgate.negotiation.base import Negotiation
from loopgate.spec import SpecError, make_from_spec

__all__ = ["check_negotiation", "make_negotiation", "negotiation_names"]

_GROUP = "loopgate.negotiations"


def negotiation_names() -> list[str]:
    """Return the names of all installed negotiations, sorted."""
    return sorted({point.name for point in entry_points(group=_GROUP)})


def check_negotiation(spec: str) -> None:
    """Check a negotiation's name and options, by making one; raise `ScenarioError` as `make_negotiation`."""
    make_negotiation(spec, Random(0))


def make_negotiation(spec: str, rng: Random) -> Negotiation:
    """Make the negotiation that `spec` names (``name`` or ``name:option=value,...``).

    Raises
    ------
    ScenarioError
        If no negotiation has that name, it has no such option, or an option has no such value.
    """
    try:
        return make_from_spec("negotiation", _GROUP, spec, lambda f, o: cast("Negotiation", f(rng, **o)))
    except SpecError as error:
        raise ScenarioError(str(error)) from error
