"""Messages as JSON: what is written is read again, and nothing else is read."""

from __future__ import annotations

import hmac
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
from loopgate.vehicles.wire import (
    WireError,
    decode,
    encode,
    pack,
    read_answer,
    read_told,
    unpack,
    write_answer,
)

SAID: list[Message] = [
    Ask(7, 1, 4, 3, 8, (2.5, 1), 4.5, free=False),
    Grant(1, 4, 7, 6.5, 2),
    Refuse(1, 4, 7, Why.LATE),
    Left(3, 1, 4),
    Probe(7, 2, 5, (2.5, 1), 3, (2, 9), 6),
    Clear(2, 5, (2, 9, 7)),
]
LINE: dict[str, Any] = {"since_s": 2.5, "now_s": 4.5, "ahead": 0.5, "here": 0.5, "free": True}
START: dict[str, Any] = {"loop": [1, 2], "at": 0, "rears": [], "clock": 0, "crowded": 0.5}
WRONG_STARTS: list[dict[str, Any]] = [
    *({"at": 99}, {"at": -9}, {"loop": []}, {"loop": 3}, {"rears": [None]}, {"clock": -1}),
    *({"clock": float("inf")}, {"crowded": 10**400}, {"crowded": "x"}),
]
KEY = b"key"
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
    assert decode(unpack(pack(encode(message), KEY), KEY)) == message


@pytest.mark.parametrize(
    "change",
    [
        *({"kind": "go"}, {"place": "7"}, {"place": True}, {"vehicle": 1.5}, {"stamp": [1]}, {"more": 1}),
        *({"stamp": [1.0, 2.0]}, {"stamp": [True, 1]}, {"number": None}),
        *({"number": 10**400}, {"sent_s": float("inf")}, {"stamp": [float("nan"), 1]}),
    ],
)
def test_a_message_that_is_not_as_described_is_refused(change: dict[str, Any]) -> None:
    """An unknown kind, an unknown field, another type."""
    with pytest.raises(WireError):
        decode(encode(SAID[0]) | change)


def test_an_answer_comes_as_it_was_sent() -> None:
    """With all that it says; and not with a flag that is no truth value."""
    answer = Answer((SAID[0], SAID[3]), goes=True)
    told = write_answer(1, 9, answer)
    assert read_answer(unpack(pack(told, KEY), KEY), 1, 9) == answer
    with pytest.raises(WireError, match="goes"):
        read_answer(told | {"goes": 1}, 1, 9)


@pytest.mark.parametrize("data", [b"", b"[1]", b"\xff", b"[" * 10_000])
def test_a_datagram_without_an_object_is_refused(data: bytes) -> None:
    """Whatever came in."""
    with pytest.raises(WireError):
        unpack(hmac.new(KEY, data, "sha256").hexdigest().encode() + data, KEY)


def test_a_datagram_of_a_stranger_is_refused() -> None:
    """Without the key, and with another."""
    for data in (b'{"vehicle":0,"hello":true}', pack({"vehicle": 0, "hello": True}, b"another")):
        with pytest.raises(WireError, match="not sealed"):
            unpack(data, KEY)


@pytest.mark.parametrize(
    "message", [Goes(7, 2, 4), Goes(9, 1, 4), Ask(7, 1, 4, 3, -1, (2.5, 1)), Offer(1, 7)]
)
def test_a_controller_speaks_for_its_own_vehicle_only(message: Message) -> None:
    """Not for another, of no place that there is not, and not as a post."""
    told = write_answer(1, 9, Answer((message,), goes=True))
    with pytest.raises(WireError):
        read_answer(told, 1, 9)


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
        assert _fits(unpack(pack(thing, KEY), KEY)), thing


@pytest.mark.parametrize("message", EACH)
def test_the_schema_and_the_reader_refuse_the_same(message: Message) -> None:
    """A field less, a field more, a field of another type."""
    told = unpack(pack(encode(message), KEY), KEY)
    spoilt = [{k: v for k, v in told.items() if k != left} for left in told]
    spoilt += [told | {"more": 1}, *(told | {name: "x"} for name in told)]
    for thing in spoilt:
        assert not _fits({"turn": 1, "event": "hear", "message": thing}), thing
        with pytest.raises(WireError):
            decode(thing)


@pytest.mark.parametrize(
    "thing",
    [
        *({"turn": turn, "event": "rear"} for turn in (float("inf"), float("nan"), 10**400, [1], None, True)),
        *({"turn": 5, "event": event} for event in (None, ["end"], "go")),
        *({"turn": 5, "event": "start", **START, **more} for more in WRONG_STARTS),
        *({"turn": 5, "event": "line", **LINE, name: 10**400} for name in ("since_s", "now_s", "ahead")),
        {"turn": 5, "event": "line", **LINE, "free": 1},
        {"turn": 5, "event": "hear", "message": {"kind": "\ud800"}},
    ],
)
def test_what_no_bridge_tells_is_refused(thing: dict[str, Any]) -> None:
    """Numbers beyond all numbers, a place beyond the loop, a loop of none."""
    with pytest.raises(WireError):
        read_told(thing)


def test_a_process_answers_as_its_controller_and_the_same_turn_twice() -> None:
    """A bridge of three lines: what comes over the wire is what the controller says."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bridge:
        bridge.bind(("127.0.0.1", 0))
        bridge.settimeout(20.0)
        aboard = Thread(target=serve, args=("127.0.0.1", bridge.getsockname()[1], 1, KEY), daemon=True)
        aboard.start()
        data, at = bridge.recvfrom(LARGEST)
        assert unpack(data, KEY) == {"vehicle": 1, "hello": True}

        def tell(**said: Any) -> dict[str, Any]:  # noqa: ANN401  as the schema says
            bridge.sendto(pack(said, KEY), at)
            return unpack(bridge.recv(LARGEST), KEY)

        tell(turn=1, event="start", loop=[3, 7], at=0, rears=[], clock=0, crowded=0.5)
        bridge.sendto(b"no object", at)  # not answered, and it goes on
        bridge.sendto(pack({"turn": float("inf"), "event": "rear"}, KEY), at)
        bridge.sendto(pack({"turn": 9, "event": "rear"}, b"a stranger"), at)
        asked = tell(turn=2, event="line", **LINE)
        assert read_answer(asked, 1, 9).say == (Ask(7, 1, 1, 3, 3, (2.5, 1), 4.5),)
        assert tell(turn=2, event="line", **LINE) == asked
        another = {**encode(Grant(1, 1, 7)), "vehicle": 2}
        assert not tell(turn=3, event="hear", message=another)["holds"]
        assert tell(turn=4, event="hear", message=encode(Grant(1, 1, 7)))["holds"]
        gone = read_answer(tell(turn=5, event="crossing", now_s=5.0, free=True), 1, 9)
        assert (gone.goes, len(gone.say)) == (True, 2)
        bridge.sendto(pack({"turn": 6, "event": "end"}, KEY), at)
        aboard.join(20.0)
        assert not aboard.is_alive()
