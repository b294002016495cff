"""Who goes on after a change of loops, and while some stand? What is proved, held against exhaustion.

    python analysis/changes.py                   # 10,000 systems whose places hold 2 to 4: ten minutes

From a live configuration of a random system vehicles get other loops, first vehicles stand for good, or both:
then most loops are led round the places that stand. Every configuration that can be reached from there is
looked at by an exhaustive oracle (`road_oracle`). That is compared with what is proved, and with what
`change_rule` decides.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter
from dataclasses import replace
from operator import eq

from change_rule import Standing, Why, find_hindrance
from everyone import draw
from road_oracle import Lines, Reach, Roads

from loopgate.cli.terminal import show_progress

MOST = 2_000
"""Systems with more configurations are drawn anew."""

Loop = tuple[int, ...]

KINDS = ("change", "stand", "both")

WRONG = ("mismatches", "unsafe", "needless")
"""What must be 0."""


def pick_stands(roads: Roads, here: Lines, rng: random.Random, kind: str) -> frozenset[int]:
    """Draw one or two places whose first vehicle stands; where loops stay, few that others visit."""
    stood = [p for p, line in enumerate(here) if line]
    if kind == "change":
        return frozenset()
    if kind == "stand":
        stood = [
            p for p in stood if not replace(roads, start=here, stands=frozenset({p})).leads_there()
        ] or stood
    return frozenset(rng.sample(stood, min(len(stood), rng.choice((1, 1, 1, 2)))))


def new_loop(rng: random.Random, place: int, places: list[int], full: set[int]) -> Loop | None:
    """Draw a loop from a place over some of others, often first to full ones; None if there are none."""
    others = [p for p in places if p != place]
    rng.shuffle(others)
    if rng.random() < 0.5:  # noqa: PLR2004 - a fair coin
        others.sort(key=lambda p: p not in full)
    return (place, *others[: rng.choice((1, 1, 2, 3))]) if others else None


def change(roads: Roads, here: Lines, rng: random.Random, kind: str) -> Roads:
    """Return what a configuration is after a change: the same vehicles in the same places."""
    stands = pick_stands(roads, here, rng, kind)
    full = {p for p, line in enumerate(here) if len(line) == roads.slots[p]}
    free = [p for p in range(len(roads.slots)) if p not in stands]
    chance = rng.choice((0.2, 0.5, 1.0))
    careless = rng.random() < 0.2  # noqa: PLR2004 - one in five leads some loops where somebody stands
    crowd = rng.sample(free, min(len(free), 2)) if rng.random() < 0.3 else []  # noqa: PLR2004 - all there stay there
    loops, lines = list(roads.loops), []
    for place, line in enumerate(here):
        entries = []
        for loop, position in line:
            entry = (loop, position)
            hit = place not in stands and not stands.isdisjoint(loops[loop])
            if kind != "stand" and ((hit and not careless) or place in crowd or rng.random() < chance):
                way = new_loop(rng, place, list(range(len(here))) if careless else free, full)
                if place in crowd and len(crowd) > 1:
                    way = tuple(crowd)
                if way is not None:
                    loops += [way] if way not in loops else []
                    entry = (loops.index(way), way.index(place))
            entries.append(entry)
        lines.append(tuple(entries))
    return Roads(tuple(loops), roads.slots, tuple(lines), stands)


def decide(roads: Roads, before: Lines) -> Why | None:
    """Return why not everyone goes on, as the package has it, which is told who has changed."""
    entries = [entry for line in roads.start for entry in line]
    numbers = iter(range(len(entries)))
    lines = [[next(numbers) for _ in line] for line in roads.start]
    olds = [entry for line in before for entry in line]
    changed = {k for k, (old, new) in enumerate(zip(olds, entries, strict=True)) if old != new}
    there = Standing([roads.loops[loop] for loop, _ in entries], [p for _, p in entries], lines, roads.slots)
    found = find_hindrance(there, changed=changed, stands=roads.stands)
    whole = find_hindrance(there, stands=roads.stands)
    if (found is None) != (whole is None):
        msg = f"{roads}: another answer when it is not told who has changed"
        raise AssertionError(msg)
    return found.why if found else None


def look(seed: int) -> Counter[str]:
    """Compare what is proved, what the package decides, and what is so, after one change."""
    rng = random.Random(f"change {seed}")
    roads = draw(seed, narrow=False)
    sparse = 2 * sum(map(len, roads.start)) < sum(roads.slots)
    if not any(roads.start) or (sparse and rng.random() < 0.8):  # noqa: PLR2004 - four in five: too easy
        return Counter()
    reach = Reach(roads, MOST)
    live = [here for here, goes in zip(reach.all, reach.live.tolist(), strict=True) if goes]
    if not live:
        return Counter()
    kind, some = rng.choice(KINDS), [rng.choice(live) for _ in range(rng.choice((1, 200)))]
    here = max(some, key=lambda lines: sum(map(eq, map(len, lines), roads.slots)))  # often a full one
    changed = change(roads, here, rng, kind)
    if changed == replace(roads, start=here):
        return Counter()
    if changed.leads_there() and rng.random() < 0.8:  # noqa: PLR2004 - four in five: nobody is live there
        return Counter()
    after = Reach(changed, MOST)
    found = Counter({"systems": 1, kind: 1})
    holds = not changed.crowded() and not changed.leads_there()
    for one, goes in zip(after.all, after.live.tolist(), strict=True):
        found["configurations"] += 1
        found["live"] += goes
        found["mismatches"] += goes != (holds and not changed.circle(one))
    why, goes = decide(changed, here), bool(after.live[0])
    found["changes that keep everyone live"] += goes
    found["unsafe"] += why is None and not goes
    found["needless"] += why is not None and goes
    if why:
        found[f"refused: {why.name.lower()}"] += 1
    return found


def study(systems: int) -> Counter[str]:
    """Look at so many systems; seeds that are too large, or have nothing to change, are passed over."""
    total: Counter[str] = Counter()
    seed = 0
    with show_progress("systems", total=systems) as report:
        while total["systems"] < systems:
            seed += 1
            try:
                total += look(seed)
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
    options = parser.parse_args()
    begin = time.perf_counter()
    total = study(options.systems)
    for key in sorted({*total, *WRONG}):
        print(f"{key:36} {total[key]:>12,}")
    print(f"{'seconds':36} {time.perf_counter() - begin:>12,.0f}")
    sys.exit(int(any(total[key] for key in WRONG)))


if __name__ == "__main__":
    main()
