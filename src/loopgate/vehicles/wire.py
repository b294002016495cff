"""Messages between posts, controllers and bridge as JSON: one object in each datagram.

``wire.schema.json`` beside this file describes the same, for controllers in other languages.
"""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from typing import Any, cast

from loopgate.errors import LoopgateError
from loopgate.vehicles.controller import Answer
from loopgate.vehicles.messages import (
    Ask,
    Changed,
    Clear,
    Goes,
    Grant,
    Here,
    Left,
    Message,
    Moved,
    Offer,
    Probe,
    Refuse,
    Room,
    Why,
)

__all__ = ["WireError", "decode", "encode", "pack", "read_answer", "unpack", "write_answer"]

_KINDS: dict[str, type[Message]] = {
    kind.__name__.lower(): kind
    for kind in (Ask, Grant, Refuse, Offer, Goes, Moved, Left, Here, Room, Probe, Clear, Changed)
}
_FLAGS = ("holds", "goes", "gives_back", "refused")


class WireError(LoopgateError):
    """A datagram that does not fit the JSON schema."""


def pack(thing: dict[str, Any]) -> bytes:
    """Return the bytes of a datagram with a JSON object."""
    return json.dumps(thing, separators=(",", ":")).encode()


def unpack(data: bytes) -> dict[str, Any]:
    """Return the JSON object in a datagram.

    Raises
    ------
    WireError
        If it holds no JSON object.
    """
    try:
        thing = json.loads(data)
    except (ValueError, RecursionError):
        thing = None
    if not isinstance(thing, dict):
        msg = "a datagram holds no JSON object"
        raise WireError(msg)
    return thing


def encode(message: Message) -> dict[str, Any]:
    """Return a message as a JSON object.

    Examples
    --------
    >>> encode(Room(vehicle=1, number=4, place=7, there=2))
    {'kind': 'room', 'vehicle': 1, 'number': 4, 'place': 7, 'there': 2}
    """
    return {"kind": type(message).__name__.lower(), **asdict(message)}


def decode(thing: object) -> Message:
    """Return the message that a JSON object describes.

    Raises
    ------
    WireError
        If a field is missing, unknown or of another type.

    Examples
    --------
    >>> decode({"kind": "grant", "vehicle": 1, "number": 4, "place": 7, "until_s": 2.5, "there": 2})
    Grant(vehicle=1, number=4, place=7, until_s=2.5, there=2)
    """
    kind = _KINDS.get(str(thing.get("kind"))) if isinstance(thing, dict) else None
    if kind is None:
        msg = f"a message has no kind; expected one of {', '.join(_KINDS)}"
        raise WireError(msg)
    given = cast("dict[str, Any]", thing)
    names = {field.name for field in fields(kind)}
    if names != set(given) - {"kind"}:
        msg = f"message {given['kind']} has fields {', '.join(given)}; expected {', '.join(sorted(names))}"
        raise WireError(msg)
    return kind(**{name: _value(name, given[name]) for name in names})


def _value(name: str, value: object) -> Any:  # noqa: ANN401  as the field says
    """Return the value of a field."""
    if name == "why" and value in list(Why):
        return Why(cast("str", value))
    if name == "path" and isinstance(value, list) and all(map(_is_number, value)):
        return tuple(value)
    if name == "stamp" and isinstance(value, list) and _is_stamp(value):
        return float(value[0]), value[1]
    if name == "free" and isinstance(value, bool):
        return value
    if name in {"sent_s", "until_s"} and (value is None) <= (name == "until_s") and _is_time(value):
        return value
    if name not in {"why", "path", "stamp", "free", "sent_s", "until_s"} and _is_number(value):
        return value
    msg = f"field {name} of a message is not of its type"
    raise WireError(msg)


def _is_number(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_time(value: object) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _is_stamp(value: list[Any]) -> bool:
    if [isinstance(one, bool) for one in value] != [False, False]:
        return False
    return isinstance(value[0], int | float) and isinstance(value[1], int)


def write_answer(vehicle: int, turn: int, answer: Answer) -> dict[str, Any]:
    """Return a controller's answer as a JSON object."""
    said = [encode(message) for message in answer.say]
    return {"vehicle": vehicle, "turn": turn, "say": said} | {name: getattr(answer, name) for name in _FLAGS}


def read_answer(thing: dict[str, Any]) -> Answer:
    """Return the controller's answer that a JSON object describes.

    Raises
    ------
    WireError
        If it is not as the schema says.
    """
    said, flags = thing.get("say"), {name: thing.get(name) for name in _FLAGS}
    if not isinstance(said, list) or not all(isinstance(flag, bool) for flag in flags.values()):
        msg = f"an answer has no list say, or no true or false at one of {', '.join(_FLAGS)}"
        raise WireError(msg)
    return Answer(tuple(map(decode, said)), **cast("dict[str, bool]", flags))
