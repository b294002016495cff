"""Messages as JSON: what is written is read again, and nothing else is read."""

from __future__ import annotations

from typing import Any

import pytest

from loopgate.vehicles.controller import Answer
from loopgate.vehicles.messages import Ask, Clear, Grant, Left, Message, Probe, Refuse, Why
from loopgate.vehicles.wire import WireError, decode, encode, pack, read_answer, unpack, write_answer

SAID: list[Message] = [
    Ask(7, 1, 4, 3, 8, (2.5, 1)),
    Grant(1, 4, 7),
    Refuse(1, 4, 7, Why.LATE),
    Left(3, 1, 4),
    Probe(7, 2, 5, (2.5, 1), 3, (2, 9), 6),
    Clear(2, 5, (2, 9, 7)),
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
