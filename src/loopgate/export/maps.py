"""Loops and runs on maps: GeoJSON, GPX and KML, with turn lists and the day of each vehicle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from loopgate.analysis import compute_waits
from loopgate.arrays import Floats
from loopgate.audit.layout import read_layout
from loopgate.errors import ResultsError
from loopgate.export.formats import Features, feature, file_names, geojson, gpx, kml, write
from loopgate.network.loop import Loop
from loopgate.network.projection import Projection
from loopgate.network.road import RoadNetwork
from loopgate.reading import refusing
from loopgate.replay.scene import DrawnLines, find_lines
from loopgate.results import columns as c
from loopgate.results.columns import LONGEST, WAIT, WAITS, Event
from loopgate.results.table_reading import csv_of, read_summary, read_table
from loopgate.simulation.run_folder import LAYOUT


def export_loops(
    network: RoadNetwork, loops: Sequence[Loop], folder: Path | str, *, left_out: Mapping[str, str] = {}
) -> list[Path]:
    """Write loops and their streets as map files (GeoJSON, GPX, KML); return their paths.

    ``loops.geojson`` and ``streets.geojson`` hold all loops and streets; ``loops/NAME.gpx`` and
    ``loops/NAME.kml`` hold one loop with its turn list. Longitude and latitude (WGS 84) follow from the
    network's projection.

    Raises `NetworkError` if the network has no projection, `ResultsError` if a file cannot be written.

    Parameters
    ----------
    left_out
        Reasons why streets are not covered, by edge; these streets are written too.

    Examples
    --------
    >>> from loopgate import RoadNetwork, find_loops
    >>> from loopgate.export import export_loops
    >>> network = RoadNetwork.open("sumo:DRT")
    >>> files = export_loops(network, find_loops(network, 1, seed=1).loops, "out/maps")
    >>> [file.name for file in files]
    ['loops.geojson', 'streets.geojson', 'loop0.gpx', 'loop0.kml']
    """
    projection = Projection.of(network)
    ways = [loop_line(loop) for loop in loops]
    folder = Path(folder)
    on: dict[str, list[str]] = {}
    for way in ways:
        for edge in dict.fromkeys(way.edges):
            on.setdefault(edge, []).append(way.name)
    streets = [
        street_feature(
            network, projection, edge, loops=" ".join(on.get(edge, [])), why_not=left_out.get(edge)
        )
        for edge in [*on, *(edge for edge in left_out if edge not in on)]
    ]
    return [
        write(folder / "loops.geojson", geojson(loop_features(network, projection, ways))),
        write(folder / "streets.geojson", geojson(streets)),
        *write_ways(network, projection, ways, folder / "loops"),
    ]


def street_feature(
    network: RoadNetwork, projection: Projection, edge: str, **more: object
) -> dict[str, object]:
    """Return an edge as a feature: rightmost lane, name, name of the street, length [m], and more."""
    record = network.edges[edge]
    line = projection.lonlat(record.lanes[0].shape)
    return feature(line, edge=edge, street=record.street, length_m=record.length_m, **more)


def loop_features(network: RoadNetwork, projection: Projection, ways: Sequence[LoopLine]) -> Features:
    """Return loops as features: name, length of a lap [m], number of edges, streets in driving order."""
    return [
        feature(
            projection.lonlat(way.line),
            loop=way.name,
            length_m=way.length_m,
            edges=len(way.edges),
            streets=", ".join(dict.fromkeys(filter(None, (network.edges[e].street for e in way.edges)))),
        )
        for way in ways
    ]


def write_ways(
    network: RoadNetwork, projection: Projection, ways: Sequence[LoopLine], folder: Path
) -> list[Path]:
    """Write each loop as GPX and KML, with its turn list; return the files."""
    names = file_names(way.name for way in ways)
    files = []
    for way in ways:
        line = projection.lonlat(way.line)
        turns = list(_told(network, projection, way))
        files.append(write(folder / f"{names[way.name]}.gpx", gpx(way.name, line, turns)))
        files.append(write(folder / f"{names[way.name]}.kml", kml(way.name, line, turns)))
    return files


def _told(network: RoadNetwork, projection: Projection, way: LoopLine) -> list[tuple[Floats, str, str]]:
    turns = find_turns(network, way.edges, way.begins_m)
    points = projection.lonlat(np.array([turn.point for turn in turns]))
    return [
        (point, turn.text, f"at {turn.at_m:.0f} m, edge {turn.edge}")
        for point, turn in zip(points, turns, strict=True)
    ]


_STRAIGHT_DEG = 30.0
_ROUND_DEG = 150.0


@dataclass(frozen=True, slots=True)
class RouteTurn:
    """One line of a loop's turn list: an instruction and its position on the map."""

    at_m: float
    """Distance from the loop's beginning [m]."""
    point: tuple[float, float]
    """Where the street begins, network coordinates [m]."""
    text: str
    edge: str


@dataclass(frozen=True, slots=True)
class LoopLine:
    """A loop as a line on the map.

    Attributes
    ----------
    name
        The name of the loop.
    line
        Points of a lap, network coordinates [m], shape (n, 2).
    edges
        Edges in driving order.
    begins_m
        Distance of each edge's beginning from the loop's beginning [m].
    length_m
        Length of a lap [m].
    """

    name: str
    line: Floats
    edges: tuple[str, ...]
    begins_m: tuple[float, ...]
    length_m: float


def loop_line(loop: Loop) -> LoopLine:
    """Return a loop as a line on the map; the line is closed if the loop is.

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> from loopgate.export import loop_line
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> way = loop_line(read_loops(network, "routes/ring3.rou.xml").loops[0])
    >>> way.edges[0], len(way.begins_m) == len(way.edges)
    ('p1b', True)
    """
    points = loop.curve()[0]
    line = np.vstack((points, points[:1])) if loop.closed else points
    begins = tuple(span.begin_m for span in loop.roads)
    return LoopLine(loop.id, distinct(line), loop.edges, begins, loop.length_m)


def distinct(line: Floats) -> Floats:
    """Return a line without repeated points."""
    keep = np.concatenate(([True], np.abs(np.diff(line, axis=0)).max(axis=1, initial=0.0) > 0.0))
    kept: Floats = line[keep] if keep.sum() > 1 else line[:2]
    return kept


def find_turns(network: RoadNetwork, edges: Sequence[str], begins_m: Sequence[float]) -> list[RouteTurn]:
    """Return the turn list of a loop: its first street, each turn, and each new street name.

    Turns of less than 30 degrees are *straight on*, those of more than 150 degrees *turn round*.

    Parameters
    ----------
    edges
        Edges in driving order; the last leads to the first.
    begins_m
        Distance of each edge's beginning from the loop's beginning [m].

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> from loopgate.export import find_turns, loop_line
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> way = loop_line(read_loops(network, "routes/ring3.rou.xml").loops[0])
    >>> [turn.text for turn in find_turns(network, way.edges, way.begins_m)][0]
    'start on edge p1b'
    """
    turns: list[RouteTurn] = []
    for k, (edge, at_m) in enumerate(zip(edges, begins_m, strict=True)):
        here, before = network.edges[edge], network.edges[edges[k - 1]]
        point = here.lanes[0].shape[0]
        if k == 0:
            turns.append(RouteTurn(at_m, point, f"start on {_called(here.street, edge)}", edge))
            continue
        angle = _heading(here.lanes[0].shape[:2]) - _heading(before.lanes[0].shape[-2:])
        angle = (angle + 180.0) % 360.0 - 180.0
        if abs(angle) < _STRAIGHT_DEG and here.street == before.street:
            continue
        into = "on" if here.street and here.street == before.street else "into"
        what = "straight on" if abs(angle) < _STRAIGHT_DEG else _TURNS[angle > 0.0]
        what = "turn round" if abs(angle) > _ROUND_DEG else what
        turns.append(RouteTurn(at_m, point, f"{what} {into} {_called(here.street, edge)}", edge))
    return turns


_TURNS = {True: "turn left", False: "turn right"}


def _called(street: str, edge: str) -> str:
    return street or f"edge {edge}"


def _heading(points: Sequence[tuple[float, float]]) -> float:
    """Return the direction from the first to the last point [degrees], against the clock from east."""
    (x, y), (u, v) = points[0], points[-1]
    return float(np.degrees(np.arctan2(v - y, u - x)))


LAYERS = ("streets", "loops", "places")
"""What is written of a run as GeoJSON."""

_TOLD = {
    Event.START: "starts",
    Event.EDGE: "enters",
    Event.LAP: "completes a lap",
    Event.HOLD: "is held",
    Event.GO: "goes on",
    Event.STOP: "makes a stop",
    Event.SERVED: "ends its stop",
    Event.PARK: "parks",
    Event.RETURN: "returns to the road",
    Event.END: "leaves the gate",
}
_OF_STREETS = (c.VISITS, c.MEAN_REVISIT, c.IDLENESS, c.WORST_IDLENESS, c.BOUND, c.WITHIN)


@dataclass(frozen=True, slots=True)
class _Made:
    """A run folder with its network."""

    network: RoadNetwork
    projection: Projection
    summary: dict[str, Any]
    events: pd.DataFrame
    edges: pd.DataFrame
    loops: pd.DataFrame
    streets: pd.DataFrame
    lines: DrawnLines
    room: dict[str, int]


def export_run(folder: Path | str, out: Path | str) -> list[Path]:
    """Write a run as map files (GeoJSON, GPX, KML) and spreadsheets (CSV); return their paths.

    ``streets.geojson`` (visits, idleness, time standing), ``loops.geojson``, ``places.geojson`` (capacity and
    waits), ``loops/NAME.gpx`` and ``.kml`` of each loop with its turn list, ``days/VEHICLE.csv`` of each
    vehicle. Longitude and latitude (WGS 84) follow from the network's projection.

    Raises `NetworkError` if the network is not found or has no projection, `ResultsError` if the folder is
    no run folder or a file cannot be written.

    Parameters
    ----------
    folder
        The run folder.
    out
        The folder to write.

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> from loopgate.export import export_run
    >>> made = run(Scenario(network="sumo:DRT", loops=1, vehicles=2, duration_s=60), "out/mapped")
    >>> [file.name for file in export_run("out/mapped", "out/mapped/maps")][:3]
    ['streets.geojson', 'loops.geojson', 'places.geojson']
    """
    made, out = _read(Path(folder)), Path(out)
    files = [write(out / f"{name}.geojson", geojson(_features(made, name))) for name in LAYERS]
    files += write_ways(made.network, made.projection, _ways(made), out / "loops")
    vehicles = made.events[c.VEHICLE].drop_duplicates().sort_values()
    names = file_names(map(str, vehicles))
    for vehicle in names:
        text = csv_of(_day(made, vehicle))
        files.append(write(out / "days" / f"{names[vehicle]}.csv", text))
    return files


def run_features(folder: Path | str, layer: str = "streets") -> Features:
    """Return a map layer of a run as GeoJSON features.

    Raises `ResultsError` if the layer is unknown or `folder` is no run folder, `NetworkError` if the network
    is not found or has no projection.

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> from loopgate.export import run_features
    >>> made = run(Scenario(network="sumo:DRT", loops=1, vehicles=2, duration_s=60), "out/layers")
    >>> run_features("out/layers", "loops")[0]["properties"]["loop"]
    'loop0'
    """
    if layer not in LAYERS:
        msg = f"{layer}: no layer of a run; expected {', '.join(LAYERS)}"
        raise ResultsError(msg)
    return _features(_read(Path(folder)), layer)


def vehicle_day(folder: Path | str, vehicle: str) -> pd.DataFrame:
    """Return all events of one vehicle in order of time.

    Columns: `TIME` [s], ``clock`` (h:mm:ss), ``what``, `STREET`, `EDGE`, ``lon`` and ``lat`` [degrees] of the
    edge's beginning. Raises `ResultsError` if the run has no such vehicle, and the errors of `export_run`.

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> from loopgate.export import vehicle_day
    >>> made = run(Scenario(network="sumo:DRT", loops=1, vehicles=2, duration_s=60), "out/days")
    >>> vehicle_day("out/days", "v1")["what"].iloc[0]
    'starts'
    """
    made = _read(Path(folder))
    if vehicle not in set(made.events[c.VEHICLE]):
        msg = f"{folder}: the run has no vehicle {vehicle}"
        raise ResultsError(msg)
    return _day(made, vehicle)


def _read(folder: Path) -> _Made:
    with refusing(folder, "run folder", ResultsError):
        summary = read_summary(folder)
        network = RoadNetwork.open(str(summary["network"]))
        projection = Projection.of(network)

        def table(name: str, columns: tuple[str, ...]) -> pd.DataFrame:
            file = folder / f"{name}.parquet"
            return read_table(file, columns, made_by="") if file.is_file() else pd.DataFrame(columns=columns)

        layout = read_layout(folder / LAYOUT) if (folder / LAYOUT).is_file() else None
        return _Made(
            network=network,
            projection=projection,
            summary=dict(summary),
            events=read_table(folder / "events.parquet", c.EVENT_COLUMNS[:5], made_by=""),
            edges=table("edges", c.EDGE_COLUMNS),
            loops=table("loops", c.LOOP_COLUMNS),
            streets=table("streets", c.STREET_COLUMNS),
            lines=find_lines(layout) if layout else DrawnLines({}, {}, (), {}, ()),
            room=dict(layout.room) if layout else {},
        )


def _features(made: _Made, layer: str) -> Features:
    if layer == "loops":
        return loop_features(made.network, made.projection, _ways(made))
    return list(_streets(made) if layer == "streets" else _places(made))


def _streets(made: _Made) -> Iterator[dict[str, Any]]:
    """Yield all streets open to the vehicles, or only the streets on loops if no others are known."""
    known = made.streets if len(made.streets) else made.edges
    stood = made.edges.set_index(c.EDGE)
    for row in known.to_dict("records"):
        edge = str(row[c.EDGE])
        if edge not in made.network.edges:
            continue
        figures = {name: row[name] for name in _OF_STREETS if name in row}
        for name in (c.STOOD, c.EDGE_HOLD):
            figures[name] = stood[name].get(edge) if name in stood else None
        yield street_feature(made.network, made.projection, edge, **figures)


def _places(made: _Made) -> Iterator[dict[str, Any]]:
    """Yield the places of the gate: how many vehicles each holds, and how long vehicles waited for it."""
    end_s = float(made.events[c.TIME].max()) if len(made.events) else 0.0
    begin_s = float(made.summary.get(c.BEGINS, 0.0))
    waits = pd.DataFrame(columns=[c.PLACE, WAIT])
    if end_s > begin_s:
        waits = compute_waits(events=made.events, begin_s=begin_s, end_s=end_s)
    waited = {str(name): part.to_numpy(dtype=float) for name, part in waits.groupby(c.PLACE)[WAIT]}
    for name, line in made.lines.places.items():
        times_s = waited.get(name, np.zeros(0))
        yield feature(
            made.projection.lonlat(line),
            place=name,
            vehicles=made.room.get(name, 1),
            **{WAITS: times_s.size, WAIT: times_s.sum(), LONGEST: times_s.max(initial=0.0)},
        )


def _ways(made: _Made) -> list[LoopLine]:
    ways = []
    for name, part in made.loops.groupby(c.LOOP, sort=False):
        edges = tuple(map(str, part[c.EDGE]))
        begins = tuple(map(float, part[c.EDGE_BEGIN]))
        line = made.lines.loops.get(str(name))
        if line is None:  # no gate kept its loops: edges one behind the other
            line = np.concatenate([made.network.edges[edge].lanes[0].shape for edge in edges])
        line = distinct(np.vstack((line, line[:1])))
        length = float(np.hypot(*np.diff(line, axis=0).T).sum())
        ways.append(LoopLine(str(name), line, edges, begins, length))
    return ways


def _clock(seconds: int) -> str:
    return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def _day(made: _Made, vehicle: str) -> pd.DataFrame:
    """Return the rows of `vehicle_day`."""
    events = made.events[
        (made.events[c.VEHICLE] == vehicle) & made.events[c.EVENT].isin([str(kind) for kind in _TOLD])
    ]
    told = {str(kind): words for kind, words in _TOLD.items()}
    entered = events[c.PLACE].where(events[c.EVENT] == str(Event.EDGE)).ffill()
    seconds = events[c.TIME].to_numpy(dtype=float)
    frame = pd.DataFrame(
        {
            c.TIME: seconds,
            "clock": [_clock(int(second)) for second in seconds],
            "what": events[c.EVENT].map(told),
        }
    )
    edges = [edge if edge in made.network.edges else None for edge in entered]
    frame[c.STREET] = [made.network.edges[edge].street if edge else "" for edge in edges]
    frame[c.EDGE] = [edge or "" for edge in edges]
    at = np.array(
        [made.network.edges[edge].lanes[0].shape[0] if edge else (np.nan, np.nan) for edge in edges]
    )
    lonlat = made.projection.lonlat(np.nan_to_num(at))
    known = ~np.isnan(at.reshape(-1, 2)[:, 0])
    for column, name in enumerate(("lon", "lat")):
        frame[name] = np.where(known, lonlat[:, column].round(7), np.nan)
    return frame.reset_index(drop=True)
