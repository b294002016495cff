"""How a gate is asked: gates that follow the moves, and gates of a user, whose answers are checked."""

import inspect
from abc import ABC, abstractmethod
from typing import Any

from loopgate.errors import PluginError
from loopgate.gates.base import Decision, FollowingGate, Gate, Reason
from loopgate.model import Configuration, MutableConfiguration, Placement, System
from loopgate.plugins import blaming, is_ours, name_of_class, takes
from loopgate.reading import is_plain, shown

_DECISION = "a Decision (loopgate.gates.Decision)"
_CALLS = {"decide": ("configuration", "robot"), "moved": ("configuration", "robot")}
_CALLS_HERE = {"decide_here": ("robot",), "moved_here": ("robot",)}


class _Careful:
    """Calls a gate that a user wrote, and checks its answers.

    It does not have the gate's other attributes: read these from the gate itself.
    """

    def __init__(self, gate: Gate, system: System) -> None:
        self._gate = gate
        self._system = system
        self._name = f"gate {name_of_class(gate)}"

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        with blaming(f"{self._name}: decide", _DECISION):
            decision = self._gate.decide(configuration, robot)
        return self._checked(decision, robot, "decide")

    def moved(self, configuration: Configuration, robot: int) -> None:
        with blaming(f"{self._name}: moved", "it to take note of a move"):
            self._gate.moved(configuration, robot)

    def _checked(self, decision: object, robot: int, call: str) -> Decision:
        if isinstance(decision, Decision):
            with blaming(f"{self._name}: the answer of {call}", _DECISION):
                wrong = _wrong_with(decision, len(self._system.robots))
            if not wrong:
                return decision
            what = f"a Decision whose {wrong}"
        else:
            what = f"{shown(decision)}; expected {_DECISION}"
        if inspect.iscoroutine(decision):
            decision.close()  # else Python warns that nobody waited for it
        msg = f"{self._name}: {call} returned, for robot {self._system.robots[robot].id}, {what}"
        raise PluginError(msg)


class _CarefulFollowing(_Careful):
    """Calls a user's gate that follows the moves itself, and checks its answers."""

    def __init__(self, gate: FollowingGate, system: System) -> None:
        super().__init__(gate, system)
        self._following = gate

    def decide_here(self, robot: int) -> Decision:
        with blaming(f"{self._name}: decide_here", _DECISION):
            decision = self._following.decide_here(robot)
        return self._checked(decision, robot, "decide_here")

    def moved_here(self, robot: int) -> None:
        with blaming(f"{self._name}: moved_here", "it to take note of a move"):
            self._following.moved_here(robot)


def careful(gate: Gate, system: System) -> Gate:
    """Return a function that asks a gate; it raises `PluginError` if the gate fails or gives no answer.

    The package's own gates are returned as they are. Ask the returned object, but read attributes such as
    ``promise``, and the class, from the gate itself.
    """
    if is_ours(gate):
        return gate
    follows = following(gate)
    return _Careful(gate, system) if follows is None else _CarefulFollowing(follows, system)


def check_methods(gate: Gate, name: str) -> None:
    """Raise `PluginError` if a method of a gate cannot be called as gates are called."""
    calls = _CALLS if following(gate) is None else _CALLS | _CALLS_HERE
    for method, given in calls.items():
        wrong = takes(getattr(gate, method), *given)
        if wrong:
            msg = f"gate {name}: {method} {wrong}; expected {method}({', '.join(('self', *given))})"
            raise PluginError(msg)


def _wrong_with(decision: Any, robots: int) -> str:  # noqa: ANN401  its parts may be anything
    """Return the error in an answer and the expected answer; empty if there is no error."""
    if not isinstance(decision.admitted, bool):
        return f"admitted is {shown(decision.admitted)}; expected True or False"
    if not isinstance(decision.reason, Reason):
        return f"reason is {shown(decision.reason)}; expected a Reason (loopgate.gates.Reason)"
    for name, text in (("detail", decision.detail), ("stage", decision.stage)):
        if not isinstance(text, str) or not is_plain(text):
            return f"{name} is {shown(text)}; expected a text of one line"
    if not _is_count(decision.messages):
        return f"messages is {shown(decision.messages)}; expected a whole number from 0 up"
    others = decision.blockers
    if not isinstance(others, tuple | list) or not all(_is_count(o) and o < robots for o in others):
        return f"blockers is {shown(others)}; expected numbers of robots, 0 to {robots - 1}"
    return ""


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


_DECIDING = ("decide", "decide_here")


class Follower(ABC):
    """A gate that decides by the positions of robots only; see `FollowingGate`.

    A class declares that it follows with ``follows=True``. A class derived from it does not follow unless it
    declares so too: its decisions may depend on past configurations.
    """

    follows = False

    def __init_subclass__(cls, *, follows: bool = False) -> None:
        cls.follows = follows

    def __init__(self, system: System) -> None:
        self._system = system
        self._here = MutableConfiguration(system.initial)

    @abstractmethod
    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`."""

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Do nothing: the gate has no memory."""
        del configuration, robot

    def _trial(self, configuration: Placement) -> MutableConfiguration:
        """Return a configuration in which a move can be made and undone."""
        return self._here if configuration is self._here else MutableConfiguration(configuration)

    def decide_here(self, robot: int) -> Decision:
        """Decide the next move of `robot` in the configuration after all known moves."""
        return self.decide(self._here, robot)

    def moved_here(self, robot: int) -> None:
        """Record that `robot` has made an admitted move."""
        self._system.make(self._here, robot)


def following(gate: Gate) -> FollowingGate | None:
    """Return the gate if it follows the moves itself; None if it needs to be given configurations."""
    if isinstance(gate, Follower):
        return gate if gate.follows else None
    return gate if isinstance(gate, FollowingGate) and not _decides_anew(gate) else None


def _decides_anew(gate: FollowingGate) -> bool:
    """Return whether a subclass of a following gate has its own `decide`, but no `decide_here`."""
    homes = [next((k for k in type(gate).__mro__ if name in vars(k)), None) for name in _DECIDING]
    anew, here = homes
    return anew is not here and anew is not None and here is not None and issubclass(anew, here)
