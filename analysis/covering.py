"""How near covering loops come to what is possible, network by network; prints a Markdown table.

    python analysis/covering.py sumo:DRT sumo:bs3d networks/grid5-priority.net.xml

Every cover is accepted as queues, or its loops would not be there. Seconds are of processor time.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

from loopgate.abstraction.covering import cover_streets
from loopgate.errors import RouteError
from loopgate.network import RoadNetwork
from loopgate.network.cover.design import CoverTask

COUNTS = 1, 5, 20, 40


def main(names: list[str]) -> None:
    """Print a row for each network and number of loops, then why streets are not covered."""
    print("| network | loops | streets covered | km | over circulation | longest | over bound | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    left: dict[str, str] = {}
    for name in names:
        network = RoadNetwork.open(name)
        for count in COUNTS:
            began = time.process_time()
            try:
                cover = cover_streets(network, CoverTask(), count)
            except RouteError as error:
                left[name] = str(error)
                break
            lengths = [loop.length_m for loop in cover.loops]
            design = cover.design
            print(
                f"| {name} | {len(lengths)} | {len(cover.covered)} of {len(design.required)} "
                f"| {sum(lengths) / 1000:.1f} | {sum(lengths) / design.circulation - 1:+.1%} "
                f"| {max(lengths):.0f} m | {max(lengths) / design.bound(len(lengths)) - 1:+.1%} "
                f"| {time.process_time() - began:.0f} |",
                flush=True,
            )
            counted = Counter(str(reason) for reason in cover.left_out.values())
            left[name] = "; ".join(f"{number}: {reason}" for reason, number in counted.most_common())
    print()
    for name, reasons in left.items():
        print(f"- {name}: not covered: {reasons or 'nothing'}")


if __name__ == "__main__":
    main(sys.argv[1:] or ["sumo:DRT", "sumo:bs3d", "networks/grid5-priority.net.xml"])
