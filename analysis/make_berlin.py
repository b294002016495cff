"""Draw loops as those of ``routes/berlin60.rou.xml`` were drawn, and tell which of these still come out.

That file holds sixty random loops in south-east Berlin, 0.4 to 3 km long: the first sixty of the loops of
``loopgate loops sumo:DRT --count 160 --length 400:3000 --seed 2`` that queues could hold when vehicles did
not change lanes. Today queues hold all of them, so the file is kept as it is: all figures are of its loops.
"""

from pathlib import Path

from loopgate.network import RoadNetwork, generate_loops, read_loops

FILE = Path(__file__).resolve().parent.parent / "routes" / "berlin60.rou.xml"
TRIED, SEED = 160, 2


def main() -> None:
    """Draw, compare and tell."""
    network = RoadNetwork.open("sumo:DRT")
    drawn = {
        loop.id: loop.edges for loop in generate_loops(network, TRIED, length_m=(400.0, 3000.0), seed=SEED)
    }
    kept = read_loops(network, FILE).loops
    same = sum(drawn.get(loop.id) == loop.edges for loop in kept)
    print(f"{same} of {len(kept)} loops of {FILE.name} come out as they are")


if __name__ == "__main__":
    main()
