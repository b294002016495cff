"""How short the delays of a demand could be: what each loses alone, and the queues that no rule can avoid.

    python analysis/delay_bound.py NET ROUTES --begin 25200

drives all vehicles one after the other, each by itself under the gate: what they lose then, gaining speed and
in curves, no rule for junctions can save. Then all depart as they want to and drive as they did alone, and a
linear programme for each junction finds the least they have to wait there in all: each movement takes the
headway at which a queue is discharged, and of movements that cross each other one takes its turn at a time.
Changing from one movement to another costs nothing, nobody is in the way of who turns elsewhere, and each ten
minutes begin without queues, so no rule without interleaving waits less. Who waits at one junction comes late
to the next, so of the junctions only the worst counts.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import networkx as nx
import numpy as np
from any_traffic import RULES, config, only_between
from limit import HEADWAY_S, SPACE_M, Use, exclusive
from scipy import sparse
from scipy.optimize import linprog

from loopgate import Scenario
from loopgate.drive.track import Track
from loopgate.errors import RouteError
from loopgate.network.xml_file import read_xml
from loopgate.results.columns import EVENT, TIME, VEHICLE, Event
from loopgate.results.recorder import read_events
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate

APART_S = 90.0
"""For so long one has the roads to itself."""
PIECE_S = 600.0
"""Those who come in so long a time make one programme."""
SLOT_S = 0.5
"""The programme's unit of time."""
AFTER_S = 120.0
"""All have had their turn so long after the last has come."""


class Alone(NamedTuple):
    """How vehicles drive when each is by itself.

    Attributes
    ----------
    tracks
        Their ways, by vehicle.
    entered_s
        When each entered the legs of its way, counted from its departure.
    delay_s
        What they lose in the mean.
    """

    tracks: dict[str, Track]
    entered_s: dict[str, list[float]]
    delay_s: float


def one_by_one(routes: Path, file: Path) -> float:
    """Write the vehicles of a demand so that they depart far apart, in their order; return until when."""
    top = read_xml(routes, root="routes", what="route file", error=RouteError)
    some = sorted((one for one in top if one.get("depart")), key=lambda one: float(str(one.get("depart"))))
    for number, one in enumerate(some):
        one.set("depart", f"{number * APART_S:g}")
    ET.ElementTree(top).write(file, encoding="utf-8", xml_declaration=True)
    return APART_S * (len(some) + 1)


def alone(net: Path, routes: Path, seed: int, folder: Path) -> Alone:
    """Let each drive by itself, lights off."""
    file = folder / "alone.rou.xml"
    end_s = one_by_one(routes, file)
    how = {**RULES["gate"], "positions": False, "seed": seed, "duration_s": end_s}
    scenario = Scenario(network=str(config(net, file, 0.0, end_s, folder / "alone.sumocfg")), **how)
    summary = simulate(scenario, folder / "alone", overwrite=True)
    tracks = {str(d.track.vehicle): d.track for d in assemble(scenario).departures if d.track}
    events = read_events(folder / "alone" / "events.parquet")
    events = events[events[EVENT].isin((Event.START, Event.ENTER))]
    entered = {str(v): (times - times.iloc[0]).tolist() for v, times in events.groupby(VEHICLE)[TIME]}
    return Alone(tracks, entered, float(summary["mean_delay_s"]))


def reached_s(one: Alone, begins_s: Mapping[str, float]) -> dict[str, list[float]]:
    """Return by movement when vehicles that depart then come to it if nobody holds them up, in order."""
    found: dict[str, list[float]] = {}
    for vehicle, track in one.tracks.items():
        legs = track.legs[track.start_position :]
        times = one.entered_s[vehicle]
        if vehicle not in begins_s:
            continue
        for (leg, after), (entered_s, left_s) in zip(pairwise(legs), pairwise(times), strict=False):
            begin_m = max(leg.begin_m, track.front_m)
            pace = (left_s - entered_s) / max(0.1, after.begin_m - begin_m)
            for way in (way for way in leg.crossings if ":" not in way.id):
                at_s = entered_s + pace * max(0.0, leg.end_m + way.ahead_m - begin_m)
                found.setdefault(way.id, []).append(begins_s[vehicle] + at_s)
    return {way: sorted(times) for way, times in found.items()}


def uses(one: Alone) -> dict[str, Use]:
    """Return the movements over junctions; changing lanes on a road takes nothing."""
    found: dict[str, Use] = {}
    for track in one.tracks.values():
        for way in (way for leg in track.legs for way in leg.crossings if ":" not in way.id):
            begin, _, end = way.id.partition(">")
            found[way.id] = Use(HEADWAY_S + SPACE_M / way.speed_mps, begin, end, way.foes, {})
    return found


def junctions(turns: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the movements that have to do with each other, directly or through others."""
    graph: nx.Graph[str] = nx.Graph()
    for ways in turns:
        nx.add_path(graph, ways)
    return [sorted(some) for some in nx.connected_components(graph)]


def least_wait_s(
    times: Sequence[Sequence[float]], headway_s: Sequence[float], turns: Sequence[Sequence[int]]
) -> float:
    """Return no more than the least time that all vehicles together can wait for their turn at a junction.

    Time is cut into slots; whole vehicles may set out in parts. Of those that take turns together at most one
    sets out within a headway, rounded down to slots. What waits at the end of a slot is the programme's
    unknown: who came in a slot may go in the same one, so that what it waited less than a slot is taken off.

    Parameters
    ----------
    times
        When vehicles come to each movement [s].
    headway_s
        What one takes of it.
    turns
        Movements, by number, of which one takes its turn at a time.
    """
    begin_s = min(map(min, times))
    ways, slots = len(times), int((max(map(max, times)) - begin_s + AFTER_S) / SLOT_S)
    came, early_s = np.zeros((ways, slots)), 0.0
    for way, some in enumerate(times):
        for at_s in some:
            slot, rest_s = divmod(at_s - begin_s, SLOT_S)
            came[way, int(slot)] += 1
            early_s += rest_s
    # Who sets out: waiting before, and come, less waiting after.
    step: Any = sparse.eye(slots) - sparse.eye(slots, k=-1)
    nobody: Any = sparse.csr_matrix((slots, slots))
    within: list[Any] = [_sum_of_last(slots, max(1, int(h / SLOT_S))) for h in headway_s]
    rows: list[Any] = [sparse.kron(sparse.eye(ways), step)]
    limits = [came.ravel()]
    for turn in turns:
        rows.append(sparse.hstack([-within[w] @ step if w in turn else nobody for w in range(ways)]))
        limits.append(1.0 - np.sum([within[w] @ came[w] for w in turn], axis=0))
    most = np.full((ways, slots), np.inf)
    most[:, -1] = 0.0
    bounds: Any = np.stack([np.zeros(ways * slots), most.ravel()], axis=1)
    taken: Any = sparse.vstack(rows).tocsr()
    solved = linprog(
        np.full(ways * slots, SLOT_S),
        A_ub=taken,
        b_ub=np.concatenate(limits),
        bounds=bounds,
        method="highs-ipm",
    )
    if solved.fun is None:
        raise RuntimeError(solved.message)
    return max(0.0, float(solved.fun) - early_s)


def _sum_of_last(slots: int, number: int) -> Any:  # noqa: ANN401  a sparse matrix
    """Return what adds up so many slots up to each."""
    return sparse.diags([1.0] * number, [-k for k in range(number)], shape=(slots, slots))


def waits_s(times: Mapping[str, list[float]], found: Mapping[str, Use]) -> dict[str, float]:
    """Return the least that all have to wait at each junction, named by its first movement [s]."""
    turns = [list(ways) for ways in exclusive(found)]
    waits: dict[str, float] = {}
    for ways in junctions(turns):
        first_s = min(min(times[way]) for way in ways)
        pieces: dict[int, dict[str, list[float]]] = {}
        for way in ways:
            for at_s in times[way]:
                pieces.setdefault(int((at_s - first_s) / PIECE_S), {}).setdefault(way, []).append(at_s)
        waits[ways[0]] = sum(_piece_s(piece, found, turns) for piece in pieces.values())
    return waits


def _piece_s(
    piece: Mapping[str, list[float]], found: Mapping[str, Use], turns: Sequence[Sequence[str]]
) -> float:
    number = {way: k for k, way in enumerate(piece)}
    own = [[number[way] for way in turn if way in number] for turn in turns]
    headways = [found[way].headway_s for way in piece]
    return least_wait_s(list(piece.values()), headways, [turn for turn in own if turn])


def main() -> None:
    """Print what is lost alone, and the least waits."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("net", type=Path)
    parser.add_argument("routes", type=Path)
    parser.add_argument("--begin", type=float, default=0.0)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        end_s = given.begin + 3600.0 * given.hours
        routes = only_between(given.routes, given.begin, end_s, folder / "some.rou.xml")
        one = alone(given.net, routes, given.seed, folder)
        top = read_xml(routes, root="routes", what="route file", error=RouteError)
        begins_s = {str(v.get("id")): float(str(v.get("depart"))) for v in top if v.get("depart")}
    found, times = uses(one), reached_s(one, begins_s)
    waits = waits_s(times, {way: use for way, use in found.items() if way in times})
    worst, count = max(waits, key=lambda way: waits[way]), len(one.tracks)
    wait_s = waits[worst] / count
    print(f"{count} vehicles lose {one.delay_s:.2f} s each alone")
    print(f"at least {waits[worst]:.0f} s are waited at the junction of {worst}, {wait_s:.2f} s each")
    print(f"so no rule without interleaving has a mean delay below {one.delay_s + wait_s:.2f} s")


if __name__ == "__main__":
    main()
