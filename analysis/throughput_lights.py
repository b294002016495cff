"""Vehicle-km where lights are obeyed: SUMO's own drivers beside the certified gate, under the same lights.

The five-by-five grid with lights that follow the traffic and south-east Berlin on random loops; other
networks with lights by their files, with loops that turn round where streets end, as many as there are up to
sixty; there ``--vehicles`` may be any counts.

    python analysis/throughput_lights.py --seeds 5 --duration 900 --write

prints the tables and renews them in ``docs/studies/throughput.md`` (not those of files). Runs that are done
are kept, see ``--help``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from throughput_study import ROOT, Rule, Study, conduct, parser

from loopgate.abstraction.queue_layout import why_not
from loopgate.network import Loop, RoadNetwork, find_loops

GRID = str(ROOT / "networks" / "grid5-actuated.net.xml")


def study(
    name: str,
    title: str,
    network: str,
    loops: int,
    longest_m: float,
    vehicles: tuple[int, ...],
    *,
    u_turns: bool = False,
) -> Study:
    """Return the study of a network: SUMO under its lights, and the gate that obeys them."""

    def make(seed: int) -> Sequence[Loop]:
        roads = RoadNetwork.open(network)
        length_m = (400.0, longest_m)
        found = find_loops(
            roads,
            loops,
            length_m=length_m,
            seed=seed,
            u_turns=u_turns,
            admits=lambda loop: not why_not(roads, loop),
        )
        if found.shortfall:
            sys.stderr.write(f"{name}: {found.shortfall}\n")
        return found.loops

    common = {"network": network}
    rules = (
        Rule("SUMO, lights on", {**common, "gate": "open", "lights": "keep"}, yardstick=True),
        Rule("certified, lights obeyed", {**common, "gate": "certified", "lights": "obey"}),
    )
    return Study(name, title, rules, vehicles, make)


if __name__ == "__main__":
    words = parser(__doc__)
    words.add_argument("networks", nargs="*", type=Path, help="networks with lights, instead of those two")
    given = words.parse_args()
    studies = [
        study(
            file.name.partition(".")[0],
            file.name,
            str(file.resolve()),
            60,
            3000.0,
            tuple(given.vehicles or (40, 100, 200, 300)),
            u_turns=True,
        )
        for file in given.networks
    ]
    given.write &= not studies
    for one in studies or (
        study("lights-grid", "Lights obeyed, five-by-five grid", GRID, 40, 2000.0, (60, 140, 180, 240, 300)),
        study(
            "lights-berlin", "Lights obeyed, south-east Berlin", "sumo:DRT", 60, 3000.0, (50, 150, 300, 400)
        ),
    ):
        conduct(one, given)
