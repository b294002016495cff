"""Gates and negotiations of a user's own: in a file, or at hand."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from random import Random

import pytest

from builders import ring_of_three
from loopgate.errors import GateError, ScenarioError
from loopgate.gates import check_gate, make_gate, name_gate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.open import OpenGate
from loopgate.model import System
from loopgate.negotiation.registry import make_negotiation, name_negotiation
from loopgate.negotiation.simple import OldestFirst
from loopgate.plugins import in_file
from loopgate.simulation.scenario import Scenario, read_scenario

MINE = """
from __future__ import annotations
from dataclasses import dataclass
from loopgate.gates.collision import CollisionGate
from loopgate.negotiation.simple import OldestFirst

RUN = []
RUN.append("once")

@dataclass
class Setting:
    depth: int

class Mine(CollisionGate):
    def __init__(self, system, *, depth: int = 1):
        super().__init__(system)
        self.setting = Setting(depth)

def nothing(system):
    return None

class First(OldestFirst):
    pass

THREE = 3
"""


class AtHand(CollisionGate):
    """A gate of this file."""


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Return a file with things of a user's own."""
    file = tmp_path / "mine.py"
    file.write_text(MINE, encoding="utf-8")
    return file


def test_a_gate_in_a_file(mine: Path) -> None:
    """It takes options like any other; the file is run once for all that is asked of it."""
    check_gate(f"{mine}:Mine:depth=3")
    one, other = (make_gate(f"{mine}:Mine:depth=3", ring_of_three()) for _ in range(2))
    assert repr(one.setting) == "Setting(depth=3)"  # type: ignore[attr-defined]
    assert type(one) is type(other)


def test_a_file_that_changes_is_run_again(mine: Path) -> None:
    """A notebook goes on while its user edits the gate."""
    assert "decide" in dir(make_gate(f"{mine}:Mine", ring_of_three()))
    mine.write_text(MINE.replace("depth: int = 1", "depth: int = 7"), encoding="utf-8")
    gate = make_gate(f"{mine}:Mine", ring_of_three())
    assert gate.setting.depth == 7  # type: ignore[attr-defined]


def test_a_negotiation_in_a_file(mine: Path) -> None:
    """The same for who goes first."""
    assert isinstance(make_negotiation(f"{mine}:First", Random(1)), OldestFirst)


@pytest.mark.parametrize(
    ("rest", "says"),
    [
        ("Other", "mine.py:Other: the file defines no class or function of that name"),
        ("THREE", "mine.py:THREE: the file defines no class or function of that name"),
        (
            "nothing",
            "mine.py:nothing: it makes None, which is no gate; expected the methods decide and moved",
        ),
        ("Mine:width=2", "mine.py:Mine: unknown option 'width'; its options are depth"),
        ("Mine:depth=much", "mine.py:Mine: depth is 'much'; expected a whole number"),
    ],
)
def test_what_a_file_does_not_hold(mine: Path, rest: str, says: str) -> None:
    """One line says what is wrong with the name."""
    with pytest.raises(GateError) as caught:
        make_gate(f"{mine}:{rest}", ring_of_three())
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("import nowhere", "bad.py:Mine: the file fails (ModuleNotFoundError: No module named 'nowhere')"),
        ("1 / 0", "bad.py:Mine: the file fails (ZeroDivisionError: division by zero)"),
        ("def :", "bad.py:Mine: the file fails (SyntaxError: invalid syntax"),
    ],
)
def test_a_file_that_fails(tmp_path: Path, text: str, says: str) -> None:
    """The reason is Python's; the scenario that names it is refused before anything runs."""
    file = tmp_path / "bad.py"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        Scenario.from_dict({"network": "n", "gate": f"{file}:Mine"})
    assert says in str(caught.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    """As with any other file."""
    with pytest.raises(GateError, match=r"none\.py:Mine: cannot read the Python file \(No such file"):
        make_gate(f"{tmp_path / 'none.py'}:Mine", ring_of_three())


def test_names_that_lead_into_files() -> None:
    """A path may hold colons and dots of its own; a name without a file is no such name."""
    assert in_file("a:b/c.py:Name:x=1,y=2:3") == ("a:b/c.py", "Name:x=1,y=2:3")
    assert in_file("certified:budget=3") is None
    assert in_file("mine.py") is None


def test_paths_in_a_scenario_are_relative_to_its_file(mine: Path) -> None:
    """Wherever it is read from."""
    file = mine.parent / "s.toml"
    file.write_text('network = "sumo:DRT"\ngate = "mine.py:Mine"', encoding="utf-8")
    assert read_scenario(file).gate == f"{mine}:Mine"


def test_installed_gates_keep_their_names() -> None:
    """A class of the package is the gate of that name, with all that goes with it."""
    assert name_gate(OpenGate) == "open"
    assert name_gate("certified:budget=3") == "certified:budget=3"


def test_a_class_at_hand_is_named_by_its_file() -> None:
    """Other processes find it there; this one takes the class itself."""
    name = name_gate(AtHand)
    where = in_file(name)
    assert where is not None
    assert (Path(where.file).resolve(), where.rest) == (Path(__file__).resolve(), "AtHand")
    assert type(make_gate(name, ring_of_three())) is AtHand


def test_what_stands_in_no_file_has_a_name_here() -> None:
    """A function in a function or a partial class works in this process and says so in its name."""
    made: list[System] = []

    def gate(system: System) -> CollisionGate:
        made.append(system)
        return CollisionGate(system)

    things = (gate, partial(gate), partial(AtHand))
    names = [name_gate(thing) for thing in things]
    assert all(name.startswith("here.") for name in names)
    assert [type(make_gate(name, ring_of_three())) for name in names] == [
        CollisionGate,
        CollisionGate,
        AtHand,
    ]
    assert len(made) == 2


def test_a_name_from_another_process() -> None:
    """It cannot be known here what it was."""
    with pytest.raises(GateError, match=r"gate here\.Lost: made in another program; write it to a file"):
        make_gate("here.Lost", ring_of_three())


def test_a_gate_that_is_made_already_is_refused() -> None:
    """It belongs to another system than that of the run."""
    with pytest.raises(
        GateError, match="CollisionGate: a run makes its gate for its own system; give the class"
    ):
        name_gate(CollisionGate(ring_of_three()))
    with pytest.raises(GateError, match="gate 3: expected a name, or a class or function"):
        name_gate(3)


def test_a_negotiation_that_is_made_already_is_taken() -> None:
    """It knows no system, so one that has learned something can be used as it is."""
    own = OldestFirst(Random(1))
    assert make_negotiation(name_negotiation(own), Random(2)) is own
    with pytest.raises(ScenarioError, match="which is none; expected the method order"):
        make_negotiation(name_negotiation(lambda rng: rng), Random(2))
