# ruff: noqa: SLF001 - it replaces the inner functions of the protocol, which is what breaking a rule means
"""Breaks each rule of posts, keepers and vehicles that decide by messages, one at a time.

``python analysis/vehicles_broken.py`` drives 200 and 600 vehicles on the grid for four minutes, once as it is
and once with each rule broken. A tenth of the messages is lost, so that late and repeated ones come too.
Nothing central stands between a grant and the road, so a break shows on the road (collisions, a deadlock,
vehicles that stand) or in the audit.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pandas as pd
from frame_table import frame_table
from rich.console import Console

from loopgate import Scenario
from loopgate.simulation.by_messages.motor import Motor
from loopgate.simulation.run import simulate
from loopgate.vehicles import keeper as keepers
from loopgate.vehicles import post as posts
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import Ask, Grant, Left, Probe

ROOT = Path(__file__).resolve().parent.parent
GRID = Scenario(
    network=str(ROOT / "networks" / "grid5-priority.net.xml"),
    routes=str(ROOT / "routes" / "grid5.rou.xml"),
    duration_s=240.0,
    decide="vehicles:loss=0.1,delay=0.2",
    positions=True,
)
COUNTS = (200, 600)

_decided, _asked = posts._decided, posts._asked


def _lets_in(post: posts.Post, ask: Ask) -> posts.Answer:
    entry = posts.Entry(ask.vehicle, ask.number, ask.then)
    return posts._let_in(replace(post, kept=posts.Kept(ask.vehicle, ask.here, ask.stamp, post.probes, entry)))


def _full_counts_no_rears(post: posts.Post, ask: Ask) -> posts.Answer:
    return _decided(replace(post, rears=()), ask) if post.rears else _decided(post, ask)


def _last_slot_without_probe(post: posts.Post, ask: Ask) -> posts.Answer:
    taken = len(post.line) + len(post.rears) + (post.kept is not None)
    return _decided(post, ask) if taken >= post.slots else _lets_in(post, ask)


def _kept_slot_is_free(post: posts.Post, ask: Ask) -> posts.Answer:
    return _decided(replace(post, kept=None), ask)


def _known_at_once(post: posts.Post, ask: Ask) -> posts.Answer:
    return _asked(replace(post, known=True), ask)


def _old_numbers_count(post: posts.Post, ask: Ask) -> posts.Answer:
    return _asked(replace(post, gone=(), rears=()), ask)


def _back_lets_in(post: posts.Post, probe: Probe) -> posts.Answer:
    return posts._let_in(post) if posts._awaits(post, probe.number) else (post, [])


def _left_while_there(vehicle: cars.AskingVehicle, grant: Grant) -> cars.Answer:
    after, out = GRANTED(vehicle, grant)
    return after, [*out, Left(vehicle.place, vehicle.id, vehicle.inside)] if len(out) > 1 else out


def _keeps_the_grant(vehicle: cars.AskingVehicle, grant: Grant) -> cars.Answer:
    return replace(vehicle, number=grant.number), []


def _sees_nobody(motor: Motor) -> list[int]:
    found = list(motor._setting_out)
    motor._setting_out.clear()
    return found


GRANTED = cars.granted
RULES: dict[str, tuple[Any, str, Callable[..., Any]]] = {
    "post: no slot free, no grant": (posts, "_decided", _lets_in),
    "post: a rear still inside takes a slot": (posts, "_decided", _full_counts_no_rears),
    "post: the last slot only after a probe": (posts, "_decided", _last_slot_without_probe),
    "post: a kept slot is taken": (posts, "_decided", _kept_slot_is_free),
    "post: the own probe comes back, no grant": (posts, "_back", _back_lets_in),
    "post: one at a time, until it says that it goes": (posts, "_asked", _known_at_once),
    "post: a number counts once": (posts, "_asked", _old_numbers_count),
    "keeper: no two leases in conflict": (keepers, "_conflict", lambda *_: False),
    "vehicle: sets out within its lease": (cars, "in_time", lambda *_: True),
    "vehicle: looks before it sets out": (Motor, "seen_to_go", _sees_nobody),
    "vehicle: its rear is out before it says so": (cars, "granted", _left_while_there),
    "vehicle: gives an unused grant back": (cars, "give_back", _keeps_the_grant),
    "vehicle: repeats what no post has heard": (cars, "repeat", lambda *_: []),
}


@contextmanager
def broken(rule: str) -> Iterator[None]:
    """Break a rule for a while; none for an empty name."""
    if not rule:
        yield
        return
    where, name, instead = RULES[rule]
    with patch.object(where, name, instead):
        yield


def row(rule: str, vehicles: int, seed: int, out: Path) -> dict[str, Any]:
    """Run once; return what is seen."""
    with broken(rule):
        summary = simulate(replace(GRID, vehicles=vehicles, seed=seed), out, overwrite=True)
    findings = summary["audit"] if isinstance(summary["audit"], list) else []
    kinds = Counter(_kind(text) for text in findings)
    told = summary["by_messages"]
    return {
        "rule": rule or "(none)",
        "vehicles": vehicles,
        "km": round(summary["distance_km"], 1),
        "outcome": summary["outcome"],
        "collisions": summary["collisions"],
        "audit": ", ".join(f"{count} {kind}" for kind, count in kinds.most_common(3)) or "clean",
        "unsafe": told["unsafe"],
        "still": told["longest_still_s"],
    }


_KINDS = {
    "slots": ("holds", "capacity", "number"),
    "crossing": ("on the stretch", "share"),
    "bodies": ("overlap", "collision"),
    "order": ("first in", "is not first", "before"),
}


def _kind(text: str) -> str:
    return next((kind for kind, words in _KINDS.items() if any(word in text for word in words)), "other")


def main() -> int:
    """Print the table; return 1 if the run without a break is not clean."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "vehicles_broken")
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS)
    parser.add_argument("--seed", type=int, default=GRID.seed)
    given = parser.parse_args()
    rows = [row(rule, n, given.seed, given.out / "run") for rule in ("", *RULES) for n in given.counts]
    headings = {name: name for name in rows[0]}
    Console(width=150).print(frame_table(pd.DataFrame(rows), headings, title="One rule broken at a time"))
    whole = [one for one in rows if one["rule"] == "(none)"]
    return int(any(one["collisions"] or one["audit"] != "clean" for one in whole))


if __name__ == "__main__":
    sys.exit(main())
