"""Distributions of types and routes: a draw by shares for each vehicle."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from random import Random
from typing import TypeVar
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import as_number
from loopgate.reading import shown

T = TypeVar("T")

_MOST = 1e9


@dataclass(frozen=True, slots=True)
class Choice:
    """A member of a distribution: a name, or an element of its own.

    `share` is None where the distribution does not say it.
    """

    name: str
    element: ET.Element | None
    share: float | None


def parts(spread: ET.Element, what: str, *, named: str, tag: str) -> list[Choice]:
    """Return the choices of a distribution.

    Raises `RouteError` if a share is none, or their number is not that of the names.

    Parameters
    ----------
    spread
        A ``<vTypeDistribution>`` or ``<routeDistribution>``.
    what
        File and element, for messages.
    named, tag
        The attribute that lists names, and the tag of elements inside.
    """
    names, shares = spread.get(named, "").split(), spread.get("probabilities", "").split()
    if shares and len(shares) != len(names):
        msg = f"{what}: it has {len(shares)} probabilities for {len(names)} {named}; give one for each"
        raise RouteError(msg)
    found = [Choice(name, None, _share(shares[k], what) if shares else None) for k, name in enumerate(names)]
    for one in spread.findall(tag):
        said = one.get("probability")
        share = None if said is None else _share(said, what)
        other = one.get("refId", "")
        found.append(Choice(other or one.get("id", ""), None if other else one, share))
    return found


def routes_named(elements: Iterable[ET.Element]) -> set[str]:
    """Return the routes that distributions name, but do not hold themselves."""
    found: set[str] = set()
    for spread in elements:
        found.update(spread.get("routes", "").split(), (one.get("refId", "") for one in spread))
    return found


def share_of(element: ET.Element, what: str) -> float:
    """Return the share of a type or route in distributions that do not say it; SUMO's default is 1."""
    said = element.get("probability")
    return 1.0 if said is None else _share(said, what)


def refuse_nothing(shares: Iterable[float], what: str) -> None:
    """Raise `RouteError` if all shares are 0."""
    if not any(shares):
        msg = f"{what}: nothing can be drawn from it; name something with a probability above 0"
        raise RouteError(msg)


def draw(choices: Sequence[tuple[T, float]], rng: Random) -> T:
    """Draw a member by the shares."""
    return rng.choices([one for one, _ in choices], [share for _, share in choices])[0]


def _share(text: str, what: str) -> float:
    share = as_number(text)
    if not 0.0 <= share <= _MOST:
        msg = f"{what}: a probability is {shown(text)}; expected a share, from 0 and up to {_MOST:g}"
        raise RouteError(msg)
    return share
