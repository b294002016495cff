"""Things named on the command line: ``name`` or ``name:option=value,option=value``, found by entry point."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from typing import Any, TypeVar

from loopgate.errors import LoopgateError

__all__ = ["SpecError", "make_from_spec"]

T = TypeVar("T")


class SpecError(LoopgateError):
    """A name that is not installed, or an option that does not exist."""


def make_from_spec(
    kind: str, group: str, spec: str, make: Callable[[Callable[..., Any], Mapping[str, object]], T]
) -> T:
    """Load the entry point that `spec` names and make it with the options of `spec`.

    Parameters
    ----------
    kind
        What it is, for messages: "gate", "negotiation".
    group
        The entry-point group.
    spec
        The name, with options behind a colon. Values are whole numbers, decimal numbers, ``true`` or
        ``false``, else text.
    make
        Called with the loaded factory, whose first parameter is not an option, and the options.

    Raises
    ------
    SpecError
        If nothing has that name, the thing has no such option, or refuses an option's value.
    """
    name, _, rest = spec.partition(":")
    points = {point.name: point for point in entry_points(group=group)}
    if name not in points:
        msg = f"{kind} {name}: there is no such {kind}; installed are {', '.join(sorted(points))}"
        raise SpecError(msg)
    factory = points[name].load()
    options = dict(_option(kind, spec, part) for part in rest.split(",")) if rest else {}
    known = list(inspect.signature(factory).parameters)[1:]
    for option in options:
        if option not in known:
            has = f"its options are {', '.join(known)}" if known else "it has no options"
            msg = f"{kind} {name}: unknown option {option!r}; {has}"
            raise SpecError(msg)
    try:
        return make(factory, options)
    except (TypeError, ValueError) as error:
        msg = f"{kind} {spec}: {error}"
        raise SpecError(msg) from error


def _option(kind: str, spec: str, part: str) -> tuple[str, object]:
    key, equals, text = part.partition("=")
    if not key or not equals:
        msg = f"{kind} {spec}: {part!r} is no option; write name=value"
        raise SpecError(msg)
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
