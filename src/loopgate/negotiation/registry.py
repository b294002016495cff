"""Negotiations by name, through the entry-point group ``loopgate.negotiations``."""

from random import Random

from loopgate.errors import ScenarioError
from loopgate.foreign import is_ours
from loopgate.negotiation.base import Negotiation
from loopgate.negotiation.careful import check_methods
from loopgate.plugins import Plugins
from loopgate.reading import shown

_NEGOTIATIONS = Plugins(
    "negotiation", "loopgate.negotiations", ScenarioError, "a random.Random and its options"
)


def name_negotiation(negotiation: object) -> str:
    """Return the name of a negotiation class, function or object.

    Raises `ScenarioError` if it is none of these, nor a name.
    """
    if isinstance(negotiation, Negotiation) and not isinstance(negotiation, type):
        negotiation = _Made(negotiation)
    return _NEGOTIATIONS.name_of(negotiation)


class _Made:
    """Hands out a negotiation that is there already; it draws lots by its own means."""

    def __init__(self, negotiation: Negotiation) -> None:
        self._negotiation = negotiation

    def __call__(self, rng: Random) -> Negotiation:
        del rng
        return self._negotiation


def check_negotiation(spec: str) -> None:
    """Check the name and options of a negotiation; raise `ScenarioError` if they are invalid."""
    make_negotiation(spec, Random(0))


def make_negotiation(spec: str, rng: Random) -> Negotiation:
    """Make a negotiation from its name with options, ``name:option=value,...``.

    Raises `ScenarioError` if no negotiation has that name, it has no such option, or an option has no such
    value. Raises `PluginError` if one of a user's own fails, or cannot be called as negotiations are.
    """
    made: object = _NEGOTIATIONS.make(spec, lambda f, o: f(rng, **o))
    if not isinstance(made, Negotiation) or isinstance(made, type):
        msg = f"negotiation {spec}: it makes {shown(made)}, which is none; expected the method order"
        raise ScenarioError(msg)
    if not is_ours(made):
        check_methods(made, spec)
    return made
