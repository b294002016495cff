"""Connects vehicles on the road with their controllers, each of which is a separate process.

The bridge acts as the sensors, the motor, the radio and the clock of each vehicle. Posts run in the bridge's
own process. Time is simulated, so the bridge waits for the answer to each datagram. A process that has ended
gives no answers: its vehicle gets no grant and stops at its stop line. The process is started again later,
without memory.
"""

from __future__ import annotations

import os
import secrets
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from random import Random
from time import monotonic
from typing import Any

from loopgate.errors import LoopgateError
from loopgate.simulation.by_messages.controllers import Stand
from loopgate.vehicles.air import AirSettings
from loopgate.vehicles.controller import Answer
from loopgate.vehicles.messages import Stamp, ToVehicle
from loopgate.vehicles.process import LARGEST
from loopgate.vehicles.wire import KEY, WireError, encode, pack, read_answer, unpack

__all__ = ["ControllersApart"]

_COMMAND = (sys.executable, "-c", "from loopgate.cli.main import main; main()", "vehicle")
_STARTS_S, _ANSWERS_S, _AGAIN_S = 120.0, 10.0, 0.25
"""Longest time for a process to start and to answer, and time after which a datagram is repeated [s of wall
time]."""


class ControllersApart:
    """Controllers that run as processes on this machine.

    Parameters
    ----------
    settings
        Number of processes to kill, when to kill them, and when to start them again.
    seed
        Seed of the choice of these processes.
    key
        Seals all datagrams, so that no other program on the machine speaks for a vehicle; random by default.
    """

    def __init__(self, settings: AirSettings, seed: int, key: bytes = b"") -> None:
        self._settings, self._rng = settings, Random(f"kill {seed}")
        self._wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._wire.bind(("127.0.0.1", 0))
        self._key = key or secrets.token_bytes(32)
        self._places = 0
        self._processes: dict[int, subprocess.Popen[bytes]] = {}
        self._at: dict[int, tuple[str, int]] = {}
        self._gone_s: dict[int, float] = {}
        """Since when each ended process is gone [s]."""
        self._killed = False
        self._now_s = 0.0
        self._turn = self.started = self.killed = self.datagrams = 0

    def begin(self, stands: Sequence[Stand], crowded: float) -> None:
        """Start a process for each vehicle."""
        self._crowded = crowded
        self._places = 1 + max(place for loop, _, _ in stands for place in loop)
        self._start(range(len(stands)), lambda number: stands[number], 0)

    def look(self, now_s: float, stand: Callable[[int], Stand]) -> list[tuple[int, Answer]]:
        """Kill the processes of some controllers once, at the set time; start them again after a while.

        Return the answers of the processes that start. `stand`: returns where a vehicle is, by its number.
        """
        self._now_s = now_s
        if self._settings.kill and not self._killed and now_s >= self._settings.kill_at_s:
            self._killed = True
            for number in self._rng.sample(sorted(self._at), min(self._settings.kill, len(self._at))):
                self._end(number)
                self.killed += 1
        due = [n for n, gone_s in self._gone_s.items() if now_s - gone_s >= self._settings.again_s]
        return self._start(due, stand, int(1000.0 * now_s) + 1) if due else []

    def at_line(
        self, number: int, stamp: Stamp, now_s: float, shares: tuple[float, float], *, free: bool
    ) -> Answer:
        """Answer as `Controllers.at_line` says."""
        ahead, here = shares
        said = {"since_s": stamp[0], "now_s": now_s, "ahead": ahead, "here": here, "free": free}
        return self._tell(number, event="line", **said)

    def hear(self, number: int, message: ToVehicle) -> Answer:
        """Answer as `Controllers.hear` says."""
        return self._tell(number, event="hear", message=encode(message))

    def crossing(self, number: int, now_s: float, *, free: bool) -> Answer:
        """Answer as `Controllers.crossing` says."""
        return self._tell(number, event="crossing", now_s=now_s, free=free)

    def rear_out(self, number: int) -> Answer:
        """Answer as `Controllers.rear_out` says."""
        return self._tell(number, event="rear")

    def remind(self, number: int) -> Answer:
        """Answer as `Controllers.remind` says."""
        return self._tell(number, event="patience")

    def report(self) -> dict[str, Any]:
        """Return the figures of the processes."""
        return {
            "processes": len(self._processes),
            "killed": self.killed,
            "started_again": self.started - len(self._processes),
            "datagrams": self.datagrams,
        }

    def close(self) -> None:
        """End all processes."""
        for at in self._at.values():
            self._wire.sendto(pack({"turn": 0, "event": "end"}, self._key), at)
        self._wire.close()
        for process in self._processes.values():
            try:
                process.wait(1.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def _start(
        self, numbers: Sequence[int], stand: Callable[[int], Stand], clock: int
    ) -> list[tuple[int, Answer]]:
        """Start processes, and tell each the position of its vehicle."""
        host, port = self._wire.getsockname()
        for number in numbers:
            command = (*_COMMAND, "--bridge", f"{host}:{port}", "--number", str(number))
            known = os.environ | {KEY: self._key.hex()}  # the command line is for all to see
            started = subprocess.Popen(command, stdin=subprocess.DEVNULL, env=known)  # noqa: S603  our own
            self._processes[number] = started
            self.started += 1
        missing, until = set(numbers), monotonic() + _STARTS_S
        while missing:
            if monotonic() > until or any(self._processes[n].poll() is not None for n in missing):
                self.close()
                msg = f"decide processes: the process of vehicle {min(missing)} did not start"
                raise LoopgateError(msg)
            said, at = self._receive(_AGAIN_S)
            who = said.get("vehicle")
            if said.get("hello") is True and type(who) is int and who in missing:
                self._at[who] = at
                missing.remove(who)
        answers = []
        for number in numbers:
            self._gone_s.pop(number, None)
            loop, position, rears = stand(number)
            told = {"loop": loop, "at": position, "rears": rears, "clock": clock, "crowded": self._crowded}
            answers.append((number, self._tell(number, event="start", **told)))
        return answers

    def _tell(self, number: int, **said: Any) -> Answer:  # noqa: ANN401  as the schema says
        """Send a controller a datagram; return its answer, which is empty if the process is gone."""
        if number in self._gone_s:
            return Answer()
        self._turn += 1
        data = pack({"turn": self._turn, **said}, self._key)
        until = monotonic() + _ANSWERS_S
        while monotonic() < until and self._processes[number].poll() is None:
            self._wire.sendto(data, self._at[number])
            self.datagrams += 1
            again = monotonic() + _AGAIN_S
            while monotonic() < again:
                heard, at = self._receive(_AGAIN_S)
                if at == self._at[number] and heard.get("turn") == self._turn:
                    try:
                        return read_answer(heard, number, self._places)
                    except WireError:
                        break
        self._end(number)
        return Answer()

    def _receive(self, wait_s: float) -> tuple[dict[str, Any], tuple[str, int]]:
        """Return the next datagram and its sender; nothing if none comes or it does not fit the schema."""
        self._wire.settimeout(wait_s)
        try:
            data, at = self._wire.recvfrom(LARGEST)
            return unpack(data, self._key), at
        except (TimeoutError, WireError):
            return {}, ("", 0)

    def _end(self, number: int) -> None:
        """Kill a process."""
        self._processes[number].kill()
        self._processes[number].wait()
        self._at.pop(number, None)
        self._gone_s[number] = self._now_s
