"""Gates are found by name and made with their options."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest

from builders import ring_of_three
from loopgate import plugins
from loopgate.errors import GateError
from loopgate.gates import gate_names, make_gate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.open import OpenGate
from loopgate.model import System


class Tuned(OpenGate):
    """A gate with options, for these tests."""

    def __init__(self, system: System, *, depth: int = 1, share: float = 0.5, fair: bool = False) -> None:
        super().__init__(system)
        self.options = (depth, share, fair)


def test_the_gates_of_the_package_are_there() -> None:
    """Names come sorted."""
    names = gate_names()
    assert names == sorted(names)
    assert {"open", "collision"} <= set(names)


def test_a_gate_is_made_by_name() -> None:
    """Without options the name is all there is."""
    assert isinstance(make_gate("collision", ring_of_three()), CollisionGate)


def test_every_registered_gate_can_be_made() -> None:
    """An entry point that names nothing would fail only when somebody asks for it."""
    for name in gate_names():
        assert hasattr(make_gate(name, ring_of_three()), "decide")


def test_options_are_read_by_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whole numbers, decimal numbers and truth values reach the gate as such."""
    point = EntryPoint("tuned", f"{__name__}:Tuned", "loopgate.gates")
    monkeypatch.setattr(EntryPoint, "load", lambda _: Tuned)
    monkeypatch.setattr(plugins, "_installed", lambda _: {point.name: point})
    gate = make_gate("tuned:depth=3,share=0.25,fair=true", ring_of_three())
    assert isinstance(gate, Tuned)
    assert repr(gate.options) == "(3, 0.25, True)"


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("closed", "gate closed: there is no such gate; installed are"),
        ("open:depth=3", "gate open: unknown option 'depth'; it has no options"),
        ("open:depth", "gate open:depth: 'depth' is no option; write name=value"),
        ("open:=3", "'=3' is no option"),
    ],
)
def test_a_bad_name_is_refused(name: str, says: str) -> None:
    """The error says what there is instead."""
    with pytest.raises(GateError) as caught:
        make_gate(name, ring_of_three())
    assert says in str(caught.value)


@pytest.mark.parametrize("name", ["banker", "certified", "collision"])
def test_a_gate_needs_a_system(name: str) -> None:
    """Whatever else it is given is told, and not what the gate stumbles on."""
    with pytest.raises(GateError, match=f"gate {name}: system is None; expected a System"):
        make_gate(name, None)  # type: ignore[arg-type]
