"""Spoiled datagrams for the bridge of a run and for the controllers of its vehicles, each a process.

``python analysis/fuzz_datagrams.py --minutes 10`` starts a bridge with four controllers. Strangers send the
bridge what they like; the bridge sends the controllers datagrams of the right seal whose content is spoiled,
and between them what a run would say. Exit code 1 if a process ends, or does not answer as before.
"""

from __future__ import annotations

import argparse
import json
import random
import socket
import sys
from collections.abc import Sequence
from threading import Event, Thread
from time import monotonic
from typing import Any

from loopgate.simulation.by_messages.controllers import Stand
from loopgate.simulation.by_messages.controllers_apart import ControllersApart
from loopgate.vehicles.air import AirSettings
from loopgate.vehicles.messages import Ask, Grant, Offer, Probe, Refuse, Room, Why
from loopgate.vehicles.wire import encode, pack

KEY = b"spoiled datagrams"
SPOILED = 20
"""Spoiled datagrams between two turns of a run."""

STANDS = [((3, 7, 5), k % 3, ()) for k in range(4)]
STRANGE: tuple[Any, ...] = (
    *(None, True, False, "", "x", "\ud800", [], {}, [[]], [1], ["end"], {"a": 1}, -1, 0, 99, 1.5),
    *(float("inf"), float("-inf"), float("nan"), 10**30, 10**400, -(10**400), 1e308, 5e-324),
)
TOLD: list[dict[str, Any]] = [
    {"event": "start", "loop": [3, 7, 5], "at": 0, "rears": [5], "clock": 7, "crowded": 0.5},
    {"event": "line", "since_s": 1.0, "now_s": 2.0, "ahead": 0.5, "here": 0.5, "free": True},
    {"event": "crossing", "now_s": 3.0, "free": True},
    *({"event": event} for event in ("rear", "patience")),
    *(
        {"event": "hear", "message": encode(message)}
        for message in (
            *(Grant(0, 1, 7, 9.0, 2), Refuse(0, 1, 7, Why.FULL), Offer(0, 7), Room(1, 4, 3)),
            *(Ask(7, 0, 4, 3, 5, (2.5, 1), 4.5), Probe(7, 5, 1, (1.0, 1), 3, (5,), 2)),
        )
    ),
]


def spoiled(rng: random.Random, thing: dict[str, Any]) -> dict[str, Any]:
    """Return a datagram's object with a field, or a field of its message, that is strange, missing or new."""
    made: dict[str, Any] = json.loads(json.dumps(thing))
    within = made["message"] if "message" in made and rng.randrange(3) else made
    name = rng.choice([*within, "more"])
    if not rng.randrange(7):
        within.pop(name, None)
    elif isinstance(within.get(name), list) and within[name] and rng.randrange(2):
        within[name][rng.randrange(len(within[name]))] = rng.choice(STRANGE)
    else:
        within[name] = rng.choice(STRANGE)
    return made


def sealed(thing: dict[str, Any]) -> bytes:
    """Return a datagram with the right seal; some things cannot be written as JSON."""
    try:
        return pack(thing, KEY)
    except (TypeError, ValueError):
        return pack({"turn": 1}, KEY)


class Spoiling(ControllersApart):
    """A bridge that also says what no bridge says."""

    @property
    def at(self) -> tuple[str, int]:
        """Where it listens."""
        host, port = self._wire.getsockname()
        return host, port

    def begin(self, stands: Sequence[Stand], crowded: float) -> None:
        """Start a process for each vehicle; a spoiled loop may have any place."""
        super().begin(stands, crowded)
        self._places = 1 << 60

    def spoil(self, rng: random.Random, number: int) -> None:
        """Send a controller a spoiled datagram in its turn."""
        self._turn += 1
        thing = spoiled(rng, {**rng.choice(TOLD), "turn": self._turn})
        self._wire.sendto(sealed(thing), self._at[number])

    def silent(self) -> list[int]:
        """Return the vehicles whose processes have ended or do not answer."""
        return sorted(self._gone_s)


def strangers(rng: random.Random, at: tuple[str, int], over: Event) -> None:
    """Send the bridge what has no seal, or a spoiled content under the right seal."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        while not over.wait(0.001):
            hello = {"vehicle": rng.choice([0, 1, 99, *STRANGE]), "hello": rng.choice([True, *STRANGE])}
            answer = {"vehicle": 0, "turn": rng.randrange(99), "say": [], "holds": True, "goes": True}
            wire.sendto(rng.choice([rng.randbytes(rng.randrange(300)), sealed(hello), sealed(answer)]), at)


def fuzz(minutes: float, seed: int) -> list[str]:
    """Return what went wrong."""
    rng, over = random.Random(seed), Event()
    bridge = Spoiling(AirSettings(processes=True), seed, key=KEY)
    Thread(target=strangers, args=(random.Random(seed + 1), bridge.at, over), daemon=True).start()
    until, sent, told = monotonic() + 60.0 * minutes, 0, 0
    try:
        bridge.begin(STANDS, 0.5)
        while monotonic() < until and not bridge.silent():
            number = rng.randrange(len(STANDS))
            for _ in range(SPOILED):
                bridge.spoil(rng, number)
            sent, told = sent + SPOILED, told + 1
            bridge.remind(number)
        wrong = [f"the process of vehicle {number} ended or was silent" for number in bridge.silent()]
    finally:
        over.set()
        bridge.close()
    print(f"{sent} spoiled datagrams to controllers, {told} answered turns between them, {len(wrong)} wrong")
    return wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found = fuzz(given.minutes, given.seed)
    print(*found, sep="\n")
    sys.exit(bool(found))
