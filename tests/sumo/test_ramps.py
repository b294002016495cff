"""Gated loops and ordinary vehicles on motorway ramps: none touches another."""

from __future__ import annotations

import subprocess
from pathlib import Path
from random import Random

import pytest
import sumo

from loopgate import Scenario
from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

SIDE_M, SIDES = 800.0, 4


def ring(folder: Path, lanes: int, merge: str, *options: str) -> RoadNetwork:
    """Make a square of motorway, each side with an exit and an entry from a road inside the square."""
    corners = (0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M)
    nodes, edges = [], []
    for k, ((x0, y0), (x1, y1)) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True)):
        along = (x1 - x0, y1 - y0)
        places = ("c", 0.0, 0.0, "priority"), ("off", 0.35, 0.0, "priority"), ("on", 0.65, 0.0, merge)
        for name, share, inwards, kind in (*places, ("in", 0.5, 0.1, "priority")):
            x, y = (
                x0 + along[0] * share - along[1] * inwards,
                y0 + along[1] * share + along[0] * inwards,
            )
            nodes.append(f'<node id="{name}{k}" x="{x:.1f}" y="{y:.1f}" type="{kind}"/>')
        following = (k + 1) % SIDES
        for name, begin, end, count, speed in (
            ("a", f"c{k}", f"off{k}", lanes, 27.8),
            ("b", f"off{k}", f"on{k}", lanes, 27.8),
            ("c", f"on{k}", f"c{following}", lanes + 1, 27.8),
            ("x", f"off{k}", f"in{k}", 1, 16.7),
            ("e", f"in{k}", f"on{k}", 1, 16.7),
            ("i", f"in{k}", f"in{following}", 1, 13.9),
            ("j", f"in{following}", f"in{k}", 1, 13.9),
        ):
            lines = f'numLanes="{count}" speed="{speed}" priority="{10 if name in "abc" else 5}"'
            edges.append(f'<edge id="{name}{k}" from="{begin}" to="{end}" {lines}/>')
    (folder / "n.nod.xml").write_text(f"<nodes>{''.join(nodes)}</nodes>")
    (folder / "n.edg.xml").write_text(f"<edges>{''.join(edges)}</edges>")
    binary = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    words = ["-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml", "--no-turnarounds", "--no-warnings"]
    subprocess.run([str(binary), *words, *options], cwd=folder, check=True, capture_output=True)
    return RoadNetwork.open(folder / "n.net.xml")


def routes(network: RoadNetwork, folder: Path, seed: int) -> tuple[str, str]:
    """Write vehicles on loops, and ordinary ones that drive anywhere; return the files."""
    rng, loops = Random(seed), generate_loops(network, 6, seed=seed, length_m=(600.0, 5000.0))
    rows = [f'<route id="{one.id}" edges="{" ".join(one.edges)}"/>' for one in loops]
    rows += [f'<vehicle id="g{k}" route="{loops[k % len(loops)].id}" depart="0"/>' for k in range(24)]
    (folder / "loops.rou.xml").write_text(f"<routes>{''.join(rows)}</routes>")
    others, edges = [], sorted(network.edges)
    for depart_s in range(240):
        way = [rng.choice(edges)]
        for _ in range(rng.randint(5, 12)):
            way.append(rng.choice(sorted({one.to_edge for one in network.outgoing(way[-1])})))
        others.append(
            f'<vehicle id="o{depart_s}" depart="{depart_s}" departLane="best" departSpeed="max">'
            f'<route edges="{" ".join(way)}"/></vehicle>'
        )
    (folder / "others.rou.xml").write_text(f"<routes>{''.join(others)}</routes>")
    return str(folder / "loops.rou.xml"), str(folder / "others.rou.xml")


@pytest.mark.parametrize(
    ("lanes", "merge", "options"),
    [
        (1, "zipper", ()),
        (2, "priority", ("--ramps.guess", "--ramps.min-highway-speed", "20", "--ramps.max-ramp-speed", "18")),
    ],
)
def test_gated_and_ordinary_vehicles_merge(
    tmp_path: Path, lanes: int, merge: str, options: tuple[str, ...]
) -> None:
    """By zipper, and over an acceleration lane; what is promised then says that SUMO's rules count."""
    network = ring(tmp_path, lanes, merge, *options)
    loops, others = routes(network, tmp_path, seed=lanes)
    summary = simulate(
        Scenario(
            network=str(network.file),
            routes=loops,
            traffic=others,
            duration_s=300.0,
            positions=True,
            on_deadlock="continue",
        ),
        tmp_path / "run",
    )
    assert summary["others"]["vehicles"] > 200
    assert summary["distance_km"] > 10.0
    assert (summary["collisions"], summary["trespasses"], summary["audit"]) == (0, 0, "clean")
    assert summary["promise"] == ""
