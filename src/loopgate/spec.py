"""Things named on the command line: ``name`` or ``name:option=value,option=value``, found by entry point."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from typing import Any, TypeVar

from loopgate.errors import LoopgateError
from loopgate.reading import shown

__all__ = ["SpecError", "make_from_spec"]

T = TypeVar("T")

_LARGEST = 1e12
_LONGEST = 120
_KINDS: dict[str, tuple[tuple[type, ...], str]] = {
    "int": ((int,), "a whole number"),
    "float": ((int, float), "a number"),
    "bool": ((bool,), "true or false"),
    "str": ((str,), "a text"),
}
"""Values that an option takes, by its annotation."""


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
        ``false``, else text; numbers are finite and at most 1e12 in size. Where the factory annotates an
        option as one of these, only such a value is taken.
    make
        Called with the loaded factory, whose first parameter is not an option, and the options.

    Raises
    ------
    SpecError
        If nothing has that name, the thing has no such option, or refuses an option's value.
    """
    name, colon, rest = spec.partition(":")
    points = {point.name: point for point in entry_points(group=group)}
    if name not in points:
        msg = f"{kind} {_short(name)}: there is no such {kind}; installed are {', '.join(sorted(points))}"
        raise SpecError(msg)
    try:
        factory = points[name].load()
    except (ImportError, AttributeError) as error:
        msg = f"{kind} {name}: it is installed, but cannot be imported ({error})"
        raise SpecError(msg) from error
    options = dict(_option(kind, spec, part) for part in rest.split(",")) if colon else {}
    known = dict(list(inspect.signature(factory).parameters.items())[1:])
    for option, value in options.items():
        if option not in known:
            has = f"its options are {', '.join(known)}" if known else "it has no options"
            msg = f"{kind} {name}: unknown option {shown(option)}; {has}"
            raise SpecError(msg)
        _check_value(f"{kind} {name}: {option}", value, known[option].annotation)
    try:
        return make(factory, options)
    except (TypeError, ValueError) as error:
        msg = f"{kind} {_short(spec)}: {error}"
        raise SpecError(msg) from error


def _option(kind: str, spec: str, part: str) -> tuple[str, object]:
    key, equals, text = part.partition("=")
    if not key or not equals:
        msg = f"{kind} {_short(spec)}: {shown(part)} is no option; write name=value"
        raise SpecError(msg)
    return key.strip(), _value(text.strip())


def _check_value(what: str, value: object, annotation: object) -> None:
    if isinstance(value, int | float) and not abs(value) <= _LARGEST:
        msg = f"{what} is {shown(value)}; expected a finite number, at most {_LARGEST:g} in size"
        raise SpecError(msg)
    # Annotations are texts where the module postpones them.
    name = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", "")
    kinds, expected = _KINDS.get(name, ((object,), ""))
    if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds and expected):
        msg = f"{what} is {shown(value)}; expected {expected}"
        raise SpecError(msg)


def _short(spec: str) -> str:
    return spec if len(spec) <= _LONGEST else f"{spec[:_LONGEST]} ..."


def _value(text: str) -> object:
    if text in {"true", "false"}:
        return text == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
