"""Explores all states of the protocol that are reachable from a start, and checks each."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from loopgate.research.vehicles.world import Receive, World, circle, misled, overfull, steps
from loopgate.vehicles import post as posts


@dataclass(slots=True)
class Explored:
    """The findings of an exploration.

    Attributes
    ----------
    states, transitions
        How many.
    complete
        Whether these are all.
    circles, overfull, misled
        States with full places in a circle; with more vehicles in a place than fit; with books that lack a
        vehicle or have another order.
    stuck
        Groups of states in which all may stay for good, though each message gets through.
    """

    states: int = 0
    transitions: int = 0
    complete: bool = True
    circles: int = 0
    overfull: int = 0
    misled: int = 0
    stuck: int = 0
    example: World | None = field(default=None, repr=False)

    @property
    def wrong(self) -> int:
        """The number of wrong states and groups."""
        return self.circles + self.overfull + self.misled + self.stuck


def explore(
    start: World,
    *,
    limit: int,
    most: int = 4,
    seen: bool = True,
    receive: Receive = posts.receive,
) -> Explored:
    """Look at all that can come about from `start`: messages lost, late, in any order.

    Parameters
    ----------
    limit
        Most states.
    most
        How many messages are in flight at a time; what leads to more is left out.
    seen, receive
        See `loopgate.research.vehicles.world.steps`.

    Notes
    -----
    Nobody can stay for good iff no strongly connected group of states, by steps that are sure to come and
    by which nobody goes, is *fair*: each step that can be made in all states of it is made in it. (Steps are
    told apart by name alone, which may find too much and never too little.) Groups from which a step was left
    out are not judged.
    """
    found = Explored()
    searched = search(
        start,
        limit=limit,
        steps=lambda here: (
            (step.what, step.after, step.sure, step.goes is not None)
            for step in steps(here, receive, seen=seen)
        ),
        judge=lambda here: _judge(here, found),
        leave_out=lambda after: len(after.flight) > most,
    )
    found.states, found.transitions = searched.states, searched.transitions
    found.complete, found.stuck = searched.complete, searched.stuck
    return found


S = TypeVar("S")
Next = tuple[tuple[object, ...], S, bool, bool]
"""The name of a step, what comes of it, whether it is sure to come, and whether somebody goes by it."""


@dataclass(slots=True)
class Searched:
    """The result of a search: states, steps, whether complete, and groups in which all may stay."""

    states: int = 0
    transitions: int = 0
    complete: bool = True
    stuck: int = 0


def search(
    start: S,
    *,
    limit: int,
    steps: Callable[[S], Iterable[Next[S]]],
    judge: Callable[[S], None],
    leave_out: Callable[[S], bool],
    done: Callable[[S], bool] = lambda _: False,
) -> Searched:
    """Look at all that can come about from `start`; see `explore` for groups in which all may stay.

    Parameters
    ----------
    limit
        Most states.
    steps
        Yields what can happen next.
    judge
        Called once with each state.
    leave_out
        Whether what leads to a state is left out.
    done
        Whether nobody need go on.
    """
    searched = Searched()
    number, todo = {start: 0}, [start]
    edges: list[tuple[int, int, int]] = []
    names: dict[tuple[object, ...], int] = {}
    can: list[frozenset[int]] = []
    cut: set[int] = set()
    while todo and searched.complete:
        fresh: list[S] = []
        for here in todo:
            judge(here)
            sure = set()
            for what, after, is_sure, goes in steps(here):
                if leave_out(after):
                    cut.add(number[here])
                    continue
                searched.transitions += 1
                there = number.get(after)
                if there is None:
                    there = number[after] = len(number)
                    fresh.append(after)
                if is_sure:
                    name = names.setdefault(what, len(names))
                    sure.add(name)
                    if not goes:
                        edges.append((number[here], there, name))
            can.append(frozenset({-1}) if done(here) else frozenset(sure))
            if len(number) > limit:
                searched.complete = False
                break
        todo = fresh
    searched.states = len(number)
    if searched.complete:
        searched.stuck = stuck_groups(len(number), edges, can, cut)
    return searched


def _judge(here: World, found: Explored) -> None:
    wrong = bool(circle(here)), bool(overfull(here)), bool(misled(here))
    found.circles += wrong[0]
    found.overfull += wrong[1]
    found.misled += wrong[2]
    if any(wrong) and found.example is None:
        found.example = here


def stuck_groups(
    states: int, edges: list[tuple[int, int, int]], can: list[frozenset[int]], cut: set[int]
) -> int:
    """Return in how many groups of states all may stay for good; see `explore`.

    Parameters
    ----------
    edges
        From, to, and the name of the step, of those that are sure to come and by which nobody goes.
    can
        Names of the steps that are sure to come, by state.
    cut
        States from which a step was left out.
    """
    table = np.array(edges, np.int64).reshape(-1, 3)
    tails, heads = table[:, 0], table[:, 1]
    ones = np.ones(len(table), np.int8)
    part = connected_components(csr_array((ones, (tails, heads)), (states, states)), connection="strong")[1]
    done: defaultdict[int, set[int]] = defaultdict(set)
    for tail, head, name in edges:
        if part[tail] == part[head]:
            done[int(part[tail])].add(name)
    always: dict[int, frozenset[int]] = {}
    for state, group in enumerate(part.tolist()):
        always[group] = always[group] & can[state] if group in always else can[state]
    unsure = {int(part[state]) for state in cut}
    return sum(always[group] <= done[group] for group in always if group not in unsure)
