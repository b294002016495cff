"""Gates and negotiations of a user's own that fail, answer nonsense or cannot be called, by kind of fault.

A fault that comes about has to be named; to take such a plug-in without a word is a fault as well.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import NamedTuple

from fuzz_readers import ROOT, Reader

from loopgate import Robot, Scenario, System, explore, make_gate
from loopgate.errors import LoopgateError
from loopgate.gates import Gate, check_gate
from loopgate.gates.following import careful
from loopgate.model import RobotId, StateId
from loopgate.negotiation.base import Request
from loopgate.negotiation.registry import careful as careful_order
from loopgate.negotiation.registry import make_negotiation
from loopgate.research.runs import run_rounds, trace_moves
from loopgate.research.state_space import verify_everywhere, verify_walks
from loopgate.simulation.run import simulate

_SIMULATED = 0.01
"""Share of the plug-ins that drive vehicles in SUMO, which takes most of a second."""

_SOURCE = """
import asyncio, decimal, dataclasses, itertools, os, random, sys, threading
import numpy as np
from loopgate.errors import GateError, LoopgateError, UnsafeStartError
from loopgate.gates import Decision, Reason
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.following import Follower
from loopgate.negotiation.base import Request
{top}
class Odd(Exception):
    def __str__(self):
        raise KeyError("odd")
class Shy:
    def __repr__(self):
        raise RuntimeError("shy")
    def __eq__(self, other):
        raise SystemExit(3)
    def __hash__(self):
        return 0
class Mine{base}:
    def __init__(self, {given}):
        {made}
        self.count = 0
    def decide(self{decide_given}):
        {decide}
        return Decision(True, Reason.FREE)
    def moved(self{moved_given}):
        {moved}
    def order(self{order_given}):
        {order}
        return requests
"""
_RAISED = (
    *("1 / 0", "[][3]", "{}['x']", "None.x", "int('x')", "raise Odd", "raise Odd()", "sys.exit()"),
    *("sys.exit(0)", "sys.exit('no')", "raise SystemExit", "raise GeneratorExit", "raise StopIteration"),
    *("raise BaseException", "raise BaseException('a\\nb')", "raise Exception('x' * 9999)", "raise 3"),
    *("raise LoopgateError('mine')", "raise UnsafeStartError('mine')", "raise GateError('')", "raise"),
    *("raise RecursionError", "raise MemoryError", "raise OSError(28, 'No space')", "assert False"),
    *("exec('def:')", "import nowhere", "undefined", "raise UnicodeDecodeError('a', b'', 0, 1, 'x')"),
    *("raise ExceptionGroup('g', [ValueError()])", "raise AttributeError('decide')", "np.zeros(3)[7]"),
    *("raise StopAsyncIteration", "raise Warning('w')", "def f(): return f()\n        f()", "os.stat('/x')"),
)
_VALUES = (
    *("None", "True", "False", "0", "1", "-1", "10**30", "1.5", "float('nan')", "''", "'free'", "'x' * 9999"),
    *("()", "[]", "{}", "(True, Reason.FREE)", "[0, 1]", "(-1,)", "(99,)", "(0, 0.5)", "('a',)", "range(3)"),
    *("Shy()", "object()", "Decision", "Reason.FREE", "np.zeros(3)", "np.bool_(True)", "lambda: 1", "b''"),
    *("decimal.Decimal(1)", "itertools.count()", "iter(())", "(x for x in ())", "NotImplemented", "..."),
    *("asyncio.sleep(0)", "'\\ud800'", "'a\\nb'", "self", "type('Decision', (), {})()"),
)
_FIELDS = ("admitted", "reason", "blockers", "detail", "stage", "messages")
_BASES = ("(CollisionGate)", "(Follower)", "(CertifiedGate)")
_SIGNATURES = ("", ", *, configuration", ", one, two, three", ", one, two, /, three, *, four", ", *, x, y")
_TWO = ", configuration, robot"
_ORDER = ", requests, view, now_s"
_REQUESTS = tuple(Request(robot, robot, 3, 0.5 * robot) for robot in range(3))
_PLAIN = {
    "top": "",
    "base": "",
    "given": "system, depth: int = 1",
    "made": "pass",
    "decide_given": _TWO,
    "decide": "pass",
    "moved_given": _TWO,
    "moved": "pass",
    "order_given": _ORDER,
    "order": "pass",
}


class _Fault(NamedTuple):
    """A plug-in with a fault: what differs from a plain one, and whether it must be refused."""

    parts: dict[str, str]
    certain: bool = True


def _ring() -> System:
    paths = (("p1", "a", "b"), ("p2", "b", "c"), ("p3", "c", "a"))
    return System([Robot(RobotId(f"r{n}"), tuple(map(StateId, path))) for n, path in enumerate(paths)])


def _uses(system: System) -> tuple[Callable[[Gate], object], ...]:
    return (
        lambda gate: explore(system, gate),
        lambda gate: verify_everywhere(system, lambda _: gate),
        lambda gate: verify_walks(system, lambda _: gate, seed=1, steps=9),
        lambda gate: trace_moves(system, gate, []),
        lambda gate: run_rounds(system, lambda: gate, rounds=2, seed=1),
        lambda gate: careful(gate, system).decide(system.initial, 1),
    )


def _plugin(folder: Path, random: Random, *, fault: Callable[[Random], _Fault], what: str) -> None:
    parts, certain = fault(random)
    file = folder / "mine.py"
    file.write_text(_SOURCE.format(**_PLAIN | parts), encoding="utf-8", errors="surrogatepass")
    name = f"{file}:Mine"
    try:
        _use(name, random, what)
    except LoopgateError as error:
        if str(file) not in str(error):
            msg = f"it does not name the file: {error}"
            raise AssertionError(msg) from error
        raise
    if certain:
        msg = f"taken without a word: {parts}"
        raise AssertionError(msg)


def _use(name: str, random: Random, what: str) -> None:
    if random.random() < _SIMULATED:
        roads = {"network": str(ROOT / "networks" / "order2.net.xml"), "duration_s": 30.0}
        routes = {"routes": str(ROOT / "routes" / "order2.rou.xml"), "abstraction": "segments"}
        simulate(Scenario.from_dict({**roads, **routes, what: name}))
    elif what == "gate":
        check_gate(name)
        system = _ring()
        gate = make_gate(name, system, random.choice((None, lambda: 0.0)))
        uses = _uses(system)
        for use in (random.choice(uses), uses[-1]):
            use(gate)
            careful(gate, system).moved(system.initial, 1)
    else:
        careful_order(make_negotiation(name, random)).order(_REQUESTS, _View(), 9.0)


class _View:
    """Tells a negotiation how full states are."""

    def held(self, state: int) -> int:
        return state

    room = outside = held


def _at_import(random: Random) -> _Fault:
    text = random.choice(_RAISED).replace("\n        ", "\n")
    if random.random() < 0.2:  # noqa: PLR2004  a share
        text = "def __getattr__(name):\n    " + text.replace("\n", "\n    ") + "\ndel Mine"
        return _Fault({"order": f"pass\n{text}"})
    return _Fault({"top": text})


def _when_made(random: Random) -> _Fault:
    return _Fault({"made": random.choice(_RAISED)})


def _raises(random: Random) -> _Fault:
    where = random.choice(("decide", "decide", "moved"))
    return _Fault({where: random.choice(_RAISED), **_derived(random)})


def _derived(random: Random) -> dict[str, str]:
    """Derive a share of the gates from one of the package."""
    base = random.choice(_BASES) if random.random() < 0.3 else ""  # noqa: PLR2004  a share
    return {"base": base, "made": "super().__init__(system)"} if base else {}


def _answers(random: Random) -> _Fault:
    if random.random() < 0.4:  # noqa: PLR2004  a share
        return _Fault({"decide": f"return {random.choice(_VALUES)}", **_derived(random)})
    field, value = random.choice(_FIELDS), random.choice(_VALUES)
    fitting = {
        "admitted": {"True", "False"},
        "reason": {"Reason.FREE"},
        "blockers": {"()", "[]", "[0, 1]"},
        "detail": {"''", "'free'", "'x' * 9999", "Reason.FREE"},
        "stage": {"''", "'free'", "'x' * 9999", "Reason.FREE"},
        "messages": {"0", "1", "10**30"},
    }[field]
    made = f"return dataclasses.replace(Decision(False, Reason.OCCUPIED), {field}={value})"
    return _Fault({"decide": made}, certain=value not in fitting)


def _signature(random: Random) -> _Fault:
    if random.random() < 0.3:  # noqa: PLR2004  a share
        return _Fault({"given": random.choice(("", "*, system", "a, b", "*, a, b"))})
    return _Fault({random.choice(("decide_given", "moved_given")): random.choice(_SIGNATURES)})


def _order(random: Random) -> _Fault:
    way = random.random()
    if way < 0.3:  # noqa: PLR2004  a share
        return _Fault({random.choice(("order", "made")): random.choice(_RAISED)})
    if way < 0.4:  # noqa: PLR2004  a share
        return _Fault({"order_given": random.choice(_SIGNATURES).replace("configuration", "requests")})
    if way < 0.7:  # noqa: PLR2004  a share
        value = random.choice(_VALUES)
        nobody = {"''", "()", "[]", "{}", "iter(())", "(x for x in ())", "b''"}
        return _Fault({"order": f"return {value}"}, certain=value not in nobody)
    value = random.choice(_VALUES)
    strange = (f"[*requests, {value}]", f"[{value}] * 2", "[*requests, requests[0]]", "requests * 2")
    return _Fault({"order": f"return {random.choice(strange)}"})


def _reader(name: str, share: int, fault: Callable[[Random], _Fault], what: str = "gate") -> Reader:
    return Reader(f"plug-in: {name}", share, "plugins", (), partial(_plugin, fault=fault, what=what))


PLUGINS = (
    _reader("at import", 8, _at_import),
    _reader("when made", 8, _when_made),
    _reader("raises", 12, _raises),
    _reader("answers", 16, _answers),
    _reader("signature", 5, _signature),
    _reader("order", 14, _order, "negotiation"),
)
"""By kind of fault."""
