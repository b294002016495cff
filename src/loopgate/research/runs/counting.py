"""Exact figures of all runs from a configuration, by dynamic programming."""

from dataclasses import dataclass

from loopgate.errors import SystemModelError
from loopgate.gates import Gate
from loopgate.gates.following import careful
from loopgate.model import Configuration, System


@dataclass(frozen=True, slots=True)
class Runs:
    """All possible runs from a configuration under a gate."""

    live_probability: float
    """Probability that every robot comes to its end, if at each step a robot drawn uniformly among the
    admitted ones moves."""
    transitions: float
    """Mean number of moves of a run."""
    sequences: int
    """Nodes of the tree of all move sequences, without its root: what Table 1 of Zhou et al. 2020 calls
    configurations."""
    routes: int
    """Its leaves in which every robot is at its end: what the table calls routes."""
    configurations: int
    """Different configurations."""


def count_runs(system: System, gate: Gate, start: Configuration | None = None) -> Runs:
    """Count all runs from `start` (the system's own start if not given).

    O(configurations * robots) decisions. The gate's decisions must depend on the configuration alone. Raises
    `SystemModelError` if a path is closed: runs would have no end.
    """
    for robot in system.robots:
        if robot.next_position(len(robot.path) - 1) is not None:
            msg = f"robot {robot.id}: its path is closed; runs are counted on open paths only"
            raise SystemModelError(msg)
    first, gate = system.initial if start is None else start, careful(gate, system)
    known: dict[Configuration, tuple[float, float, int, int]] = {}
    stack = [first]
    while stack:
        here = stack[-1]
        moves = [
            system.moved(here, robot)
            for robot in range(len(system.robots))
            if here not in known and system.enabled(here, robot) and gate.decide(here, robot).admitted
        ]
        missing = [after for after in moves if after not in known]
        if missing:
            stack.extend(missing)
            continue
        stack.pop()
        if here in known:
            continue
        if not moves:
            end = all(system.finished(here, robot) for robot in range(len(system.robots)))
            known[here] = (float(end), 0.0, 0, int(end))
            continue
        after_all = [known[after] for after in moves]
        known[here] = (
            sum(after[0] for after in after_all) / len(moves),
            1.0 + sum(after[1] for after in after_all) / len(moves),
            sum(1 + after[2] for after in after_all),
            sum(after[3] for after in after_all),
        )
    return Runs(*known[first], configurations=len(known))
