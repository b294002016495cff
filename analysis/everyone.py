"""Live for everyone iff no circle and no crowd? Random systems, every configuration of them.

    python analysis/everyone.py                  # 10,000 systems whose places hold 2 to 4: ten minutes
    python analysis/everyone.py --narrow --systems 5000    # some places hold 1: `FreeSlots`, along walks

Every configuration that can be reached is looked at by an exhaustive oracle (`road_oracle`). That is compared
with what is proved (no circle of full places, and no crowd), and with what the gate decides.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter

from road_oracle import MOST, Reach, Roads
from service_rule import next_mover

from loopgate.cli.terminal import show_progress
from loopgate.errors import UnsafeStartError
from loopgate.gates.base import Reason
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.crowding import find_crowd
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.search import Budget
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import System
from loopgate.research.theory.certificates import leaves_room_for_passers

STEPS = 40


def draw(seed: int, *, narrow: bool) -> Roads:
    """Draw loops, slots and a start, which is free in one half of the systems and crowded in the other."""
    rng = random.Random(seed)
    places = rng.randint(2, 7 if narrow else 6)
    slots = tuple(rng.randint(1 if narrow else 2, 3 if narrow else 4) for _ in range(places))
    loops: list[list[int]] = []
    for _ in range(rng.randint(1, 5)):
        loop = rng.sample(range(places), min(rng.randint(2, min(places, 5)), rng.randint(2, 5)))
        if len(loop) > 2 and rng.random() < 0.2:  # noqa: PLR2004 - one in five comes through a place twice
            loop.insert(rng.randint(2, len(loop) - 1), loop[0])
        loops.append(loop)
    crowded = rng.random() < 0.5  # noqa: PLR2004 - a fair coin
    most = [s if crowded and not narrow else s - 1 for s in slots]
    lines: list[list[tuple[int, int]]] = [[] for _ in slots]
    for _ in range(rng.randint(sum(most) // 2 if crowded else 1, max(1, sum(most)))):
        chosen = rng.randrange(len(loops))
        free = [k for k, p in enumerate(loops[chosen]) if len(lines[p]) < most[p]]
        if free:
            k = rng.choice(free)
            lines[loops[chosen][k]].append((chosen, k))
    return Roads(tuple(map(tuple, loops)), slots, tuple(map(tuple, lines)))


def wide_system(roads: Roads, seed: int) -> Counter[str]:
    """Compare what is proved, what the gate decides, and what is so; then serve everyone once."""
    reach, found = Reach(roads), Counter[str](systems=1)
    loops = [roads.loops[loop] for line in roads.start for loop, _ in line]
    crowded = roads.crowded()
    found["crowded"] += crowded
    found["condition wrong"] += crowded != (find_crowd(loops, roads.slots) is not None)
    found["condition wrong"] += crowded == leaves_room_for_passers(loops, roads.slots)
    found["configurations"] += len(reach.all)
    for here, live in zip(reach.all, reach.live.tolist(), strict=True):
        found["live"] += live
        found["mismatches"] += live != (not crowded and not roads.circle(here))
    system = roads.system
    try:
        gate = CertifiedGate(system, promise="everyone", patience=0)
    except UnsafeStartError:
        found["starts refused"] += 1
        found["live starts refused"] += bool(reach.live[0])
        return found
    found["dead starts taken"] += not reach.live[0]
    found["by the chain"] += gate.by_chain_alone
    _look_everywhere(reach, gate, found)
    if gate.by_chain_alone:
        _serve(system, gate, random.Random(seed), found)
    return found


def _look_everywhere(reach: Reach, gate: CertifiedGate, found: Counter[str]) -> None:
    """Ask the gate about every move in every configuration that it lets come about."""
    system = reach.roads.system
    seen, todo = {system.initial}, [system.initial]
    while todo:
        here = todo.pop()
        admitted = 0
        for robot in range(len(system.robots)):
            if system.enabled(here, robot):
                there = system.moved(here, robot)
                safe, yes = reach.is_live(there), gate.decide(here, robot).admitted
                found["decisions"] += 1
                found["unsafe"] += yes and not safe
                found["needless"] += safe and not yes
                admitted += yes
                if yes and there not in seen and len(seen) < MOST:
                    seen.add(there)
                    todo.append(there)
        found["blocked"] += not admitted


def _serve(system: System, gate: CertifiedGate, rng: random.Random, found: Counter[str]) -> None:
    """Serve every robot once, in a random order, each move as the gate admits it."""
    here = system.initial
    stand = Occupancy.of(SystemIndex(system), here)
    for robot in rng.sample(range(len(system.robots)), len(system.robots)):
        moves = 0
        mover = -1
        while mover != robot and moves < MOST:
            mover = next_mover(stand, robot)
            found["services refused"] += not gate.decide(here, mover).admitted
            here = system.move(here, mover)
            gate.moved(here, mover)
            stand.step(mover)
            moves += 1
        found["served"] += mover == robot
        found["not served"] += mover != robot
        found["service moves"] += moves
        found[f"longest {moves}"] += 1


def narrow_system(roads: Roads, seed: int) -> Counter[str]:
    """Walk where `FreeSlots` lets us, and compare each of its answers with what is so."""
    reach, found, system = Reach(roads), Counter[str](systems=1), roads.system
    roomy = reach.roomy()
    found["configurations"] += len(reach.all)
    found["live"] += int(reach.live.sum())
    found["a slot free everywhere, not live"] += int((roomy & ~reach.live).sum())
    found["live, no slot free everywhere"] += int((reach.live & ~roomy).sum())
    keeper = FreeSlots(SystemIndex(system), Budget(2_000))
    here, rng = system.initial, random.Random(seed)
    stand = Occupancy.of(keeper.layout, here)
    if not keeper.begin(here, stand):
        found["starts refused"] += 1
        found["live starts refused"] += bool(reach.live[0])
        return found
    for _ in range(STEPS):
        admitted = []
        for robot in range(len(system.robots)):
            if stand.enabled(robot):
                safe = reach.is_live(system.moved(here, robot))
                decision = keeper.judge(here, stand, robot)
                found["decisions"] += 1
                found["safe"] += safe
                found["unsafe"] += decision.admitted and not safe
                found["needless"] += safe and not decision.admitted
                found["budget stops"] += decision.reason is Reason.BUDGET
                admitted += [robot] * decision.admitted
        found["blocked"] += not admitted
        if not admitted:
            break
        robot = rng.choice(admitted)
        here, before = system.moved(here, robot), stand.at[robot]
        stand.step(robot)
        keeper.moved(robot, before)
    return found


WRONG = (
    *("condition wrong", "mismatches", "live starts refused", "dead starts taken", "unsafe", "blocked"),
    *("services refused", "not served", "a slot free everywhere, not live"),
)
"""What must be 0; where places hold two or more, so must be ``needless``."""


def study(systems: int, *, narrow: bool) -> Counter[str]:
    """Look at so many systems; seeds whose systems are too large, or have nobody in them, are passed over."""
    total: Counter[str] = Counter()
    seed = 0
    with show_progress("systems", total=systems) as report:
        while total["systems"] < systems:
            seed += 1
            roads = draw(seed, narrow=narrow)
            if (narrow and min(roads.slots) > 1) or not any(roads.start):
                continue
            try:
                total += narrow_system(roads, seed) if narrow else wide_system(roads, seed)
            except OverflowError:
                total["too large, drawn anew"] += 1
            report(total["systems"])
    return total


def main() -> None:
    """Print what was found; exit code 1 if anything is not as it is proved to be."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--systems", type=int, default=10_000)
    parser.add_argument("--narrow", action="store_true", help="places that hold 1 to 3, free starts")
    options = parser.parse_args()
    begin = time.perf_counter()
    total = study(options.systems, narrow=options.narrow)
    lengths = [int(key.split()[1]) for key in total if key.startswith("longest ")]
    if total["served"]:
        mean = total["service moves"] / total["served"]
        print(f"{'moves per service':36} {mean:>12.2f}, longest {max(lengths)}")
    for key in sorted({*(key for key in total if not key.startswith("longest ")), *WRONG, "needless"}):
        print(f"{key:36} {total[key]:>12,}")
    if total["safe"]:
        print(f"{'permissiveness':36} {1 - total['needless'] / total['safe']:>12.6f}")
    print(f"{'seconds':36} {time.perf_counter() - begin:>12,.0f}")
    sys.exit(int(any(total[key] for key in WRONG) or (not options.narrow and total["needless"] > 0)))


if __name__ == "__main__":
    main()
