"""Measure the watch: is every deadlock that it names one for ever, and does it miss a gridlock.

Runs SUMO's own rules, past any deadlock, to the end of the hour. Of every circle named: does one of its
vehicles ever move again? At the end: how many vehicles have stood for ten minutes, and how many of them does
the watch know to be held up?

    python analysis/deadlock_recognition.py --seeds 2

It prints a row per run.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.watch import Deadlock, Watch

CASES: tuple[tuple[str, int, dict[str, Any]], ...] = (
    ("networks/grid5-priority.net.xml", 180, {}),
    ("networks/grid5-right-before-left.net.xml", 180, {}),
    ("networks/grid5-all-way-stop.net.xml", 180, {}),
    ("networks/grid5-actuated.net.xml", 180, {}),
    ("sumo:DRT", 400, {"loop_length_m": [400, 3000]}),
    ("sumo:bs3d", 150, {"lights": "off"}),
)
LONG_S = 600.0
MOVED_M = 1.0


@dataclass
class Tally:
    """What became of the circles of one run."""

    named: list[tuple[Deadlock, dict[str, float]]] = field(default_factory=list)
    dissolved: int = 0
    standing: int = 0
    known: int = 0


def watching(tally: Tally, duration_s: float) -> type[Watch]:
    """Return a watch that keeps `tally`."""

    class Keeping(Watch):
        """Remembers where the vehicles of a circle stood, and looks again at the end."""

        def check(self) -> Deadlock | None:
            """Check, and tally."""
            found = super().check()
            traffic = self._traffic
            if found is not None:
                tally.named.append((found, {v: float(traffic.odometers([v])[0]) for v in found.vehicles}))
            if traffic.now_s >= duration_s - 10.0:
                tally.dissolved = sum(
                    any(float(traffic.odometers([v])[0]) - at > MOVED_M for v, at in where.items())
                    for _, where in tally.named
                )
                standing = {v for v in traffic.vehicles() if self.standing_s(v) >= LONG_S}
                tally.standing, tally.known = len(standing), len(standing & self.held_up)
            return found

    return Keeping


def main() -> None:
    """Run all cases and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=2, help="seeds per case")
    parser.add_argument("--duration", type=float, default=3600.0, help="simulated time per run [s]")
    given = parser.parse_args()
    rows = []
    for network, vehicles, more in CASES:
        for seed in range(1, given.seeds + 1):
            tally = Tally()
            data = {"network": network, "loops": 60, "vehicles": vehicles, "gate": "open", "seed": seed}
            fixed = {"loops_seed": seed, "on_deadlock": "continue", "duration_s": given.duration}
            scenario = Scenario.from_dict({**data, **fixed, **more})
            summary = simulate(scenario, watch=watching(tally, given.duration))
            rows.append(
                {
                    "network": network.removeprefix("networks/"),
                    "vehicles": vehicles,
                    "seed": seed,
                    "km": round(summary["distance_km"]),
                    "circles named": len(tally.named),
                    "first at [s]": tally.named[0][0].noticed_at_s if tally.named else None,
                    "dissolved later": tally.dissolved,
                    "standing 10 min": tally.standing,
                    "of them known": tally.known,
                }
            )
            print(f"{network}, seed {seed}: {len(tally.named)} circles named", file=sys.stderr)
    print(pd.DataFrame(rows).to_string(index=False))


if __name__ == "__main__":
    main()
