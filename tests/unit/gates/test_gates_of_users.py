"""Gates of a user's own that fail or answer nonsense: one line says which, what it did, what is expected."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from builders import ring_of_three
from loopgate.errors import GateError, LoopgateError, PluginError
from loopgate.gates import Decision, Gate, Reason, check_gate, make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.following import careful, following
from loopgate.gates.one_step import OneStepGate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.runs import run_rounds, trace_moves
from loopgate.research.runs.counting import count_runs
from loopgate.research.state_space import explore, verify_everywhere, verify_walks

GATE = """
import sys
from dataclasses import replace
from loopgate.errors import GateError, UnsafeStartError
from loopgate.gates import Decision, Reason

class Words(Exception):
    def __str__(self):
        raise ValueError

class Shy:
    def __repr__(self):
        raise KeyError("no")

class Mine:
    def __init__(self, system):
        {init}
        self.system = system
    def decide(self, configuration, robot):
        {decide}
        return Decision(True, Reason.FREE)
    def moved(self, configuration, robot):
        {moved}
"""

RAISED = (
    "1 / 0",
    "{}['x']",
    "sys.exit(7)",
    "raise SystemExit",
    "raise GeneratorExit",
    "raise StopIteration",
    "raise Words",
    "raise RecursionError('deep')",
    "raise BaseException('two\\nlines')",
    "self.system.move(self.system.initial, 99)",
    "raise GateError('of mine')",
)
"""Errors of all kinds, also such as are no `Exception`, and such as the package raises itself."""

ANSWERS = (
    ("None", "returned, for robot r1, None; expected a Decision"),
    ("True", "returned, for robot r1, True; expected a Decision"),
    ("Shy()", "a value of type Shy that cannot be shown; expected a Decision"),
    ("(True, 'free')", "(True, 'free'); expected a Decision"),
    ("Decision(1, Reason.FREE)", "whose admitted is 1; expected True or False"),
    ("Decision(True, 'free')", "whose reason is 'free'; expected a Reason"),
    (
        "Decision(False, Reason.DEADLOCK, (0, 3))",
        "whose blockers is (0, 3); expected numbers of robots, 0 to 2",
    ),
    ("Decision(False, Reason.DEADLOCK, (-1,))", "whose blockers is (-1,); expected numbers of robots"),
    ("Decision(False, Reason.DEADLOCK, 5)", "whose blockers is 5; expected numbers of robots"),
    ("Decision(False, Reason.DEADLOCK, (), 3)", "whose detail is 3; expected a text of one line"),
    (
        "Decision(False, Reason.DEADLOCK, (), 'a', '\\ud800')",
        "whose stage is '\\ud800'; expected",
    ),
    ("Decision(False, Reason.DEADLOCK, (), '', None)", "whose stage is None; expected a text"),
    ("Decision(True, Reason.FREE, messages=-1)", "whose messages is -1; expected a whole number from 0 up"),
)


def write(folder: Path, *, init: str = "pass", decide: str = "pass", moved: str = "pass") -> str:
    """Write a gate that does so; return its name."""
    file = folder / "mine.py"
    file.write_text(GATE.format(init=init, decide=decide, moved=moved), encoding="utf-8")
    return f"{file}:Mine"


def asked(gate: Gate, system: System) -> None:
    careful(gate, system).decide(system.initial, 0)


def told(gate: Gate, system: System) -> None:
    careful(gate, system).moved(system.initial, 0)


USES: tuple[Callable[[Gate, System], object], ...] = (
    asked,
    lambda gate, system: explore(system, gate),
    lambda gate, system: trace_moves(system, gate, []),
    lambda gate, system: run_rounds(system, lambda: gate, rounds=1, seed=1),
    lambda gate, system: verify_everywhere(system, lambda _: gate),
    lambda gate, system: verify_walks(system, lambda _: gate, seed=1),
)
"""All that asks a gate, but for the drive (see `tests/sumo`)."""


def one_line(error: LoopgateError, begin: str) -> str:
    text = str(error)
    assert "\n" not in text
    assert text.startswith(begin)
    return text


@pytest.mark.parametrize("what", RAISED)
def test_whatever_it_raises_is_one_line(what: str, tmp_path: Path) -> None:
    """In each of its methods; the line of the user's file is in it, and what is expected."""
    system = ring_of_three()
    for method, use in (("decide", asked), ("moved", told)):
        name = write(tmp_path, **{method: what})
        with pytest.raises(PluginError) as caught:
            use(make_gate(name, system), system)
        text = one_line(caught.value, f"gate {name}: {method} raised ")
        assert re.search(r"\(mine\.py, line \d+\); expected ", text)


@pytest.mark.parametrize("what", RAISED[:-2])
def test_whatever_it_raises_when_it_is_made(what: str, tmp_path: Path) -> None:
    """Errors of the package are its way to refuse: see below."""
    name = write(tmp_path, init=what)
    with pytest.raises(
        PluginError, match="expected a class or function that is called with a System"
    ) as caught:
        make_gate(name, ring_of_three())
    one_line(caught.value, f"gate {name}: making it raised ")


def test_it_may_refuse_a_start_or_a_value(tmp_path: Path) -> None:
    """The kind of error stays, since a fleet goes on without those who are refused; the name is added."""
    name = write(tmp_path, init="raise UnsafeStartError('a crowd at s1')")
    with pytest.raises(GateError) as caught:
        make_gate(name, ring_of_three())
    assert (type(caught.value).__name__, str(caught.value)) == (
        "UnsafeStartError",
        f"gate {name}: a crowd at s1",
    )
    name = write(tmp_path, init="raise ValueError('depth is 0; expected 1 or more')")
    with pytest.raises(GateError) as caught:
        make_gate(name, ring_of_three())
    assert str(caught.value) == f"gate {name}: depth is 0; expected 1 or more"


@pytest.mark.parametrize("what", ["sys.exit(0)", "raise BaseException('no')", "raise Words", "x"])
def test_a_file_that_ends_the_program_when_it_is_run(what: str, tmp_path: Path) -> None:
    """Before anything runs; also where the file answers no name."""
    for text in (what, f"def __getattr__(name):\n    {what}"):
        file = tmp_path / "ends.py"
        file.write_text(
            f"import sys\nclass Words(Exception):\n    __str__ = None\n{text}\n", encoding="utf-8"
        )
        with pytest.raises(GateError) as caught:
            check_gate(f"{file}:Mine")
        one_line(caught.value, f"gate {file}:Mine: the file fails (")


@pytest.mark.parametrize(("answer", "says"), ANSWERS)
@pytest.mark.parametrize("use", USES)
def test_a_strange_answer(
    answer: str, says: str, use: Callable[[Gate, System], object], tmp_path: Path
) -> None:
    """To whoever asks: named with the robot that was asked for."""
    system, name = ring_of_three(), write(tmp_path, decide=f"return {answer}")
    with pytest.raises(PluginError) as caught:
        use(make_gate(name, system), system)
    assert says in one_line(caught.value, f"gate {name}: decide returned, for robot ")


def test_an_answer_on_open_paths(tmp_path: Path) -> None:
    """Runs are counted there."""
    system = System([Robot(RobotId("a"), (StateId("s1"), StateId("s2")), closed=False)])
    with pytest.raises(PluginError, match="decide returned, for robot a, None"):
        count_runs(system, make_gate(write(tmp_path, decide="return None"), system))


@pytest.mark.filterwarnings("error")
def test_a_method_that_is_a_coroutine(tmp_path: Path) -> None:
    """Its answer is none, and Python has nothing to warn of."""
    name = write(tmp_path)
    file = tmp_path / "mine.py"
    file.write_text(
        file.read_text(encoding="utf-8").replace("def decide", "async def decide"), encoding="utf-8"
    )
    with pytest.raises(PluginError, match="decide returned, for robot r1, <coroutine"):
        asked(make_gate(name, ring_of_three()), ring_of_three())


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("decide(self, configuration, robot)", "decide(self)", "decide takes (); expected decide(self, conf"),
        (
            "moved(self, configuration, robot)",
            "moved(x)",
            "moved takes (); expected moved(self, configuration",
        ),
        (
            "def decide(",
            "decide = 3\n    def other(",
            "decide is 3; expected decide(self, configuration, robot)",
        ),
        ("__init__(self, system)", "__init__(self)", "making it raised TypeError"),
        ("__init__(self, system)", "__init__(self, system, deep)", "making it raised TypeError"),
    ],
)
def test_a_wrong_signature(before: str, after: str, says: str, tmp_path: Path) -> None:
    """Said when it is made, before anything runs."""
    name, file = write(tmp_path), tmp_path / "mine.py"
    file.write_text(file.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")
    with pytest.raises(PluginError) as caught:
        make_gate(name, ring_of_three())
    assert says in one_line(caught.value, f"gate {name}: ")


class Blind(CollisionGate):
    """Says nothing to anybody; derived from a gate that others need not ask."""

    def decide(self, configuration: Any, robot: int) -> Decision:  # noqa: ANN401  as it comes
        del configuration, robot
        return Decision(admitted=False, reason=Reason.DEADLOCK)


class Deaf(CertifiedGate):
    """The same, of one that follows the moves."""

    decide = Blind.decide


@pytest.mark.parametrize("gate", [Blind, Deaf])
def test_what_is_derived_from_a_gate_of_the_package_decides_itself(gate: Callable[[System], Gate]) -> None:
    """Its parent is compiled or not asked at all, and follows the moves: this one is asked itself."""
    system = ring_of_three()
    assert explore(system, gate(system)).stuck == 1
    assert following(gate(system)) is None


def test_the_packages_own_gates_are_asked_as_they_are() -> None:
    """Nothing stands between them and who asks; they follow as they did."""
    system = ring_of_three()
    for gate in (CertifiedGate(system), OneStepGate(system)):
        assert careful(gate, system) is gate
        assert following(gate) is gate


def test_a_promise_that_is_none(tmp_path: Path) -> None:
    """What is judged by it is not judged by another one."""
    gate: Any = make_gate(write(tmp_path), ring_of_three())
    gate.promise = "peace"
    with pytest.raises(PluginError, match="promise is 'peace'; expected everyone or somebody"):
        explore(ring_of_three(), gate)
