"""Negotiations by name, through the entry-point group ``loopgate.negotiations``."""

from random import Random

from loopgate.errors import ScenarioError
from loopgate.negotiation.base import Negotiation
from loopgate.plugins import PluginError, make_plugin, name_of
from loopgate.reading import shown

_GROUP = "loopgate.negotiations"


def name_negotiation(negotiation: object) -> str:
    """Return the name of a class or function that makes a negotiation, or of one that is made already.

    Raises `ScenarioError` if it is none of these, nor a name.
    """
    if isinstance(negotiation, Negotiation) and not isinstance(negotiation, type):
        negotiation = _Made(negotiation)
    try:
        return name_of("negotiation", _GROUP, negotiation)
    except PluginError as error:
        raise ScenarioError(str(error)) from error


class _Made:
    """Hands out a negotiation that is there already; it draws lots by its own means."""

    def __init__(self, negotiation: Negotiation) -> None:
        self._negotiation = negotiation

    def __call__(self, rng: Random) -> Negotiation:
        del rng
        return self._negotiation


def check_negotiation(spec: str) -> None:
    """Check a negotiation's name and options, by making one; raise `ScenarioError` as `make_negotiation`."""
    make_negotiation(spec, Random(0))


def make_negotiation(spec: str, rng: Random) -> Negotiation:
    """Make the negotiation that `spec` names (``name`` or ``name:option=value,...``).

    Raises `ScenarioError` if no negotiation has that name, it has no such option, or an option has no such
    value.
    """
    try:
        made: object = make_plugin("negotiation", _GROUP, spec, lambda f, o: f(rng, **o))
    except PluginError as error:
        raise ScenarioError(str(error)) from error
    if not isinstance(made, Negotiation):
        msg = f"negotiation {spec}: it makes {shown(made)}, which is none; expected the method order"
        raise ScenarioError(msg)
    return made
