"""Exploring and checking with sets of configurations: slow, short, and without the code that is tested."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from loopgate.gates import Gate, Reason
from loopgate.gates.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.model import Configuration, System
from loopgate.research.state_space import Counterexample, ExplorationFigures, Verification
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.orders import Orders

oracle_of = lru_cache(maxsize=8)(Oracle)
"""One for all gates that are asked about a system, since what it finds out does not depend on them."""


def successors(system: System, here: Configuration) -> dict[int, Configuration]:
    """Return where each robot's move leads that is possible."""
    robots = range(len(system.robots))
    return {i: system.move(here, i) for i in robots if system.enabled(here, i)}


def finished(system: System, here: Configuration) -> bool:
    """Return whether all robots stay for good."""
    return all(system.finished(here, i) for i in range(len(system.robots)))


def everything(system: System) -> set[Configuration]:
    """Return what can be reached from the start."""
    seen, todo = {system.initial}, [system.initial]
    while todo:
        new = set(successors(system, todo.pop()).values()) - seen
        seen |= new
        todo += new
    return seen


def can_be_kept(system: System) -> set[Configuration]:
    """Return from where somebody can move for ever without any circular wait.

    Strikes out circular waits, then whatever leads only to what is struck out.
    """
    kept = {here for here in everything(system) if not deadlocked_robots(system, here)}
    while struck := {
        here
        for here in kept
        if not finished(system, here) and kept.isdisjoint(successors(system, here).values())
    }:
        kept -= struck
    return kept


def judge_of(system: System, gate: Gate) -> Callable[[Configuration], bool]:
    """Return what says whether a configuration keeps the gate's promise."""
    if getattr(gate, "promise", "everyone") == "everyone":
        return oracle_of(system).live
    return can_be_kept(system).__contains__


@dataclass
class _Visit:
    here: Configuration
    way: list[int]
    answers: list[bool]
    moves: dict[int, Configuration]
    budget_stops: int

    @property
    def admitted(self) -> dict[int, Configuration]:
        return {i: there for i, there in self.moves.items() if self.answers[i]}


def visits(system: System, gate: Gate) -> list[_Visit]:
    """Return every configuration that the gate lets come about, and its answers there, breadth first."""
    ways: dict[Configuration, list[int]] = {system.initial: []}
    todo = deque([system.initial])
    found: list[_Visit] = []
    while todo:
        here = todo.popleft()
        decisions = [gate.decide(here, i) for i in range(len(system.robots))]
        stops = sum(decision.reason is Reason.BUDGET for decision in decisions)
        visit = _Visit(here, ways[here], [d.admitted for d in decisions], successors(system, here), stops)
        found.append(visit)
        for robot, there in visit.admitted.items():
            if there not in ways:
                ways[there] = [*visit.way, robot]
                todo.append(there)
    return found


def explore_plainly(system: System, gate: Gate) -> ExplorationFigures:
    """Find what `loopgate.research.state_space.explore` finds, with a counterexample."""
    safe, live = judge_of(system, gate), oracle_of(system).live
    orders, ordered = Orders(system), homes_decide_liveness(system)
    by_order: dict[str, int] = {}
    counterexample: Counterexample | None = None
    every = visits(system, gate)
    stuck = 0
    for visit in every:
        here = visit.here
        is_stuck = not visit.admitted and not finished(system, here)
        stuck += is_stuck
        if ordered and not live(here) and not deadlocked_robots(system, here):
            order = orders.of_configuration(here)
            key = "unordered" if order is None else str(order)
            by_order[key] = by_order.get(key, 0) + 1
        if counterexample is None and (is_stuck or not safe(here)):
            names = tuple(system.robots[i].id for i in visit.way)
            counterexample = Counterexample("stuck" if safe(here) else "unsafe", names, system.describe(here))
    return ExplorationFigures(
        configurations=len(every),
        transitions=sum(len(visit.admitted) for visit in every),
        live=sum(live(visit.here) for visit in every),
        deadlocks=sum(bool(deadlocked_robots(system, visit.here)) for visit in every),
        higher_order=by_order if ordered else None,
        stuck=stuck,
        unsafe_admitted=sum(not safe(visit.here) for visit in every[1:]),
        seconds=0.0,
        counterexample=counterexample,
    )


def verify_plainly(system: System, gate: Gate) -> dict[str, int]:
    """Count what `loopgate.research.state_space.verify_everywhere` counts, from a start that is safe."""
    safe = judge_of(system, gate)
    every = visits(system, gate)
    decided = [(there, visit.answers[i]) for visit in every for i, there in visit.moves.items()]
    judged = [(safe(there), answer) for there, answer in decided]
    kept, todo = {system.initial}, [system.initial]
    while todo:
        new = {there for there in successors(system, todo.pop()).values() if safe(there)} - kept
        kept |= new
        todo += new
    return {
        "configurations": len(every),
        "decisions": len(decided),
        "safe": sum(good for good, _ in judged),
        "safe_admitted": sum(good and answer for good, answer in judged),
        "unsafe_admitted": sum(answer and not good for good, answer in judged),
        "stuck": sum(not visit.admitted and not finished(system, visit.here) for visit in every),
        "disabled_admitted": sum(sum(visit.answers) - len(visit.admitted) for visit in every),
        "budget_stops": sum(visit.budget_stops for visit in every),
        "explored": len(every),
        "reachable_live": len(kept),
        "deadlocks": sum(bool(deadlocked_robots(system, visit.here)) for visit in every),
    }


def counted(found: Verification) -> dict[str, int]:
    """Return the counts of a check that `verify_plainly` makes again."""
    figures = found.as_dict()
    names = ("configurations", "decisions", "safe", "safe_admitted", "unsafe_admitted", "stuck")
    more = ("disabled_admitted", "budget_stops", "explored", "reachable_live", "deadlocks")
    return {name: figures[name] for name in (*names, *more)}
