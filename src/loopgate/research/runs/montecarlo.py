"""Monte Carlo rounds: at each step an admitted robot, drawn at random, moves."""

import math
import random
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from loopgate.gates import Gate
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.gates.following import careful
from loopgate.model import RobotId, System

_Z95 = 1.959964


@dataclass(frozen=True, slots=True)
class RoundCounts:
    """The number of rounds with each outcome."""

    rounds: int
    seed: int
    live: int
    """Rounds that all robots completed: open paths to their ends, closed paths once."""
    deadlocked: int
    """Rounds that ended with a circular wait (Def. 3)."""
    stuck: int
    """Rounds that ended without a circular wait because the gate admitted no move."""
    live_rate: float
    confidence: tuple[float, float]
    """`live_rate` and `confidence`: share of live rounds, and its 95 % interval (Wilson)."""
    transitions: dict[str, float]
    """Mean, least and most transitions of a round."""
    decision_us: dict[RobotId, dict[str, float]]
    """Mean and 99th percentile of the gate's decision time per robot [microseconds]."""
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """Return the counts as a JSON object."""
        return {**asdict(self), "seconds": round(self.seconds, 3)}


def wilson_interval(hits: int, trials: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a proportion (Wilson score)."""
    if trials == 0:
        return 0.0, 1.0
    share = hits / trials
    spread = _Z95 * math.sqrt(share * (1 - share) / trials + _Z95**2 / (4 * trials**2))
    middle = share + _Z95**2 / (2 * trials)
    scale = 1 + _Z95**2 / trials
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)


def run_rounds(
    system: System,
    make: Callable[[], Gate],
    *,
    rounds: int,
    seed: int,
    progress: Callable[[int], None] = lambda _: None,
) -> RoundCounts:
    """Play rounds of random moves from the start, and count how they end.

    A round ends when each robot has gone through its path once, or some robots wait for each other for good
    (`deadlocked`), or no robot may move (`stuck`).

    At each step one of the admitted robots moves, drawn uniformly, as in Section 5.1 of Zhou et al. 2020. A
    robot on a closed path goes on after its first lap, so that it is not in the way of other robots.

    Parameters
    ----------
    make
        Function that makes a new gate for each round, since gates may remember moves.
    rounds, seed
        Number of rounds, and seed of the random numbers.
    """
    began = time.perf_counter()
    rng = random.Random(seed)
    ends = {"live": 0, "deadlocked": 0, "stuck": 0}
    lengths: list[int] = []
    times: list[list[float]] = [[] for _ in system.robots]
    for number in range(rounds):
        end, length = _round(system, careful(make(), system), rng, times)
        ends[end] += 1
        lengths.append(length)
        progress(number + 1)
    return RoundCounts(
        rounds=rounds,
        seed=seed,
        live=ends["live"],
        deadlocked=ends["deadlocked"],
        stuck=ends["stuck"],
        live_rate=ends["live"] / rounds if rounds else 0.0,
        confidence=wilson_interval(ends["live"], rounds),
        transitions={
            "mean": statistics.fmean(lengths) if lengths else 0.0,
            "min": min(lengths, default=0),
            "max": max(lengths, default=0),
        },
        decision_us={robot.id: _times(some) for robot, some in zip(system.robots, times, strict=True)},
        seconds=time.perf_counter() - began,
    )


def _times(seconds: list[float]) -> dict[str, float]:
    ordered = sorted(seconds) or [0.0]
    p99 = ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))]
    return {"mean": round(1e6 * statistics.fmean(ordered), 3), "p99": round(1e6 * p99, 3)}


def _round(system: System, gate: Gate, rng: random.Random, times: list[list[float]]) -> tuple[str, int]:
    here = system.initial
    left = [len(path) for path in system.paths]
    for robot, entry in enumerate(system.robots):
        if entry.next_position(len(entry.path) - 1) is None:
            left[robot] -= 1 + entry.start
    length = 0
    while any(count > 0 for count in left):
        admitted: list[int] = []
        for robot, spent in enumerate(times):
            if system.finished(here, robot):
                continue
            begin = time.perf_counter()
            decision = gate.decide(here, robot)
            spent.append(time.perf_counter() - begin)
            if decision.admitted and system.enabled(here, robot):
                admitted.append(robot)
        # Others may be able to move for ever beside a deadlock, so it ends the round at once.
        if len(admitted) < len(left) and deadlocked_robots(system, here):
            return "deadlocked", length
        if not admitted:
            return "stuck", length
        robot = rng.choice(admitted)
        here = system.moved(here, robot)
        gate.moved(here, robot)
        left[robot] -= 1
        length += 1
    return "live", length
