"""Reads a run from its folder, as the replay shows it.

Under a gate, these spans follow from the events. Under SUMO's own rules there are no grants: the vehicles in
each place then follow from the distances that they have driven.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
import pyarrow.parquet as pq
import shapely

from loopgate.analysis.standing import edge_of
from loopgate.arrays import Floats, Ints
from loopgate.audit.layout import Layout, LoopWay, read_layout
from loopgate.errors import LoopgateError, ResultsError
from loopgate.gates import Reason
from loopgate.network import RoadNetwork
from loopgate.network.loop import arc_lengths, cut_curve, gap
from loopgate.reading import read_toml, refusing
from loopgate.replay.pack import Pack
from loopgate.replay.tracks import LARGEST_M, MOST_STEPS, PER_M, TURN, Tracks, make_tracks, read_tracks
from loopgate.results.columns import EVENT, FRONT, FRONTS_PER_M, PLACE, REASON, TIME, VEHICLE, Event
from loopgate.results.recorder import read_events
from loopgate.results.table_reading import NO_PARQUET, check_columns, read_summary
from loopgate.simulation import run_folder


def read_fronts(file: Path, step_s: float, layout: Layout) -> Tracks:
    """Read the positions of the fronts along their loops (``fronts.parquet``).

    A vehicle on the lane of its loop is drawn within 0.15 m of its position in SUMO. A vehicle on another
    lane, or about to change lanes, is drawn on the lane of its loop.

    Raises `ResultsError` if the file cannot be read, does not fit the layout, or has no vehicle.
    """
    names = tuple(layout.vehicles)
    numbers = {name: number for number, name in enumerate(names)}
    with refusing(file, "table", ResultsError, wrong=NO_PARQUET):
        check_columns(pq.read_schema(file), (TIME, VEHICLE, FRONT), file)
        table = pq.read_table(file, columns=[TIME, VEHICLE, FRONT], read_dictionary=[VEHICLE])
        table.validate(full=True)
        if not len(table):
            msg = f"{file}: there is nobody in it"
            raise ResultsError(msg)
        words = table.column(VEHICLE).unify_dictionaries().combine_chunks()
        known = np.array([numbers[word] for word in words.dictionary.to_pylist()], dtype=np.int64)
        vehicle = known[words.indices.to_numpy(zero_copy_only=False)]
        steps = np.rint(table.column(TIME).to_numpy() / step_s)
        if not (np.abs(steps) <= MOST_STEPS).all():
            msg = f"{TIME} is no time of a run"
            raise ValueError(msg)
        step = steps.astype(np.int64)
        front_m = table.column(FRONT).to_numpy().astype(np.float64) / FRONTS_PER_M
    # What is recorded begins after the second step; after the first those on the road stand where they start.
    there = np.unique(vehicle[step == step.min()])
    starts = np.array([body.start_m for body in layout.vehicles.values()])
    vehicle = np.concatenate((there, vehicle))
    step = np.concatenate((np.full(len(there), step.min() - 1), step))
    front_m = np.concatenate((starts[there], front_m))
    order = np.lexsort((step, vehicle))
    vehicle, step, front_m = vehicle[order], step[order], front_m[order]
    ends = np.searchsorted(vehicle, np.arange(len(names) + 1))
    x, y, heading = np.empty((3, len(step)))
    curves = {name: loop_curve(layout, loop) for name, loop in layout.loops.items()}
    for number, body in enumerate(layout.vehicles.values()):
        rows = slice(ends[number], ends[number + 1])
        curve, lap_m = curves[body.loop], layout.loops[body.loop].length_m
        with np.errstate(invalid="ignore", divide="ignore"):  # told below
            x[rows], y[rows] = front = _at(curve, lap_m, front_m[rows])
            east, north = front - _at(curve, lap_m, front_m[rows] - body.length_m)
        heading[rows] = np.arctan2(east, north) * (TURN / (2.0 * np.pi))
    if not (np.abs((x, y)) <= LARGEST_M).all():
        msg = f"{file}: vehicles are nowhere on the loops of the layout beside it"
        raise ResultsError(msg)
    whole = (np.rint(values).astype(np.int64) for values in (x * PER_M, y * PER_M, heading))
    across, up, turn = whole
    return make_tracks(names, step_s, (step, vehicle, across, up, turn % TURN), front_m)


def _at(curve: tuple[Floats, Floats], lap_m: float, arc_m: Floats) -> Floats:
    """Return the points at some arc lengths, of shape (2, n) [m]."""
    points, arcs = curve
    return np.array([np.interp(arc_m % lap_m, arcs, points[:, axis]) for axis in (0, 1)])


WHY: dict[str, str] = {str(reason): reason.words for reason in Reason if reason is not Reason.FREE}
"""The reason of a refusal, in words for readers."""

_MOVED_M = 2.0
"""A deadlock is over when one of its vehicles has moved farther than this [m]."""


class TimeSpan(NamedTuple):
    """A span of time: its place, way or reason, its vehicle, its first and last step."""

    what: int
    vehicle: int
    begin: int
    end: int
    why: int = 0


@dataclass(frozen=True, slots=True)
class Circle:
    """A deadlock: vehicles that each wait for the next, from step `begin` to step `end`."""

    vehicles: tuple[int, ...]
    begin: int
    end: int


@dataclass(slots=True)
class Happenings:
    """All events of a run for the replay, encoded as numbers."""

    visits: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle held a slot of a place."""
    passages: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle held a link: from its grant until its rear was in the next place."""
    refusals: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle was refused on a link, with the number of the reason in `WHY`."""
    holds: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle stood at a gate; `what` is 0."""
    laps: list[tuple[int, int]] = field(default_factory=list)
    mishaps: list[tuple[int, int, str]] = field(default_factory=list)
    """`laps`: vehicle and step of each lap. `mishaps`: vehicle and step of each mishap, and its kind."""
    circles: list[Circle] = field(default_factory=list)
    """Deadlocks in the order in which they were detected."""


def find_happenings(
    events: pd.DataFrame, tracks: Tracks, layout: Layout | None, ways: DrawnLines
) -> Happenings:
    """Return the spans of a run.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in the order of time.
    tracks
        Its vehicles are those of the layout first.
    layout, ways
        Places and ways, as far as known; without them there are laps, holds, mishaps and deadlocks only.
    """
    found = Happenings()
    reader = _Reader(tracks, layout, ways, found)
    names = {name: number for number, name in enumerate(tracks.vehicles)}
    columns = (events[name].to_numpy() for name in (TIME, VEHICLE, EVENT, PLACE, REASON))
    for time_s, name, event, place, reason in zip(*columns, strict=True):
        vehicle = names.get(name)
        if vehicle is not None:
            reader.take(tracks.frame(time_s), vehicle, event, place, names.get(reason, -1), reason)
    reader.close()
    if layout is not None and not found.visits:
        found.visits.extend(
            _visits_as_driven(tracks, layout, {name: n for n, name in enumerate(ways.places)})
        )
    for spans in (found.visits, found.passages):
        spans.sort(key=lambda span: (span.what, span.begin))
    for spans in (found.refusals, found.holds):
        spans.sort(key=lambda span: (span.vehicle, span.begin))
    return found


class _Reader:
    """Reads events one by one and closes the spans that they end."""

    def __init__(self, tracks: Tracks, layout: Layout | None, ways: DrawnLines, found: Happenings) -> None:
        self._tracks = tracks
        self._rows = tracks.rows_of()
        self._found = found
        self._places = {name: number for number, name in enumerate(ways.places)}
        self._why = {reason: number for number, reason in enumerate(WHY)}
        bodies = list(layout.vehicles.values()) if layout else []
        self._links = [ways.after[body.loop] for body in bodies]
        self._leg = [body.leg for body in bodies]
        self._length_m = [body.length_m for body in bodies]
        self._inside: list[list[tuple[int, int]]] = [[] for _ in tracks.vehicles]
        self._passing: list[list[tuple[int, int]]] = [[] for _ in tracks.vehicles]
        self._refused: dict[int, tuple[int, int, int]] = {}
        self._held: dict[int, int] = {}
        self._waiting: dict[int, list[tuple[int, int]]] = {}

    def take(self, frame: int, vehicle: int, event: str, place: str, other: int, reason: str) -> None:
        """Read an event; `other` is the vehicle that its reason names, if there is one."""
        if event == Event.LAP:
            self._found.laps.append((vehicle, frame))
        elif event == Event.HOLD:
            self._held.setdefault(vehicle, frame)
        elif event == Event.GO:
            self._go(vehicle, frame)
        elif event == Event.DEADLOCK:
            self._waiting.setdefault(frame, []).append((vehicle, other))
        elif event in {Event.COLLISION, Event.TELEPORT, Event.OVERRUN, Event.STRAY}:
            self._found.mishaps.append((vehicle, frame, str(event)))
        elif vehicle < len(self._leg) and place in self._places:
            self._move(frame, vehicle, event, self._places[place], reason)

    def _move(self, frame: int, vehicle: int, event: str, place: int, reason: str) -> None:
        if event in {Event.START, Event.GRANT}:
            if event == Event.GRANT:
                self._answered(vehicle, frame)
                self._passing[vehicle].append((self._link(vehicle), frame))
                self._leg[vehicle] += 1
            self._inside[vehicle].append((place, frame))
        elif event == Event.REFUSE:
            self._answered(vehicle, frame)
            self._refused[vehicle] = (self._link(vehicle), frame, self._why.get(reason, -1))
        elif event == Event.ENTER and self._passing[vehicle]:
            link, begin = self._passing[vehicle].pop(0)
            self._found.passages.append(TimeSpan(link, vehicle, begin, self._rear_in(vehicle, frame)))
        elif event == Event.LEAVE:
            at = next((k for k, (here, _) in enumerate(self._inside[vehicle]) if here == place), None)
            if at is not None:
                _, begin = self._inside[vehicle].pop(at)
                self._found.visits.append(TimeSpan(place, vehicle, begin, frame))

    def close(self) -> None:
        """End the open spans at the end of the run, and measure its deadlocks."""
        last = self._tracks.frames
        for vehicle, inside in enumerate(self._inside):
            self._found.visits.extend(TimeSpan(place, vehicle, begin, last) for place, begin in inside)
        for vehicle, passing in enumerate(self._passing):
            self._found.passages.extend(TimeSpan(link, vehicle, begin, last) for link, begin in passing)
        for vehicle in list(self._refused):
            self._answered(vehicle, last)
        for vehicle in list(self._held):
            self._go(vehicle, last)
        for noticed, waiting in sorted(self._waiting.items()):
            vehicles = tuple(vehicle for vehicle, _ in waiting)
            over = min(self._moves_on(vehicle, noticed) for vehicle in vehicles)
            begin = max(self._stands_from(vehicle, noticed) for vehicle in vehicles)
            self._found.circles.append(Circle(vehicles, begin, over))

    def _link(self, vehicle: int) -> int:
        links = self._links[vehicle]
        return links[self._leg[vehicle] % len(links)]

    def _answered(self, vehicle: int, frame: int) -> None:
        before = self._refused.pop(vehicle, None)
        if before is not None:
            link, begin, why = before
            self._found.refusals.append(TimeSpan(link, vehicle, begin, frame, why))

    def _go(self, vehicle: int, frame: int) -> None:
        begin = self._held.pop(vehicle, None)
        if begin is not None:
            self._found.holds.append(TimeSpan(0, vehicle, begin, frame))

    def _rear_in(self, vehicle: int, frame: int) -> int:
        """Return the step in which the rear is where the front was at step `frame`."""
        for begin, rows in self._rows.get(vehicle, ()):
            driven = self._tracks.odometer_m[rows]
            if begin <= frame < begin + len(driven):
                behind = driven[frame - begin] + self._length_m[vehicle]
                return begin + int(np.searchsorted(driven, behind))
        return frame

    def _stands_from(self, vehicle: int, frame: int) -> int:
        """Return the first step since which a vehicle has stood where it is at step `frame`."""
        for begin, rows in self._rows.get(vehicle, ()):
            x, y = self._tracks.x[rows], self._tracks.y[rows]
            if begin <= frame < begin + len(x):
                k = frame - begin
                far = np.hypot(x[: k + 1] - x[k], y[: k + 1] - y[k]) > _MOVED_M * PER_M
                return begin + int(np.flatnonzero(far)[-1]) + 1 if far.any() else begin
        return frame

    def _moves_on(self, vehicle: int, frame: int) -> int:
        for begin, rows in self._rows.get(vehicle, ()):
            x, y = self._tracks.x[rows], self._tracks.y[rows]
            if begin <= frame < begin + len(x):
                k = frame - begin
                far = np.hypot(x[k:] - x[k], y[k:] - y[k]) > _MOVED_M * PER_M
                return frame + int(far.argmax()) if far.any() else begin + len(x)
        return frame


def _visits_as_driven(tracks: Tracks, layout: Layout, places: dict[str, int]) -> Iterable[TimeSpan]:
    """Yield the visits of vehicles to places, from the distance that each vehicle has driven on its loop."""
    rows_of = tracks.rows_of()
    for vehicle, body in enumerate(layout.vehicles.values()):
        loop = layout.loops[body.loop]
        numbers = np.array([places[leg.state] for leg in loop.legs])
        tracked = rows_of.get(vehicle, ())
        began = tracks.odometer_m[tracked[0][1]][0] if tracked else 0.0
        for begin, rows in tracked:
            arc = tracks.odometer_m[rows] - began + body.start_m
            leg, first, last = _rounds(loop, arc, body.length_m)
            for k, come, gone in zip(leg.tolist(), first.tolist(), last.tolist(), strict=True):
                yield TimeSpan(int(numbers[k]), vehicle, begin + come, begin + gone)


def _rounds(loop: LoopWay, arc: Floats, length_m: float) -> tuple[Ints, Ints, Ints]:
    """Return the legs that a vehicle drove over, and the rows in which its front came and its rear left."""
    lap = loop.length_m
    rounds = np.arange(np.floor(arc[0] / lap) - 1, np.ceil(arc[-1] / lap) + 1)[:, None] * lap
    come = (np.array([leg.begin_m for leg in loop.legs])[None] + rounds).ravel()
    gone = (np.array([leg.end_m for leg in loop.legs])[None] + rounds).ravel() + length_m
    legs = np.tile(np.arange(len(loop.legs)), len(rounds))
    seen = (come <= arc[-1]) & (gone > arc[0])
    return legs[seen], np.searchsorted(arc, come[seen]), np.searchsorted(arc, gone[seen])


Box = tuple[float, float, float, float]
"""Smallest and largest x, smallest and largest y [m]."""

_CARS = frozenset({"passenger", "bus", "delivery"})
_STREET_WIDTH_M = 3.2
_SIMPLER_M = 0.2
"""Simplified shapes may differ from the real ones by this much [m]."""


def open_network(scenario: Mapping[str, Any], folder: Path) -> RoadNetwork | None:
    """Return the network of a run; None if it cannot be read any more.

    A relative path is tried from the working directory, then from the run folder.
    """
    name = str(scenario.get("network", ""))
    for tried in (name, str(folder / name)):
        try:
            return RoadNetwork.open(tried)
        except LoopgateError:
            continue
    return None


def flat(line: npt.ArrayLike, *, closed: bool = False) -> list[int]:
    """Return a line as x, y of its first point, then the steps from point to point, in tenths of a metre."""
    points = np.asarray(line, dtype=np.float64)
    made = shapely.Polygon(points) if closed and len(points) > 3 else shapely.LineString(points)  # noqa: PLR2004  a triangle stays
    simple = shapely.get_coordinates(shapely.simplify(made, _SIMPLER_M))
    whole = np.rint((simple if len(simple) > 1 else points) * PER_M).astype(np.int64)
    return [int(value) for value in np.diff(whole, axis=0, prepend=np.zeros((1, 2), dtype=np.int64)).ravel()]


def draw_streets(network: RoadNetwork | None, layout: Layout | None, box: Box) -> dict[str, Any]:
    """Return the streets in a box: lanes by width [tenths of a metre], and outlines of junctions."""
    lanes: dict[int, list[list[int]]] = {}
    junctions: list[list[int]] = []
    if network is not None:
        edges = [edge for edge in network.edges.values() if any(edge.allows(name) for name in _CARS)]
        for edge in edges:
            for lane in edge.lanes:
                if lane.allowed & _CARS and _inside(lane.shape, box):
                    lanes.setdefault(round(lane.width_m * PER_M), []).append(flat(lane.shape))
        names = {name: None for edge in edges for name in (edge.from_junction, edge.to_junction)}
        shapes = [network.junctions[name].shape for name in names]
        junctions = [
            flat(shape, closed=True)
            for shape in shapes
            if len(shape) > 2 and _inside(shape, box)  # noqa: PLR2004
        ]
    elif layout is not None:
        lanes[round(_STREET_WIDTH_M * PER_M)] = [flat(shape) for shape in layout.shapes.values()]
    return {"lanes": [[width, lines] for width, lines in sorted(lanes.items())], "junctions": junctions}


def _inside(shape: Sequence[tuple[float, float]], box: Box) -> bool:
    xs, ys = [x for x, _ in shape], [y for _, y in shape]
    return max(xs) >= box[0] and min(xs) <= box[1] and max(ys) >= box[2] and min(ys) <= box[3]


@dataclass(frozen=True, slots=True)
class PlaceLink:
    """The way from a place to the next: the names of its crossings, and its line on the map."""

    crossings: tuple[str, ...]
    line: Floats


@dataclass(frozen=True, slots=True)
class DrawnLines:
    """The lines of a layout, as points on the map."""

    loops: dict[str, Floats]
    """The points of each loop, by name [m]."""
    places: dict[str, Floats]
    """The points of each place, by name [m]."""
    links: tuple[PlaceLink, ...]
    """The ways between places."""
    after: dict[str, tuple[int, ...]]
    """For each loop, the numbers of the links after its legs."""
    foes: tuple[tuple[int, ...], ...]
    """For each link, the numbers of the links that exclude it."""


def find_lines(layout: Layout) -> DrawnLines:
    """Return loops, places and links of a run.

    A line follows the lanes on which vehicles leave their spans. O(legs times conflicts).
    """
    loops: dict[str, Floats] = {}
    places: dict[str, Floats] = {}
    links: dict[tuple[str, str, tuple[str, ...]], int] = {}
    drawn: list[PlaceLink] = []
    after: dict[str, tuple[int, ...]] = {}
    passing: dict[str, list[int]] = {}
    excluded: list[set[str]] = []
    for name, loop in layout.loops.items():
        points, arcs = loop_curve(layout, loop)
        loops[name] = points
        numbers = []
        for k, leg in enumerate(loop.legs):
            behind = loop.legs[(k + 1) % len(loop.legs)]
            places.setdefault(leg.state, cut_curve(points, arcs, loop.length_m, leg.begin_m, leg.end_m))
            crossings = tuple(crossing for crossing, _ in leg.crossings)
            key = (leg.state, behind.state, crossings)
            if key not in links:
                links[key] = len(drawn)
                to_m = leg.end_m + gap(loop.length_m, leg.end_m, behind.begin_m)
                line = cut_curve(points, arcs, loop.length_m, leg.end_m, to_m)
                drawn.append(PlaceLink(crossings, line))
                excluded.append({foe for _, foes in leg.crossings for foe in foes})
                for crossing in crossings:
                    passing.setdefault(crossing, []).append(links[key])
            numbers.append(links[key])
        after[name] = tuple(numbers)
    foes = tuple(
        tuple(sorted({number for foe in foes for number in passing.get(foe, ())})) for foes in excluded
    )
    return DrawnLines(loops, places, tuple(drawn), after, foes)


def loop_curve(layout: Layout, loop: LoopWay) -> tuple[Floats, Floats]:
    """Return a loop's points, shape (n, 2), and the arc length of each point [m]."""
    points, arcs = [], []
    for span in loop.spans:
        shape = np.asarray(layout.shapes[span.lanes[0]], dtype=np.float64)
        points.append(shape)
        arcs.append(arc_lengths(shape, span.begin_m, span.end_m))
    return np.concatenate(points), np.concatenate(arcs)


_SHOWN = (
    *(Event.START, Event.GRANT, Event.REFUSE, Event.HOLD, Event.GO, Event.ENTER, Event.LEAVE, Event.LAP),
    *(Event.DEADLOCK, Event.COLLISION, Event.TELEPORT, Event.OVERRUN, Event.STRAY),
)
_LENGTH_M, _WIDTH_M = 5.0, 1.8
"""Length and width of a car in SUMO [m], for vehicles whose size is not known."""
_MARGIN_M = 150.0


@dataclass(frozen=True, slots=True)
class Scene:
    """A run, ready to be shown."""

    summary: Mapping[str, Any]
    """The contents of ``summary.json``."""
    tracks: Tracks
    layout: Layout | None
    ways: DrawnLines
    happenings: Happenings
    streets: dict[str, Any]
    """`tracks`: positions of the vehicles. `layout`: states, crossings and vehicles, if known. `ways`: lines
    of loops, places and links. `happenings`: the events. `streets`: the streets in the background."""
    names: Mapping[str, str]
    """Names of streets by edge, if the network has names."""

    @property
    def network(self) -> str:
        """The network's name."""
        return Path(str(self.summary["network"])).name.removesuffix(".gz").removesuffix(".net.xml")

    @property
    def name(self) -> str:
        """The rules by which vehicles drove: SUMO's own, or a gate's."""
        gate = str(self.summary["gate"])
        return "SUMO's own rules" if gate == "open" else f"loopgate, {gate}"

    def describe(self, pack: Pack) -> dict[str, Any]:
        """Put the run's columns into `pack`, and return their description for the page."""
        tracks, layout, what = self.tracks, self.layout, self.happenings
        bodies = list(layout.vehicles.values()) if layout else []
        sizes = [[body.length_m, body.width_m] for body in bodies]
        sizes += [[_LENGTH_M, _WIDTH_M]] * (len(tracks.vehicles) - len(bodies))
        loops = {name: number for number, name in enumerate(self.ways.loops)}
        rooms = layout.room if layout else {}
        summary = self.summary
        return {
            "name": self.name,
            "network": self.network,
            "gated": summary["gate"] != "open",
            "outcome": summary["outcome"],
            "figures": {name: summary.get(name) for name in ("seed", "laps", "distance_km", "collisions")},
            "first_s": tracks.first_s,
            "step_s": tracks.step_s,
            "frames": tracks.frames,
            "vehicles": list(tracks.vehicles),
            "sizes": sizes,
            "loop_of": [loops[body.loop] for body in bodies],
            "loops": [[name, flat(line, closed=True)] for name, line in self.ways.loops.items()],
            "places": [
                [self._shown(name), rooms.get(name, 0), flat(line)] for name, line in self.ways.places.items()
            ],
            "links": [flat(link.line) for link in self.ways.links],
            "foes": self.ways.foes,
            "why": list(WHY.values()),
            "blocked": list(self._blocked()),
            "standing": [list(WHY).index(reason) for reason in (Reason.CLOSED, Reason.BLOCKED)],
            "crossing": list(WHY).index("crossing"),
            "occupied": list(WHY).index("occupied"),
            "after": [[self._place(name), list(links)] for name, links in self.ways.after.items()],
            "tracks": [pack.column(column) for column in (tracks.owner, tracks.begin, tracks.count)],
            "x": pack.column(tracks.x, differences=2),
            "y": pack.column(tracks.y, differences=2),
            "heading": pack.column(tracks.heading),
            "visits": _columns(pack, what.visits),
            "passages": _columns(pack, what.passages),
            "refusals": _columns(pack, what.refusals),
            "holds": _columns(pack, what.holds),
            "laps": [pack.column([row[k] for row in what.laps]) for k in (0, 1)],
            "mishaps": what.mishaps,
            "circles": [[list(circle.vehicles), circle.begin, circle.end] for circle in what.circles],
        }

    def _blocked(self) -> Iterator[list[Any]]:
        """Yield the places that were closed or blocked: place, first and last step, cause, vehicle, end [s].

        The vehicle is -1 for a closure, and the end None if it was not known before.
        """
        places = {name: number for number, name in enumerate(self.ways.places)}
        vehicles = {name: number for number, name in enumerate(self.tracks.vehicles)}
        for one in (self.summary.get("standing") or {}).get("blocked", ()):
            if one["place"] in places:
                end = self.tracks.frames if one["to_s"] is None else self.tracks.frame(one["to_s"])
                begin, who = self.tracks.frame(one["from_s"]), vehicles.get(one["vehicle"], -1)
                yield [places[one["place"]], begin, end, one["why"], who, one.get("until_s")]

    def _shown(self, place: str) -> str:
        """Return a place as the page names it: with the name of its street, if the street has a name."""
        street = self.names.get(edge_of(place), "")
        return f"{street} ({place})" if street else place

    def _place(self, loop: str) -> list[int]:
        numbers = {name: number for number, name in enumerate(self.ways.places)}
        legs = self.layout.loops[loop].legs if self.layout else ()
        return [numbers[leg.state] for leg in legs]


def load_scene(folder: Path, report: Callable[[int], None] = lambda _percent: None) -> Scene:
    """Read a run from its folder.

    Raises `ResultsError` if it is no run folder, a file cannot be read, or it has neither loops nor
    positions.

    Parameters
    ----------
    folder
        Of a run on loops, or of any with positions.
    report
        Told how much is done, in percent.
    """
    summary = read_summary(folder)
    with refusing(folder, "run folder", ResultsError):
        needed = {name: summary[name] for name in ("network", "gate", "outcome", "vehicles", "duration_s")}
    positions, fronts = folder / run_folder.POSITIONS, folder / run_folder.FRONTS
    file = folder / run_folder.LAYOUT
    layout = read_layout(file) if file.is_file() else None
    if not positions.is_file() and (layout is None) != (not fronts.is_file()):
        lacks, has = (file, fronts) if layout is None else (fronts, file)
        msg = f"{lacks}: it is missing, though {has.name} is there; copy the whole folder of the run"
        raise ResultsError(msg)
    if not positions.is_file() and (layout is None or not fronts.is_file()):
        msg = f"{folder}: no positions were recorded; run it again with them: {_again(summary, folder)}"
        raise ResultsError(msg)
    scenario = read_toml(folder / run_folder.SCENARIO, "scenario", ResultsError)
    with refusing(folder, "run folder", ResultsError):
        step_s = float(scenario["step_s"])
        rows = (
            max(1.0, (float(needed["duration_s"]) + float(scenario["warmup_s"])) / step_s)
            * needed["vehicles"]
        )
    report(2)
    if layout is not None and not positions.is_file():
        tracks = read_fronts(fronts, step_s, layout)
    else:
        tracks = read_tracks(
            positions,
            step_s,
            known=tuple(layout.vehicles) if layout else (),
            report=lambda done: report(2 + min(68, int(68 * done / rows))),
        )
    ways = find_lines(layout) if layout else DrawnLines({}, {}, (), {}, ())
    report(72)
    events = read_events(folder / run_folder.EVENTS, _SHOWN)
    with refusing(folder / run_folder.EVENTS, "table of events", ResultsError):
        happenings = find_happenings(events, tracks, layout, ways)
    report(85)
    network = open_network(scenario, folder)
    streets = draw_streets(network, layout, _box(tracks))
    names = {edge.id: edge.street for edge in network.edges.values()} if network is not None else {}
    return Scene(summary, tracks, layout, ways, happenings, streets, names)


def _again(summary: Mapping[str, Any], folder: Path) -> str:
    words = ["loopgate", "run", str(summary["network"]), "-o", str(folder)]
    command = str(summary.get("command") or shlex.join(words))
    return f"{command} --positions --overwrite"


def _box(tracks: Tracks) -> Box:
    x, y = tracks.x / PER_M, tracks.y / PER_M
    return (
        float(np.min(x)) - _MARGIN_M,
        float(np.max(x)) + _MARGIN_M,
        float(np.min(y)) - _MARGIN_M,
        float(np.max(y)) + _MARGIN_M,
    )


def _columns(pack: Pack, spans: Sequence[TimeSpan]) -> list[list[int]]:
    """Return kind, vehicle, first step, number of steps and reason as columns."""
    table = np.array(spans, dtype=np.int64).reshape(-1, len(TimeSpan._fields))
    table[:, 3] -= table[:, 2]
    return [pack.column(column) for column in table.T]
