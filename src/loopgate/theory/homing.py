"""Liveness where every robot has a private state: can all get there, by plain search with memory."""

from __future__ import annotations

from loopgate.model import Configuration, System
from loopgate.theory.deadlocks import homes_decide_liveness

__all__ = ["Homing"]


class Homing:
    """Decides liveness exactly where private states decide it, without looking at all configurations.

    Robots in private states stay there, the others move in every order until all are in private states or
    nobody can move. What was found dead or live is remembered. Plain enough to judge gates by, and quicker
    than the oracle where systems are large and mostly live.

    Parameters
    ----------
    system
        Every robot has a private state, on an open path as its terminal state; capacities and FIFO states
        are welcome.

    Raises
    ------
    ValueError
        If the system is not of that kind.

    Notes
    -----
    Exponential at worst; see `loopgate.theory.oracle`.
    """

    name = "homing"

    def __init__(self, system: System) -> None:
        if not homes_decide_liveness(system):
            msg = "some robot has no private state"
            raise ValueError(msg)
        self._system = system
        self._private = [[system.private[s] for s in path] for path in system.paths]
        self._known: dict[Configuration, bool] = {}

    def live(self, configuration: Configuration) -> bool:
        """Return whether all robots can get to private states from `configuration`."""
        known = self._known.get(configuration)
        if known is not None:
            return known
        system = self._system
        away = [i for i, p in enumerate(configuration.positions) if not self._private[i][p]]
        found = not away or any(
            self.live(system.moved(configuration, i)) for i in away if system.enabled(configuration, i)
        )
        self._known[configuration] = found
        return found
