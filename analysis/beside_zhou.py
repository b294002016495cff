"""Vehicles and posts that decide by messages, beside Algorithm 2 of Zhou et al. 2020 by messages.

    python analysis/beside_zhou.py            # two minutes: writes the tables of docs/studies/beside-zhou.md
    python analysis/beside_zhou.py --seeds 3

The paper's systems hold one robot a state. There robots decide and negotiate by messages
(`loopgate.research.agents`). The same paths are then run by posts and vehicles: each state is a place of two,
first in, first out, with the paper's robots, and with two of each. Then one decision in a family that grows.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

from vehicles_alone import WRONG, judged

from loopgate.gates import make_gate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.agents import Kind, decide_by_messages, run_agents
from loopgate.research.agents.run import DistributedRun
from loopgate.research.state_space import ExplorationLimitError, explore
from loopgate.research.theory.instances import fig7, instance
from loopgate.research.theory.random_systems import dense, random_system
from loopgate.research.vehicles.walk import Walk
from loopgate.research.vehicles.world import World, begin, circle
from loopgate.vehicles import post as posts
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import Grant, Message, Moved, Offer, Refuse, Room, Why

OUT = Path(__file__).with_name("tables") / "beside-zhou.md"
SLOTS, LAYER = 2, 3
MOST_ROUNDS = 40
"""For each robot: who has not gone round by then, does not."""
NEGOTIATION = {Kind.DELAY, Kind.GRANT, Kind.CLAIM, Kind.AGREE}
LARGEST_SPACE = 3_000_000
LOSSES = 0.0, 0.1, 0.4
REASONS = tuple(why for why in Why if why != Why.CROSSING)
HEAD = """# Posts and vehicles beside Algorithm 2 by messages: all tables

`make beside-zhou` writes this file; `docs/studies/beside-zhou.md` says what it shows.
"""


@dataclass(slots=True)
class Run:
    """Runs until all have gone round, or until nobody goes; rounds and moves are those of the former."""

    runs: int = 0
    done: int = 0
    rounds: int = 0
    moves: int = 0
    decided: int = 0
    """Messages of decisions."""
    negotiated: int = 0
    dearest: int = 0
    """Messages of the dearest decision."""


def systems() -> dict[str, System]:
    """Return systems of the paper, and two on which Algorithm 2 fails."""
    named = {"Fig. 8": instance("fig8"), "Fig. 10": instance("fig10"), "Fig. 5": instance("fig5")}
    named |= {f"Fig. 7, {m} robots": fig7(m) for m in (4, 8, 12)}
    named |= {name: instance(name) for name in ("unsound_n5", "blocked_n5")}
    return named | {f"dense, {m} robots": random_system(dense(m), 1) for m in (8, 16)}


def wide(system: System, copies: int) -> System:
    """Return the same paths with places of two, and so many robots where there was one.

    Robots are left out, the last first, until no full places wait for one another in a circle.
    """
    robots = [
        Robot(RobotId(f"{one.id}{k}"), one.path, closed=one.closed, start=one.start)
        for k in range(copies)
        for one in system.robots
    ]
    while True:
        states = dict.fromkeys(state for one in robots for state in one.path)
        made = System(robots, dict.fromkeys(states, SLOTS), states)
        if not circle(world(made)):
            return made
        robots.pop()


def world(system: System) -> World:
    """Return posts and vehicles at the start of a system of places; the way back from an end is a leg too."""
    lines: list[list[tuple[int, int]]] = [[] for _ in system.states]
    for number, one in enumerate(system.robots):
        lines[system.paths[number][one.start]].append((number, one.start))
    return begin(system.paths, [SLOTS] * len(system.states), lines)


def by_agents(system: System, seeds: int) -> Run:
    """Run Algorithm 2 by messages, with the negotiation of the paper: one robot moves in a round."""
    found, robots = Run(), range(len(system.robots))
    closed = any(one.closed for one in system.robots)
    need = [len(system.paths[i]) - (0 if closed else 1) for i in robots]

    def have_gone(ran: DistributedRun) -> bool:
        moved = Counter(robot for _, robot in ran.moves)
        return all(moved[i] >= need[i] for i in robots)

    for seed in range(1, seeds + 1):
        least, most = 0, MOST_ROUNDS * len(robots)
        ran = run_agents(system, rounds=most, seed=seed)
        done = have_gone(ran)
        while done and most - least > 1:  # the same seed gives the same rounds, however many
            middle = (least + most) // 2
            shorter = run_agents(system, rounds=middle, seed=seed)
            if have_gone(shorter):
                ran, most = shorter, middle
            else:
                least = middle
        found.runs += 1
        for here, robot in ran.moves:
            asked = decide_by_messages(system, here, robot)
            found.dearest = max(found.dearest, sum(asked.messages.values()))
        if done:
            apart = sum(many for kind, many in ran.messages.items() if kind in NEGOTIATION)
            found.done += 1
            found.moves += len(ran.moves)
            found.rounds += ran.rounds
            found.negotiated += apart
            found.decided += sum(ran.messages.values()) - apart
    return found


class Fleet:
    """Posts and vehicles of a system of places; messages come in any order, and all come."""

    def __init__(self, start: World, rng: Random) -> None:
        self.posts, self.vehicles = list(start.posts), list(start.vehicles)
        self.lines = [list(line) for line in start.ground]
        self.moved = [0] * len(self.vehicles)
        self._rng = rng

    def ask(self, number: int, since: float) -> int:
        """Let a vehicle ask, and all come that follows; return how many transmissions that were."""
        flight: list[Message] = [cars.ask(self.vehicles[number], (since, number))]
        sent = 0
        while flight:
            message = flight.pop(self._rng.randrange(len(flight)))
            sent += not isinstance(message, Moved)  # said in one with `Goes`
            out: Sequence[Message] = ()
            if isinstance(message, Grant):
                out = self._hear(message)
            elif isinstance(message, Room):
                self.vehicles[message.vehicle] = cars.heard(self.vehicles[message.vehicle], message)
            elif not isinstance(message, Refuse | Offer):
                self.posts[message.place], out = posts.receive(self.posts[message.place], message)
            flight += out
        return sent

    def _hear(self, grant: Grant) -> list[Message]:
        car = self.vehicles[grant.vehicle]
        after, out = cars.granted(car, grant)
        if after.at != car.at:
            self.lines[car.place].remove(car.id)
            self.lines[grant.place].append(car.id)
            self.moved[car.id] += 1
            after, left = cars.rear_out(after)
            out = [*out, *left]
        self.vehicles[car.id] = after
        return out


def by_posts(system: System, seeds: int) -> Run:
    """Run posts and vehicles: in a round each vehicle that is first in line asks once."""
    found = Run()
    closed = any(one.closed for one in system.robots)
    for seed in range(1, seeds + 1):
        rng = Random(seed)
        fleet = Fleet(world(system), rng)
        need = [len(car.loop) - (0 if closed else 1 + car.at) for car in fleet.vehicles]
        since, rounds, sent, before = [0] * len(need), 0, 0, -1
        while sum(fleet.moved) > before and any(
            moved < most for moved, most in zip(fleet.moved, need, strict=True)
        ):
            rounds, before = rounds + 1, sum(fleet.moved)
            heads = [line[0] for line in fleet.lines if line]
            for number in rng.sample(heads, len(heads)):
                moved = fleet.moved[number]
                if closed or moved < need[number]:  # at the end of its path it stays
                    cost = fleet.ask(number, since[number])
                    found.dearest = max(found.dearest, cost)
                    sent += cost
                    since[number] = rounds if fleet.moved[number] > moved else since[number]
        found.runs += 1
        if sum(fleet.moved) > before:
            found.done += 1
            found.rounds += rounds
            found.moves += sum(fleet.moved)
            found.decided += sent
    return found


def layers(depth: int) -> System:
    """Return a robot that wants the state ``x`` before so many layers of three robots each.

    Each of these wants two states of the next layer, and those of the last want ``x``. So twice as many
    circuits begin in each layer as in the one before.
    """

    def state(layer: int, number: int) -> str:
        return "x" if layer > depth else f"s{layer}_{number % LAYER}"

    asker = Robot(RobotId("r"), tuple(map(StateId, ("home", "x", "s1_0", "s1_1", "end"))), closed=False)
    others = []
    for layer in range(1, depth + 1):
        for number in range(LAYER):
            ahead = dict.fromkeys((state(layer + 1, number), state(layer + 1, number + 1)))
            path = (state(layer, number), *ahead, f"end{layer}_{number}")
            others.append(Robot(RobotId(f"r{layer}_{number}"), tuple(map(StateId, path)), closed=False))
    return System([asker, *others])


def last_slot(depth: int) -> int:
    """Return the transmissions of one ask in this family with full places, for the last slot of ``x``."""
    system = layers(depth)
    first = system.robots[0]
    there = Robot(RobotId("there"), first.path, closed=False, start=1)
    twice = [
        Robot(RobotId(f"{one.id}{k}"), one.path, closed=False) for one in system.robots[1:] for k in "ab"
    ]
    states = dict.fromkeys(s for one in (first, there, *twice) for s in one.path)
    filled = System([first, there, *twice], dict.fromkeys(states, SLOTS), states)
    fleet = Fleet(world(filled), Random(1))
    asker = next(car.id for car in fleet.vehicles if filled.states[car.place] == "home")
    return fleet.ask(asker, 0.0)


def orders(system: System) -> str:
    """Return how many configurations are deadlocks, and how many are by order without being one."""
    try:
        found = explore(system, make_gate("open", system), limit=LARGEST_SPACE)
    except ExplorationLimitError:
        return f"| more than {LARGEST_SPACE:,} | | |"
    higher = ", ".join(f"{many:,} of order {order}" for order, many in (found.higher_order or {}).items())
    return f"| {found.configurations:,} | {found.deadlocks:,} | {higher or 'none'} |"


def runs_table(seeds: int) -> Iterator[str]:
    """Yield the table of runs."""
    yield (
        "| system | robots | a state holds | rule | all go round | rounds "
        "| messages a move: decisions | negotiation | dearest decision |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for name, system in systems().items():
        made = [(system, 1, "Algorithm 2", by_agents(system, seeds))]
        for copies in (1, SLOTS):
            more = wide(system, copies)
            made.append((more, SLOTS, "posts", by_posts(more, seeds)))
        for one, holds, rule, run in made:
            figures = ["-"] * 3
            if run.done:
                figures = [
                    f"{run.rounds / run.done:.1f}",
                    f"{run.decided / run.moves:.2f}",
                    f"{run.negotiated / run.moves:.1f}",
                ]
            cells = name, len(one.robots), holds, rule, f"{run.done} of {run.runs}", *figures, run.dearest
            yield "| " + " | ".join(map(str, cells)) + " |"


def orders_table() -> Iterator[str]:
    """Yield the table of deadlocks by order, for states of one and places of two."""
    yield "| system | robots | each state holds | configurations | deadlocks | of higher order |"
    yield "|---|---|---|---|---|---|"
    for name, system in systems().items():
        yield f"| {name} | {len(system.robots)} | 1 {orders(system)}"
        for copies in (1, SLOTS):
            made = wide(system, copies)
            yield f"| {name} | {len(made.robots)} | {SLOTS} {orders(made)}"


def decided(system: System, seeds: int) -> Counter[str]:
    """Return the decisions of posts beside those of the central chain rule, at each loss of messages."""
    found: Counter[str] = Counter()
    for seed in range(1, seeds + 1):
        for loss in LOSSES:
            found += judged(Walk(world(system), Random(seed), loss=loss), steps=40 * len(system.robots))
    return found


def decisions_table(seeds: int) -> Iterator[str]:
    """Yield the table of decisions beside the central chain rule."""
    yield (
        f"| system | vehicles | grants | {' | '.join(WRONG)} "
        f"| refused, and a central gate would grant: {' | '.join(REASONS)} |"
    )
    yield "|---|---|---|" + "---|" * (len(WRONG) + len(REASONS))
    for name, system in systems().items():
        for copies in (1, SLOTS):
            made = wide(system, copies)
            found = decided(made, seeds)
            though = [found[f"{why}: central admits"] for why in REASONS]
            cells = name, len(made.robots), f"{found['grants']:,}", *(found[key] for key in WRONG), *though
            yield "| " + " | ".join(map(str, cells)) + " |"


def growth_table() -> Iterator[str]:
    """Yield the table of one decision in the family of layers."""
    yield "| robots | Algorithm 2: messages | full places | posts: messages |"
    yield "|---|---|---|---|"
    for depth in (1, 2, 3, 4, 5, 6, 8, 10):
        system = layers(depth)
        asked = decide_by_messages(system, system.initial, 0)
        cells = len(system.robots), f"{sum(asked.messages.values()):,}", LAYER * depth, last_slot(depth)
        yield "| " + " | ".join(map(str, cells)) + " |"


def main() -> None:
    """Write the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    options = parser.parse_args()
    text = HEAD
    for title, table in (
        ("One decision, as robots become more", growth_table()),
        ("Until all have gone round", runs_table(options.seeds)),
        ("Decisions beside the central chain rule", decisions_table(options.seeds)),
        ("Deadlocks by order", orders_table()),
    ):
        text += f"\n## {title}\n\n"
        for row in table:
            print(row, flush=True)
            text += row + "\n"
    OUT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
