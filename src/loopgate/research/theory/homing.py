"""Liveness where homes decide it: can all robots get home, by plain search with memory."""

from loopgate.gates.deadlocks import homes_decide_liveness
from loopgate.model import Configuration, System


class Homing:
    """Decides liveness exactly where homes decide it, without looking at all configurations.

    Robots on closed paths stay in the first private state they come to, those on open paths drive to their
    ends; they move in every order until all are there or nobody can move. What was found dead or live is
    remembered. Plain enough to judge gates by, and quicker than the oracle where systems are large and
    mostly live.

    `system`: see `homes_decide_liveness`; capacities and FIFO states are welcome. Exponential at worst; see
    `loopgate.research.theory.oracle`. Raises `ValueError` if the system is not of that kind.
    """

    def __init__(self, system: System) -> None:
        if not homes_decide_liveness(system):
            msg = "some robot on a closed path has no private state, or passes another's end"
            raise ValueError(msg)
        self._system = system
        self._home = [
            [
                system.private[s] if robot.next_position(len(path) - 1) is not None else p == len(path) - 1
                for p, s in enumerate(path)
            ]
            for robot, path in zip(system.robots, system.paths, strict=True)
        ]
        self._known: dict[Configuration, bool] = {}

    def live(self, configuration: Configuration) -> bool:
        """Return whether all robots can get home from `configuration`."""
        known = self._known.get(configuration)
        if known is not None:
            return known
        system = self._system
        away = [i for i, p in enumerate(configuration.positions) if not self._home[i][p]]
        found = not away or any(
            self.live(system.moved(configuration, i)) for i in away if system.enabled(configuration, i)
        )
        self._known[configuration] = found
        return found
