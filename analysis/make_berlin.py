"""Make ``routes/berlin60.rou.xml``: sixty random loops in south-east Berlin that queues can hold.

They are 0.4 to 3 km long: the first sixty of the loops of
``loopgate loops sumo:DRT --count 160 --length 400:3000 --seed 2`` whose vehicles need not change lanes.
The file comes out the same byte for byte.
"""

from __future__ import annotations

from pathlib import Path

from loopgate.abstraction.queue_layout import why_not
from loopgate.network import RoadNetwork, generate_loops, write_loops

COUNT, TRIED, SEED = 60, 160, 2

network = RoadNetwork.open("sumo:DRT")
loops = generate_loops(network, TRIED, length_m=(400.0, 3000.0), seed=SEED)
fit = [loop for loop in loops if not why_not(network, loop)]
write_loops(
    fit[:COUNT],
    Path(__file__).resolve().parent.parent / "routes" / "berlin60.rou.xml",
    note="Sixty random loops in south-east Berlin (sumo:DRT); made by analysis/make_berlin.py",
)
