"""The computations behind Section 5, on the systems of Fig. 8 and Fig. 10."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from loopgate.gates import make_gate
from loopgate.gates.algorithm2 import circuits_through, theorem1
from loopgate.model import Configuration, RobotId, StateId, System
from loopgate.research.paper import printed
from loopgate.research.runs import RoundCounts, run_rounds
from loopgate.research.runs.counting import count_runs
from loopgate.research.runs.kernel_rounds import count_live_rounds
from loopgate.research.state_space import explore
from loopgate.research.state_space.encoding import Encoding
from loopgate.research.theory.instances import TABLE1_STARTS, fig7, instance
from loopgate.research.theory.orders import order


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the comparison: quantity, printed figure, our figure, reason of a difference."""

    what: str
    printed: str
    ours: str
    why: str = ""


@dataclass(frozen=True, slots=True)
class Evolution:
    """The printed evolution made again: configurations before each move and at the end, and the admitted."""

    configurations: tuple[Configuration, ...]
    admitted: tuple[tuple[RobotId, ...], ...]


def at_states(system: System, states: tuple[str, ...]) -> Configuration:
    """Return the configuration with the robots in given states, each at its first visit there."""
    names = [[str(s) for s in robot.path] for robot in system.robots]
    return system.configuration(path.index(state) for path, state in zip(names, states, strict=True))


def live_rounds(
    experiments: int, seed: int, progress: Callable[[int], None]
) -> tuple[list[Row], dict[int, float]]:
    """Compare the live rounds without avoidance: exactly, and by a number of `experiments` of each size.

    Returns the rows, and the mean number of live rounds by the number of rounds.
    """
    system = instance("fig10")
    exact = count_runs(system, make_gate("collision", system)).live_probability
    arrays = Encoding(system).arrays
    start = np.array(system.initial.positions, np.int64)
    rows: list[Row] = []
    means: dict[int, float] = {}
    for number, (rounds, live) in enumerate(printed.LIVE_ROUNDS.items()):
        counts = [
            count_live_rounds(
                rounds, seed + 1000 * number + k, start, arrays.after, arrays.state, arrays.room
            )
            for k in range(experiments)
        ]
        means[rounds] = sum(counts) / experiments
        spread = (rounds * exact * (1 - exact) / 100) ** 0.5
        off = (live - rounds * exact) / spread
        rows.append(
            Row(
                f"live rounds of {rounds}, no avoidance (mean of {experiments} experiments)",
                f"{live:g}",
                f"{means[rounds]:.2f} (exact mean {rounds * exact:.2f})",
                f"sampling: theirs is {off:+.1f} standard errors off the exact mean",
            )
        )
        progress(number + 1)
    rows.insert(0, Row("probability of a live round, no avoidance", "about 0.3", f"{exact:.6f} (exact)"))
    return rows, means


def with_algorithm2(rounds: int, seed: int, progress: Callable[[int], None]) -> tuple[list[Row], RoundCounts]:
    """Compare rounds under Algorithm 2, and explore it exhaustively."""
    system = instance("fig10")
    found = run_rounds(
        system, lambda: make_gate("algorithm2", system), rounds=rounds, seed=seed, progress=progress
    )
    all_of_it = explore(system, make_gate("algorithm2", system))
    slowest = max(found.decision_us.values(), key=lambda spent: spent["mean"])["mean"]
    return [
        Row("rounds that deadlock under Algorithm 2", "0", f"{found.deadlocked + found.stuck} of {rounds}"),
        Row(
            "transitions of a round under Algorithm 2",
            "27",
            f"{found.transitions['min']:g} to {found.transitions['max']:g}",
        ),
        Row(
            "configurations under Algorithm 2: all, stuck, not live",
            "not printed",
            f"{all_of_it.configurations}, {all_of_it.stuck}, {all_of_it.unsafe_admitted}",
            "explored exhaustively",
        ),
        Row(
            "prediction time, slowest robot's mean (Fig. 11)",
            "milliseconds",
            f"{slowest / 1000:.4f} ms",
            "another machine and language",
        ),
    ], found


def evolution() -> tuple[list[Row], Evolution]:
    """Repeat the printed evolution, and compare it with the text."""
    system = instance("fig10")
    gate = make_gate("algorithm2", system)
    here = system.initial
    seen = [here]
    admitted: list[tuple[RobotId, ...]] = []
    refused = 0
    for name in printed.MOVES:
        admitted.append(tuple(r.id for i, r in enumerate(system.robots) if gate.decide(here, i).admitted))
        refused += name not in admitted[-1]
        here = system.move(here, system.robot_number(RobotId(name)))
        seen.append(here)
    rows = [Row("moves of the printed evolution that are admitted", "27", str(len(printed.MOVES) - refused))]
    rows += [
        Row(f"who may move after {step} moves", " ".join(names), " ".join(admitted[step]))
        for step, names in printed.ADMITTED.items()
    ]
    rows += [
        Row(f"configuration of Fig. 12({panel})", " ".join(states), " ".join(system.describe(seen[step])))
        for panel, (step, states) in printed.SNAPSHOTS.items()
        if states is not None
    ]
    return rows, Evolution(tuple(seen), tuple(admitted))


def circuits() -> list[Row]:
    """Compare orders and Fig. 5 with the text."""
    system = instance("fig10")
    after = system.move(system.initial, 0)
    (circuit,) = circuits_through(system, after, system.states.index(StateId("s2")))
    rows = [Row("order of r1's first move (Fig. 10)", "5", str(order(system, after, circuit)))]
    for robots in range(4, 13):
        family = fig7(robots)
        (circuit,) = (
            c for c in circuits_through(family, family.initial, family.paths[0][0]) if len(c.walks) == robots
        )
        found = order(family, family.initial, circuit)
        rows.append(Row(f"order of Fig. 7 with {robots} robots", str(robots - 3), str(found)))
    five = instance("fig5")
    (circuit,) = circuits_through(five, five.initial, five.paths[0][0])
    verdict = theorem1(five, five.initial, circuit)
    mover = "" if verdict.mover is None else f", {five.robots[verdict.mover].id} moving"
    rows.append(
        Row("Fig. 5", "live", f"{'live' if verdict.live else 'not live'}: {verdict.condition.value}{mover}")
    )
    return rows


def table1() -> list[Row]:
    """Count Table 1 exactly."""
    system = instance("fig8")
    rows: list[Row] = []
    for states, (theirs, banker) in zip(TABLE1_STARTS, printed.TABLE1, strict=True):
        start = at_states(system, states)
        for name, gate, (nodes, leaves) in (("ours", "algorithm2", theirs), ("VBanker", "banker", banker)):
            runs = count_runs(system, make_gate(gate, system), start)
            same = (runs.sequences, runs.routes) == (nodes, leaves)
            share = 1 - nodes / runs.sequences
            rows.append(
                Row(
                    f"Table 1, ({', '.join(states)}), {name}: configurations, routes",
                    f"{nodes}, {leaves}",
                    f"{runs.sequences}, {runs.routes}",
                    "" if same else f"printed {share:.1%} lower than exact enumeration; it looks sampled",
                )
            )
    return rows
