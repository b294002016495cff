"""Who says exactly whether a configuration is safe: the judges of a gate's decisions."""

from __future__ import annotations

from typing import Protocol

from loopgate.model import Configuration, System
from loopgate.theory.acyclicity import AcyclicityError, live_by_order
from loopgate.theory.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.theory.homing import Homing
from loopgate.theory.oracle import Oracle, OracleLimitError

__all__ = ["ByDeadlocks", "ByOracle", "Judge", "judge_for"]

_SEARCHED = 10
"""Beyond so many robots the solver judges, where it can; below, plain search is quicker."""


class Judge(Protocol):
    """The exact answer: may the robots go on for ever from here."""

    name: str

    def live(self, configuration: Configuration) -> bool:
        """Return the answer."""
        ...


class _BySat:
    name = "sat"

    def __init__(self, system: System) -> None:
        self._system = system
        self.live(system.initial)  # raises at once where the system is not of a kind it covers

    def live(self, configuration: Configuration) -> bool:
        return live_by_order(self._system, configuration)


class ByOracle(Oracle):
    """Judges by looking at everything that can be reached."""

    name = "oracle"


class ByDeadlocks:
    """Judges a gate that promises that somebody can always move: there must be no circular wait."""

    name = "deadlocks"

    def __init__(self, system: System) -> None:
        self._system = system

    def live(self, configuration: Configuration) -> bool:
        """Return whether nobody waits in a circle."""
        return not deadlocked_robots(self._system, configuration)


def judge_for(system: System, limit: int) -> Judge | None:
    """Return who can judge `system` from any configuration on, or None if it is too large for all."""
    if homes_decide_liveness(system):
        return _judge_by_homes(system)
    oracle = ByOracle(system, limit=limit)
    try:
        oracle.live(system.initial)
    except OracleLimitError:
        return None
    return oracle


def _judge_by_homes(system: System) -> Judge:
    if len(system.robots) > _SEARCHED:
        try:
            return _BySat(system)
        except AcyclicityError:
            pass
    return Homing(system)
