"""Networks made on the spot with SUMO's own tools; netgenerate knows no roundabouts and narrow streets."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path

import sumo

Point = tuple[float, float]

_ASIDE = (("e", (1, 0)), ("n", (0, 1)), ("w", (-1, 0)), ("s", (0, -1)))


def netgenerate(options: str, file: Path) -> Path:
    """Write the network that these options of netgenerate make."""
    return _tool("netgenerate", options.split(), file)


def roundabouts(file: Path, *, lanes: int, options: str = "", side: int = 3) -> Path:
    """Write `side` by `side` roundabouts, 160 m apart, with one-way rings of as many lanes as their roads."""
    gap, radius = 160.0, 12.0 + 5.0 * lanes
    nodes: list[str] = []
    edges: list[str] = []
    for i in range(side):
        for j in range(side):
            arms = [
                (turn, name, step)
                for turn, (name, step) in enumerate(_ASIDE)
                if 0 <= i + step[0] < side and 0 <= j + step[1] < side
            ]
            for turn, name, step in arms:
                opposite = _ASIDE[(turn + 2) % 4][0]
                nodes.append(_node(f"{i}{j}{name}", (i * gap + radius * step[0], j * gap + radius * step[1])))
                edges.append(_edge(f"{i}{j}{name}", f"{i + step[0]}{j + step[1]}{opposite}", lanes))
            for (turn, name, _), (end, following, _) in zip(arms, [*arms[1:], arms[0]], strict=True):
                quarters = (end - turn) % 4
                angles = [pi / 2 * (turn + quarters * k / 12) for k in range(13)]
                curve = [(i * gap + radius * cos(a), j * gap + radius * sin(a)) for a in angles]
                edges.append(_edge(f"{i}{j}{name}", f"{i}{j}{following}", lanes, shape=curve, priority=9))
    return _convert(nodes, edges, file, f"--roundabouts.guess true {options}")


def roundabouts_in_a_row(
    file: Path, *, radius_m: float, lanes: int, arms: int, count: int = 1, slip: bool = False
) -> Path:
    """Write `count` roundabouts in a row, each with so many arms of 200 m or to the next one, 60 m away.

    With `slip` a lane leads past the first, from arm 1 to arm 2, which is its first way out. Ends are called
    ``E`` and a number.
    """
    between_m, arm_m = 2.0 * radius_m + 60.0, 200.0
    nodes: list[str] = []
    edges: list[str] = []
    ends = 0
    for one in range(count):
        x = one * between_m
        angles = [2.0 * pi * k / arms for k in range(arms)]
        for k, angle in enumerate(angles):
            nodes.append(_node(f"r{one}.{k}", (x + radius_m * cos(angle), radius_m * sin(angle))))
            end = 2.0 * pi * (k + 1) / arms
            turns = [angle + (end - angle) * step / 8 for step in range(9)]
            curve = [(x + radius_m * cos(a), radius_m * sin(a)) for a in turns]
            edges.append(_edge(f"r{one}.{k}", f"r{one}.{(k + 1) % arms}", lanes, shape=curve, priority=9))
            eastward, westward = k == 0, 2 * k == arms
            if (eastward and one + 1 < count) or (westward and one):
                other = f"r{one + 1}.{arms // 2}" if eastward else f"r{one - 1}.0"
                edges.append(_edge(f"r{one}.{k}", other, lanes))
                continue
            far = radius_m + arm_m
            nodes.append(_node(f"E{ends}", (x + far * cos(angle), far * sin(angle))))
            aside = slip and not one and k in {1, 2}
            if aside:
                fork = radius_m + 80.0
                nodes.append(_node(f"s{k}", (x + fork * cos(angle), fork * sin(angle))))
            ways = (f"E{ends}", f"s{k}", f"r{one}.{k}") if aside else (f"E{ends}", f"r{one}.{k}")
            for a, b in pairwise(ways):
                edges += [_edge(a, b, lanes), _edge(b, a, lanes)]
            ends += 1
    if slip:  # traffic drives on the right, so the ring is driven in the order of the arms
        edges.append(_edge("s1", "s2", 1))
    return _convert(nodes, edges, file, "--roundabouts.guess true")


MOTORWAY_MPS, RAMP_MPS = 33.3, 22.2


def on_ramp(file: Path, *, lanes: int, merging_m: float) -> Path:
    """Write a motorway ``A B C`` with a ramp ``R B``, beside which a lane for merging begins, if any."""
    nodes = [_node("A", (0, 0)), _node("B", (600, 0)), _node("C", (1400, 0)), _node("R", (250, -90))]
    edges = [
        _edge("A", "B", lanes, priority=9, speed=MOTORWAY_MPS),
        _edge("B", "C", lanes, priority=9, speed=MOTORWAY_MPS),
        _edge("R", "B", 1, speed=RAMP_MPS),
    ]
    guess = f"--ramps.guess true --ramps.ramp-length {merging_m:g}" if merging_m else ""
    return _convert(nodes, edges, file, guess)


def off_ramp(file: Path, *, lanes: int) -> Path:
    """Write a motorway ``A B C`` which a ramp ``B R`` leaves."""
    nodes = [_node("A", (0, 0)), _node("B", (800, 0)), _node("C", (1400, 0)), _node("R", (1150, -90))]
    edges = [
        _edge("A", "B", lanes, priority=9, speed=MOTORWAY_MPS),
        _edge("B", "C", lanes, priority=9, speed=MOTORWAY_MPS),
        _edge("B", "R", 1, speed=RAMP_MPS),
    ]
    return _convert(nodes, edges, file, "--ramps.guess true --ramps.ramp-length 200")


def lane_drop(file: Path, *, lanes: int, speed_mps: float) -> Path:
    """Write a road ``A B C`` that loses a lane at ``B``."""
    nodes = [_node("A", (0, 0)), _node("B", (600, 0)), _node("C", (1200, 0))]
    edges = [_edge("A", "B", lanes, speed=speed_mps), _edge("B", "C", lanes - 1, speed=speed_mps)]
    return _convert(nodes, edges, file, "")


def weaving(file: Path, *, lanes: int, length_m: float) -> Path:
    """Write a motorway ``A B C D`` with a ramp ``R B`` and another, ``C S``, that share a lane between."""
    at = {"A": (0, 0), "B": (600, 0), "C": (600 + length_m, 0), "D": (1200 + length_m, 0)}
    nodes = [_node(name, point) for name, point in at.items()]
    nodes += [_node("R", (250, -90)), _node("S", (950 + length_m, -90))]
    edges = [
        _edge("A", "B", lanes, priority=9, speed=MOTORWAY_MPS),
        _edge("B", "C", lanes + 1, priority=9, speed=MOTORWAY_MPS),
        _edge("C", "D", lanes, priority=9, speed=MOTORWAY_MPS),
        _edge("R", "B", 1, speed=RAMP_MPS),
        _edge("C", "S", 1, speed=RAMP_MPS),
    ]
    links = [("R-B", "B-C", 0, 0), ("B-C", "C-S", 0, 0)]
    links += [("A-B", "B-C", lane, lane + 1) for lane in range(lanes)]
    links += [("B-C", "C-D", lane + 1, lane) for lane in range(lanes)]
    named = [f'<connection from="{a}" to="{b}" fromLane="{i}" toLane="{j}"/>' for a, b, i, j in links]
    return _convert(nodes, edges, file, "", connections=named)


def dead_end_street(file: Path) -> Path:
    """Write a street of two lanes each way, with a side street: vehicles come back only by turning round."""
    at = {"a": (0, 0), "b": (150, 0), "c": (300, 0), "d": (450, 0), "e": (300, 120)}
    nodes = [_node(name, point) for name, point in at.items()]
    pairs = [("a", "b"), ("b", "c"), ("c", "d"), ("c", "e")]
    edges = [_edge(*ends, lanes=2) for pair in pairs for ends in (pair, pair[::-1])]
    return _convert(nodes, edges, file, "", turnarounds=True)


def narrow_streets(file: Path) -> Path:
    """Write a grid of four by four junctions in which every other street has one lane for both directions.

    The two lanes of such a street lie 0.8 m apart; exactly on each other, netconvert would move them aside.
    """
    side, gap = 4, 120.0
    nodes = [_node(f"{i}{j}", (i * gap, j * gap)) for i in range(side) for j in range(side)]
    edges: list[str] = []
    for i, j, right in _streets(side):
        ends = (i, j), (i + right, j + 1 - right)
        narrow = (i + j + right) % 4 == 0
        for (a, b), (c, d) in (ends, ends[::-1]):
            along = [(a + (c - a) * t, b + (d - b) * t) for t in (0.2, 0.5, 0.8)]
            beside = [(x * gap + 0.4 * (d - b), y * gap - 0.4 * (c - a)) for x, y in along]
            shape = [(a * gap, b * gap), *beside, (c * gap, d * gap)] if narrow else ()
            edges.append(_edge(f"{a}{b}", f"{c}{d}", 1, shape=shape, centred=narrow))
    return _convert(nodes, edges, file, "")


def small_roundabout(file: Path) -> Path:
    """Write a ring of four edges of 11 m, ``r0`` to ``r3``, a long street ``in`` and a short one ``out``."""
    corners = ((0, 0), (14, 0), (14, 14), (0, 14))
    nodes = [_node(f"R{k}", at) for k, at in enumerate(corners)] + [_node("A", (36, 36))]
    ring = [_named(f"r{k}", f"R{k}", f"R{(k + 1) % 4}", speed=8, priority=2) for k in range(4)]
    way_in = _named("in", "A", "R0", speed=8, shape=[(36, 36), (60, -20), (10, -60), (-30, -30), (0, 0)])
    return _convert(nodes, [*ring, way_in, _named("out", "R2", "A", speed=8)], file, "")


def two_rings_of_road(file: Path) -> Path:
    """Write two rings of 160 m, ``e00`` to ``e03`` and ``e10`` to ``e13``, to be driven at 30 m/s."""
    corners = ((0, 0), (40, 0), (40, 40), (0, 40))
    nodes = [_node(f"n{k}{j}", (500 * k + x, y)) for k in range(2) for j, (x, y) in enumerate(corners)]
    edges = [
        _named(f"e{k}{j}", f"n{k}{j}", f"n{k}{(j + 1) % 4}", speed=30) for k in range(2) for j in range(4)
    ]
    return _convert(nodes, edges, file, "--junctions.limit-turn-speed=-1")


def _named(
    name: str, begin: str, end: str, *, speed: float, priority: int = 1, shape: Sequence[Point] = ()
) -> str:
    line = " ".join(f"{x},{y}" for x, y in shape)
    drawn = f' shape="{line}"' if shape else ""
    return f'<edge id="{name}" from="{begin}" to="{end}" speed="{speed}" priority="{priority}"{drawn}/>'


def _streets(side: int) -> Iterator[tuple[int, int, int]]:
    for i in range(side):
        for j in range(side):
            if i + 1 < side:
                yield i, j, 1
            if j + 1 < side:
                yield i, j, 0


def _node(name: str, at: Point) -> str:
    return f'<node id="{name}" x="{at[0]:.2f}" y="{at[1]:.2f}" type="priority"/>'


def _edge(
    begin: str,
    end: str,
    lanes: int,
    *,
    shape: Sequence[Point] = (),
    priority: int = 1,
    centred: bool = False,
    speed: float = 13.9,
) -> str:
    drawn = " ".join(f"{x:.2f},{y:.2f}" for x, y in shape)
    return (
        f'<edge id="{begin}-{end}" from="{begin}" to="{end}" numLanes="{lanes}" priority="{priority}"'
        f' speed="{speed}"'
        + (f' shape="{drawn}"' if drawn else "")
        + (' spreadType="center"' if centred else "")
        + "/>"
    )


def _convert(
    nodes: Sequence[str],
    edges: Sequence[str],
    file: Path,
    options: str,
    *,
    turnarounds: bool = False,
    connections: Sequence[str] = (),
) -> Path:
    for kind, lines in (("node", nodes), ("edge", edges), ("connection", connections)):
        text = "\n".join((f"<{kind}s>", *lines, f"</{kind}s>"))
        file.with_suffix(f".{kind}").write_text(text, encoding="utf-8")
    given = ["-n", str(file.with_suffix(".node")), "-e", str(file.with_suffix(".edge"))]
    given += ["-x", str(file.with_suffix(".connection"))] if connections else []
    given += [] if turnarounds else ["--no-turnarounds"]
    return _tool("netconvert", [*given, *options.split()], file)


def short_last_road(file: Path) -> Path:
    """Write a road that leads to either of two lanes of one that is too short to wait on."""
    nodes = [_node(name, (x, 0.0)) for name, x in (("a", 0.0), ("b", 200.0), ("c", 206.0), ("d", 400.0))]
    edges = [_edge("a", "b", 1), _edge("b", "c", 2), _edge("c", "d", 1)]
    return _convert(nodes, edges, file, "")


def _tool(name: str, options: Sequence[str], file: Path) -> Path:
    tool = Path(sumo.SUMO_HOME) / "bin" / name
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([str(tool), *options, "-o", str(file)], check=True, capture_output=True, env=environment)
    return file
