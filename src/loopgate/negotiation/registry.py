"""Negotiations by name, through the entry-point group ``loopgate.negotiations``."""

from collections.abc import Sequence
from itertools import islice
from random import Random

from loopgate.errors import PluginError, ScenarioError
from loopgate.model import System
from loopgate.negotiation.base import InformedNegotiation, Negotiation, Request, View
from loopgate.plugins import Plugins, blaming, is_ours, name_of_class, takes
from loopgate.reading import shown

_ORDER = "the requests that it was given, or some of them, in an order"


class _Careful:
    """Asks a negotiation of the user's."""

    def __init__(self, negotiation: Negotiation) -> None:
        self._negotiation = negotiation
        self._name = f"negotiation {name_of_class(negotiation)}"

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        with blaming(f"{self._name}: order", _ORDER):
            answer = self._negotiation.order(tuple(requests), view, now_s)
            # An answer may have no end.
            ordered = list(islice(iter(answer), len(requests) + 1)) if hasattr(answer, "__iter__") else None
        if ordered is None:
            msg = f"{self._name}: order returned {shown(answer)}; expected {_ORDER}"
            raise PluginError(msg)
        known = {request: request for request in requests}
        with blaming(f"{self._name}: the answer of order", _ORDER):
            found = [known.get(request) for request in ordered]
        going = dict.fromkeys(found)
        if None in going or len(going) < len(found):
            strange = next((i for i, one in enumerate(found) if one is None or one in found[:i]), 0)
            why = "which is none of these requests" if found[strange] is None else "twice"
            msg = f"{self._name}: order returned {shown(ordered[strange])}, {why}; expected {_ORDER}"
            raise PluginError(msg)
        return [request for request in going if request is not None]


class _CarefulInformed(_Careful):
    """The same for a negotiation that takes the system."""

    def __init__(self, negotiation: InformedNegotiation) -> None:
        super().__init__(negotiation)
        self._informed = negotiation

    def prepare(self, system: System) -> None:
        with blaming(f"{self._name}: prepare", "it to take note of the system"):
            self._informed.prepare(system)


def careful(negotiation: Negotiation) -> Negotiation:
    """Return a function that asks a negotiation, and raises `PluginError` if it fails or returns no order.

    The package's own negotiations are returned as they are.
    """
    if is_ours(negotiation):
        return negotiation
    if isinstance(negotiation, InformedNegotiation):
        return _CarefulInformed(negotiation)
    return _Careful(negotiation)


def check_methods(negotiation: Negotiation, name: str) -> None:
    """Raise `PluginError` if a method of a negotiation cannot be called as negotiations are called."""
    calls: dict[str, tuple[str, ...]] = {"order": ("requests", "view", "now_s")}
    if isinstance(negotiation, InformedNegotiation):
        calls["prepare"] = ("system",)
    for method, given in calls.items():
        wrong = takes(getattr(negotiation, method), *given)
        if wrong:
            msg = f"negotiation {name}: {method} {wrong}; expected {method}({', '.join(('self', *given))})"
            raise PluginError(msg)


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
