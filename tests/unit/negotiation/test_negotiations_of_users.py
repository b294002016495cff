"""Negotiations of a user's own that fail or return no order: one line with name and expectation."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import pytest

from builders import ring_of_three
from loopgate.errors import PluginError, ScenarioError
from loopgate.negotiation.base import InformedNegotiation, Request
from loopgate.negotiation.pressure import Pressure
from loopgate.negotiation.registry import careful, make_negotiation
from loopgate.negotiation.simple import OldestFirst

MINE = """
import itertools
import sys

class Mine:
    def __init__(self, rng):
        {init}
    def order(self, requests, view, now_s):
        {order}
"""
REQUESTS = [Request(robot, 1, 2, 0.5 * robot) for robot in range(3)]
VIEW: Any = None


def write(folder: Path, order: str, *, init: str = "pass") -> str:
    """Write a negotiation that does so; return its name."""
    file = folder / "mine.py"
    file.write_text(MINE.format(init=init, order=order), encoding="utf-8")
    return f"{file}:Mine"


@pytest.mark.parametrize(
    ("order", "says"),
    [
        ("return None", "order returned None; expected the requests that it was given"),
        ("return 3", "order returned 3; expected the requests"),
        ("return 'ab'", "order returned 'a', which is none of these requests; expected the requests"),
        ("return [0, 1]", "order returned 0, which is none of these requests"),
        (
            "return [*requests, requests[1]]",
            "order returned Request(robot=1, here=1, wanted=2, since_s=0.5), twice",
        ),
        ("return itertools.repeat(requests[2])", "order returned Request(robot=2, "),
        ("return [requests[0]._replace(robot=7)]", "order returned Request(robot=7, "),
        ("return [[]]", "the answer of order raised TypeError: unhashable type: 'list'; expected"),
        (
            "return (1 / 0 for _ in requests)",
            "order raised ZeroDivisionError: division by zero (mine.py, line 9)",
        ),
        ("sys.exit(3)", "order raised SystemExit: 3 (mine.py, line 9); expected the requests"),
        ("requests.sort()", "order raised AttributeError"),
    ],
)
def test_no_order(order: str, says: str, tmp_path: Path) -> None:
    """Named by file and class; an order without an end too."""
    name = write(tmp_path, order)
    with pytest.raises(PluginError) as caught:
        careful(make_negotiation(name, Random(0))).order(REQUESTS, VIEW, 9.0)
    assert str(caught.value).startswith(f"negotiation {name}: ")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_orders(tmp_path: Path) -> None:
    """Whatever can be gone through is one: some of the requests, or none, and what equals them."""
    for order, robots in (
        ("return reversed(requests)", [2, 1, 0]),
        ("return {requests[1]: 1}", [1]),
        ("return ()", []),
        ("return [tuple(requests[2])]", [2]),
    ):
        ordered = careful(make_negotiation(write(tmp_path, order), Random(0))).order(REQUESTS, VIEW, 9.0)
        assert [request.robot for request in ordered] == robots


def test_made_wrongly(tmp_path: Path) -> None:
    """Said before anything runs: what making it raises, refuses, or how it cannot be called."""
    for init, kind, says in (
        (
            "sys.exit()",
            PluginError,
            "making it raised SystemExit (mine.py, line 7); expected a class or function",
        ),
        ("raise ValueError('no')", ScenarioError, "Mine: no"),
    ):
        with pytest.raises(kind) as caught:
            make_negotiation(write(tmp_path, "return requests", init=init), Random(0))
        assert says in str(caught.value)
    name, file = write(tmp_path, "return requests"), tmp_path / "mine.py"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("requests, view, now_s", "requests"), encoding="utf-8")
    with pytest.raises(
        PluginError, match=r"order takes \(requests\); expected order\(self, requests, view, now_s\)"
    ):
        make_negotiation(name, Random(0))


def test_one_that_wants_to_know_the_system(tmp_path: Path) -> None:
    """It is told, and may fail at that."""
    name, file = write(tmp_path, "return requests"), tmp_path / "mine.py"
    with file.open("a", encoding="utf-8") as stream:
        stream.write("    def prepare(self, system):\n        return system.nothing\n")
    asked = careful(make_negotiation(name, Random(0)))
    assert isinstance(asked, InformedNegotiation)
    with pytest.raises(PluginError, match=r"prepare raised AttributeError: .*'nothing'"):
        asked.prepare(ring_of_three())


def test_the_packages_own_are_asked_as_they_are() -> None:
    """Nothing stands between."""
    for own in (OldestFirst(Random(0)), Pressure(Random(0))):
        assert careful(own) is own
