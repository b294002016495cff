"""Messages as JSON: what is written is read again, and nothing else is read."""

from __future__ import annotations

import json
import socket
from importlib.resources import files
from threading import Thread
from typing import Any

import pytest
from jsonschema import Draft202012Validator

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
from loopgate.vehicles.process import LARGEST, serve
from loopgate.vehicles.wire import WireError, decode, encode, pack, read_answer, unpack, write_answer

SAID: list[Message] = [
    Ask(7, 1, 4, 3, 8, (2.5, 1), 4.5, free=False),
    Grant(1, 4, 7, 6.5, 2),
    Refuse(1, 4, 7, Why.LATE),
    Left(3, 1, 4),
    Probe(7, 2, 5, (2.5, 1), 3, (2, 9), 6),
    Clear(2, 5, (2, 9, 7)),
]
LINE: dict[str, Any] = {"since_s": 2.5, "now_s": 4.5, "ahead": 0.5, "here": 0.5, "free": True}
EACH: list[Message] = [
    *SAID,
    Offer(1, 7),
    Goes(7, 1, 4),
    Moved(3, 1, 4),
    Room(1, 4, 3),
    Here(3, 1, 4),
    Changed(2, 5, (2, 9)),
]


@pytest.mark.parametrize("message", SAID)
def test_a_message_comes_as_it_was_sent(message: Message) -> None:
    """Over the wire and back."""
    assert decode(unpack(pack(encode(message)))) == message


@pytest.mark.parametrize(
    "change",
    [
        *({"kind": "go"}, {"place": "7"}, {"place": True}, {"vehicle": 1.5}, {"stamp": [1]}, {"more": 1}),
        *({"stamp": [1.0, 2.0]}, {"stamp": [True, 1]}, {"number": None}),
    ],
)
def test_a_message_that_is_not_as_described_is_refused(change: dict[str, Any]) -> None:
    """An unknown kind, an unknown field, another type."""
    with pytest.raises(WireError):
        decode(encode(SAID[0]) | change)


def test_an_answer_comes_as_it_was_sent() -> None:
    """With all that it says; and not with a flag that is no truth value."""
    answer = Answer(tuple(SAID), goes=True)
    told = write_answer(1, 9, answer)
    assert read_answer(unpack(pack(told))) == answer
    with pytest.raises(WireError, match="goes"):
        read_answer(told | {"goes": 1})


@pytest.mark.parametrize("data", [b"", b"[1]", b"\xff", b"[" * 10_000])
def test_a_datagram_without_an_object_is_refused(data: bytes) -> None:
    """Whatever came in."""
    with pytest.raises(WireError):
        unpack(data)


SCHEMA = Draft202012Validator(
    json.loads(files("loopgate.vehicles").joinpath("wire.schema.json").read_text("utf-8"))
)


def _fits(thing: dict[str, Any]) -> bool:
    return bool(SCHEMA.is_valid(thing))


def test_the_schema_describes_what_is_said() -> None:
    """All that a bridge and a controller say to one another, and each kind of message."""
    heard: list[dict[str, Any]] = [{"turn": 3, "event": "hear", "message": encode(one)} for one in EACH]
    said: list[dict[str, Any]] = [
        {"vehicle": 1, "hello": True},
        {"turn": 1, "event": "start", "loop": [1, 2], "at": 0, "rears": [], "clock": 0, "crowded": 0.5},
        {"turn": 2, "event": "line", **LINE},
        *heard,
        {"turn": 4, "event": "crossing", "now_s": 5.0, "free": True},
        *({"turn": 5, "event": event} for event in ("rear", "patience", "end")),
        write_answer(1, 6, Answer(tuple(EACH), goes=True)),
    ]
    for thing in said:
        assert _fits(unpack(pack(thing))), thing


@pytest.mark.parametrize("message", EACH)
def test_the_schema_and_the_reader_refuse_the_same(message: Message) -> None:
    """A field less, a field more, a field of another type."""
    told = unpack(pack(encode(message)))
    spoilt = [{k: v for k, v in told.items() if k != left} for left in told]
    spoilt += [told | {"more": 1}, *(told | {name: "x"} for name in told)]
    for thing in spoilt:
        assert not _fits({"turn": 1, "event": "hear", "message": thing}), thing
        with pytest.raises(WireError):
            decode(thing)


def test_a_process_answers_as_its_controller_and_the_same_turn_twice() -> None:
    """A bridge of three lines: what comes over the wire is what the controller says."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bridge:
        bridge.bind(("127.0.0.1", 0))
        bridge.settimeout(20.0)
        aboard = Thread(target=serve, args=("127.0.0.1", bridge.getsockname()[1], 1), daemon=True)
        aboard.start()
        data, at = bridge.recvfrom(LARGEST)
        assert unpack(data) == {"vehicle": 1, "hello": True}

        def tell(**said: Any) -> dict[str, Any]:  # noqa: ANN401  as the schema says
            bridge.sendto(pack(said), at)
            return unpack(bridge.recv(LARGEST))

        tell(turn=1, event="start", loop=[3, 7], at=0, rears=[], clock=0, crowded=0.5)
        bridge.sendto(b"no object", at)  # not answered, and it goes on
        asked = tell(turn=2, event="line", **LINE)
        assert read_answer(asked).say == (Ask(7, 1, 1, 3, 3, (2.5, 1), 4.5),)
        assert tell(turn=2, event="line", **LINE) == asked
        assert tell(turn=3, event="hear", message=encode(Grant(1, 1, 7)))["holds"]
        gone = read_answer(tell(turn=4, event="crossing", now_s=5.0, free=True))
        assert (gone.goes, len(gone.say)) == (True, 2)
        bridge.sendto(pack({"turn": 5, "event": "end"}), at)
        aboard.join(20.0)
        assert not aboard.is_alive()
