"""Vehicle-km in the hour on the five-by-five grid: SUMO's own rules beside the gates, on the same loops.

For each seed 40 random loops of 400 to 2000 m are made once; every rule drives the same vehicles on them from
the same places, SUMO's rules on networks of the same streets.

    python analysis/throughput.py --seeds 5 --write

prints the tables and renews them in ``docs/studies/throughput.md``. Runs that are done are kept, see
``--help``.
"""

from __future__ import annotations

from collections.abc import Sequence

from throughput_study import ROOT, Rule, Study, conduct, parser

from loopgate.abstraction.queue_layout import why_not
from loopgate.network import Loop, RoadNetwork, generate_loops

NETWORKS = ROOT / "networks"
LOOPS = 40
NEGOTIATIONS = ("random", "oldest", "pressure:crowded=2", "pressure:crowded=0.6", "pressure")
"""The third has no reserve, the fourth one by hand."""


def _network(rule: str) -> str:
    return str(NETWORKS / f"grid5-{rule}.net.xml")


def _sumo(rule: str) -> Rule:
    return Rule(
        f"SUMO, {rule.replace('-', ' ')}", {"network": _network(rule), "gate": "open"}, yardstick=True
    )


def _gated(gate: str, negotiation: str, vehicles: tuple[int, ...] = ()) -> Rule:
    scenario = {"network": _network("priority"), "gate": gate, "negotiation": negotiation}
    return Rule(f"{gate}, {negotiation}", scenario, vehicles=vehicles)


def loops(seed: int) -> Sequence[Loop]:
    """Return the loops of a seed."""
    roads = RoadNetwork.open(_network("priority"))
    return generate_loops(roads, LOOPS, seed=seed, admits=lambda loop: not why_not(roads, loop))


GRID = Study(
    name="grid",
    title="Five-by-five grid",
    rules=(
        *(_sumo(rule) for rule in ("priority", "right-before-left", "all-way-stop", "actuated")),
        *(_gated("certified", negotiation) for negotiation in NEGOTIATIONS),
        _gated("algorithm2", "pressure", (60, 180)),
        _gated("banker", "pressure", (60, 180)),
    ),
    vehicles=(60, 100, 140, 180, 240, 300, 400),
    loops=loops,
)

if __name__ == "__main__":
    conduct(GRID, parser(__doc__).parse_args())
