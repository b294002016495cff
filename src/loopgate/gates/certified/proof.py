"""Proofs that a configuration is dead, as a list of steps that a checker follows without searching."""

from itertools import groupby
from typing import Any

from loopgate.gates.certified.banker import reduce_to_core
from loopgate.gates.certified.occupancy import Occupancy, stuck_for_good
from loopgate.gates.certified.search import BudgetError, parts_of
from loopgate.gates.certified.system_index import SystemIndex

_MOST_LINES = 100_000


def wait_after(stand: Occupancy, robot: int) -> dict[str, Any] | None:
    """Return the certificate that names the robots stuck after a move of `robot`; None if all can move."""
    there, robots = stand.after(robot), stand.layout.system.robots
    stuck = stuck_for_good(there, range(len(there.at)))
    return {"kind": "wait", "robots": [robots[i].id for i in stuck]} if stuck else None


def dead_after(stand: Occupancy, robot: int, kind: str) -> dict[str, Any] | None:
    """Return a proof that not all robots can get home after a move of `robot`; None if it is too long."""
    try:
        waiting = wait_after(stand, robot)
        lines = None if waiting else Prover(stand.layout, _MOST_LINES).prove(stand.after(robot))
    except BudgetError:
        return None
    return waiting or (None if lines is None else {"kind": kind, "proof": lines})


class Prover:
    """Repeats an exact search, and writes down why each configuration in it is dead.

    Each line of a proof is a set of robots with their positions (others are absent, which only makes it
    easier to get home) and a reason why they cannot all get home:

    - ``wait``: robots that can never move again, because each waits for others of them.
    - ``harmless``: moves that block no robot, and the earlier line about what is left then (``to``).
    - ``moves``: for every robot that can move, an earlier line about what follows.
    """

    def __init__(self, layout: SystemIndex, budget: int) -> None:
        self._layout = layout
        self._budget = budget
        self._names = [robot.id for robot in layout.system.robots]
        self._settlers = [i for i, s in enumerate(layout.settles) if s >= 0]
        self.lines: list[dict[str, Any]] = []
        self._known: dict[str, int] = {}

    def prove(self, stand: Occupancy) -> list[dict[str, Any]] | None:
        """Return a proof that not all robots can get home from `stand`; None if they can.

        The last line is about `stand`.

        Raises `BudgetError` if more lines than the budget would be needed.
        """
        self.lines, self._known = [], {}
        home = self._layout.home
        away = [i for i, p in enumerate(stand.at) if not home[i][p]]
        return None if self._dead(stand, away) is None else self.lines

    def _dead(self, stand: Occupancy, robots: list[int]) -> int | None:
        there = stand.copy()
        moves, core = reduce_to_core(there, robots)
        if not core:
            return None
        last = self._dead_core(there, core)
        if last is None or (not moves and set(self.lines[last]["at"]) >= {self._names[i] for i in robots}):
            return last
        runs = [[self._names[i], len(list(run))] for i, run in groupby(moves)]
        return self._line(stand, robots, {"harmless": runs, "to": last})

    def _dead_core(self, stand: Occupancy, core: list[int]) -> int | None:
        stuck = stuck_for_good(stand, core)
        if stuck:
            return self._line(stand, core, {"wait": [self._names[i] for i in stuck]})
        for part in parts_of(stand, core):
            line = self._branch(stand, part)
            if line is not None:
                return line
        return None

    def _branch(self, stand: Occupancy, part: list[int]) -> int | None:
        known = self._known.get(repr(self._about(stand, part)))
        if known is not None:
            return known
        follow: dict[str, int] = {}
        for i in part:
            if stand.enabled(i):
                line = self._dead(stand.after(i), part)
                if line is None:
                    return None
                follow[self._names[i]] = line
        return self._line(stand, part, {"moves": follow})

    def _about(self, stand: Occupancy, robots: list[int]) -> dict[str, Any]:
        settled = [i for i in self._settlers if self._layout.home[i][stand.at[i]]]
        who = sorted({*robots, *settled})
        lines = {
            self._layout.system.states[s]: [self._names[i] for i in queue if i in who]
            for s, queue in stand.queue.items()
        }
        order = {s: queue for s, queue in lines.items() if len(queue) > 1}
        return {"at": {self._names[i]: stand.at[i] for i in who}, "order": order}

    def _line(self, stand: Occupancy, robots: list[int], reason: dict[str, Any]) -> int:
        if len(self.lines) >= self._budget:
            raise BudgetError
        about = self._about(stand, robots)
        self._known.setdefault(repr(about), len(self.lines))
        self.lines.append({**about, **reason})
        return len(self.lines) - 1
