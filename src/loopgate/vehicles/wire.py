"""Messages between posts, controllers and bridge as JSON: one object in each datagram.

A datagram begins with a seal: the HMAC-SHA256 of the rest under a key that the bridge gives its controllers,
in 64 hexadecimal digits. ``wire.schema.json`` beside this file describes the rest, for controllers in other
languages.
"""

from __future__ import annotations

import hmac
import json
from dataclasses import asdict, dataclass, fields
from math import isfinite
from typing import Any, Final, Literal, cast

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

__all__ = [
    "KEY", "Start", "Told", "WireError", "as_json", "decode", "encode", "pack", "read_answer", "read_told",
    "unpack", "write_answer",
]  # fmt: skip

KEY: Final = "LOOPGATE_BRIDGE_KEY"
"""The environment variable by which a controller's process gets the key, in hexadecimal digits."""

_SEAL: Final = 64
_LARGEST: Final = 1 << 53
"""Numbers up to this have one meaning in every language's JSON."""

_KINDS: dict[str, type[Message]] = {
    kind.__name__.lower(): kind
    for kind in (Ask, Grant, Refuse, Offer, Goes, Moved, Left, Here, Room, Probe, Clear, Changed)
}
_FLAGS = ("holds", "goes", "gives_back", "refused")


class WireError(LoopgateError):
    """A datagram that does not fit the JSON schema."""


def as_json(thing: dict[str, Any]) -> bytes:
    """Return a JSON object as bytes."""
    return json.dumps(thing, separators=(",", ":")).encode()


def pack(thing: dict[str, Any], key: bytes) -> bytes:
    """Return the bytes of a datagram with a JSON object, sealed with a key."""
    text = as_json(thing)
    return _seal(text, key) + text


def _seal(text: bytes, key: bytes) -> bytes:
    return hmac.new(key, text, "sha256").hexdigest().encode()


def unpack(data: bytes, key: bytes) -> dict[str, Any]:
    """Return the JSON object in a datagram.

    Raises
    ------
    WireError
        If it is not sealed with this key, or holds no JSON object.
    """
    seal, text = data[:_SEAL], data[_SEAL:]
    if not hmac.compare_digest(seal, _seal(text, key)):
        msg = "a datagram is not sealed with the key of this run"
        raise WireError(msg)
    try:
        thing = json.loads(text)
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
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) <= _LARGEST


def _is_figure(value: object) -> bool:
    return _is_number(value) or (isinstance(value, float) and isfinite(value) and abs(value) <= _LARGEST)


def _is_time(value: object) -> bool:
    return value is None or _is_figure(value)


def _is_stamp(value: list[Any]) -> bool:
    return len(value) == 2 and _is_figure(value[0]) and _is_number(value[1])  # noqa: PLR2004  time and number


@dataclass(frozen=True, slots=True)
class Start:
    """The bridge tells a controller where its vehicle is, as `Controller.start` takes it."""

    loop: tuple[int, ...]
    at: int
    rears: tuple[int, ...]
    clock: int
    crowded: float


@dataclass(frozen=True, slots=True)
class Told:
    """What a bridge tells a controller: the number of its turn, what has happened, and more about it."""

    turn: int
    event: Literal["start", "line", "hear", "crossing", "rear", "patience", "end"]
    start: Start | None = None
    message: Message | None = None
    figures: tuple[float, ...] = ()
    """Of ``line``: since when, clock [s], shares ahead and here. Of ``crossing``: clock [s]."""
    free: bool = False


_FIGURES: Final = {"line": ("since_s", "now_s", "ahead", "here"), "crossing": ("now_s",)}


def read_told(thing: dict[str, Any]) -> Told:
    """Read what a bridge tells a controller.

    Raises
    ------
    WireError
        If it is not as the schema says.
    """
    turn, event = thing.get("turn"), thing.get("event")
    if not _is_number(turn) or event not in ("start", "line", "hear", "crossing", "rear", "patience", "end"):
        msg = "a datagram of the bridge has no turn, or no event that is known"
        raise WireError(msg)
    start = _read_start(thing) if event == "start" else None
    message = decode(thing.get("message")) if event == "hear" else None
    figures = [thing.get(name) for name in _FIGURES.get(event, ())]
    if not all(map(_is_figure, figures)) or (figures and not isinstance(thing.get("free"), bool)):
        msg = f"event {event} lacks a figure, or free is no truth value"
        raise WireError(msg)
    free = thing.get("free") is True
    return Told(cast("int", turn), event, start, message, tuple(map(float, cast("Any", figures))), free=free)


def _read_start(thing: dict[str, Any]) -> Start:
    loop, rears = thing.get("loop"), thing.get("rears")
    at, clock, crowded = thing.get("at"), thing.get("clock"), thing.get("crowded")
    known = isinstance(loop, list) and isinstance(rears, list) and all(map(_is_number, (*loop, *rears)))
    if not (known and loop and _is_number(at) and _is_number(clock) and _is_figure(crowded)):
        msg = "event start says no loop, no position, no clock or no share"
        raise WireError(msg)
    start = Start(*cast("Any", (tuple(loop), at, tuple(cast("Any", rears)), clock, crowded)))
    if not 0 <= start.at < len(start.loop) or min(start.clock, *start.loop, *start.rears) < 0:
        msg = "event start has the vehicle beyond its loop, or a place or a clock below 0"
        raise WireError(msg)
    return start


def write_answer(vehicle: int, turn: int, answer: Answer) -> dict[str, Any]:
    """Return a controller's answer as a JSON object."""
    said = [encode(message) for message in answer.say]
    return {"vehicle": vehicle, "turn": turn, "say": said} | {name: getattr(answer, name) for name in _FLAGS}


def read_answer(thing: dict[str, Any], vehicle: int, places: int) -> Answer:
    """Return the answer of a vehicle's controller that a JSON object describes.

    Parameters
    ----------
    vehicle, places
        The number of the vehicle, and how many places there are.

    Raises
    ------
    WireError
        If it is not as the schema says, says what only posts say, or speaks for another vehicle or of a place
        that there is not.
    """
    said, flags = thing.get("say"), {name: thing.get(name) for name in _FLAGS}
    if not isinstance(said, list) or not all(isinstance(flag, bool) for flag in flags.values()):
        msg = f"an answer has no list say, or no true or false at one of {', '.join(_FLAGS)}"
        raise WireError(msg)
    messages = tuple(map(decode, said))
    for one in messages:
        there = [one.place, *((one.here, one.then) if isinstance(one, Ask) else ())]
        if not isinstance(one, Ask | Goes | Moved | Left | Here) or one.vehicle != vehicle:
            msg = f"vehicle {vehicle} says {one}, which is not its own to say"
            raise WireError(msg)
        if not all(0 <= place < places for place in there):
            msg = f"vehicle {vehicle} speaks of a place that there is not: {one}"
            raise WireError(msg)
    return Answer(messages, **cast("dict[str, bool]", flags))
