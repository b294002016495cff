"""Reads a run from its folder, as the replay shows it."""

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from loopgate.audit.layout import Layout, read_layout
from loopgate.errors import ResultsError
from loopgate.reading import read_object, read_toml, refusing
from loopgate.replay.fronts import read_fronts
from loopgate.replay.happenings import WHY, Happenings, TimeSpan, find_happenings
from loopgate.replay.lines import DrawnLines, find_lines
from loopgate.replay.pack import Pack
from loopgate.replay.streets import Box, draw_streets, flat, open_network
from loopgate.replay.tracks import PER_M, Tracks, read_tracks
from loopgate.results.columns import Event
from loopgate.results.recorder import read_events
from loopgate.simulation import run_folder

_SHOWN = (
    *(Event.START, Event.GRANT, Event.REFUSE, Event.HOLD, Event.GO, Event.ENTER, Event.LEAVE, Event.LAP),
    *(Event.DEADLOCK, Event.COLLISION, Event.TELEPORT, Event.OVERRUN, Event.STRAY),
)
_LENGTH_M, _WIDTH_M = 5.0, 1.8
"""Length and width of a car in SUMO [m], for vehicles whose size is not known."""
_MARGIN_M = 150.0
_EDGE_OF_PLACE = re.compile(r"(.+)_\d+(?:\D.*)?$")
"""A place is named after its lane, ``EDGE_NUMBER``, with a suffix where a lane has several places."""


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

    def _shown(self, place: str) -> str:
        """Return a place as the page names it: with the name of its street, if the street has a name."""
        edge = _EDGE_OF_PLACE.match(place)
        street = self.names.get(edge[1], "") if edge else ""
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
    summary = read_object(folder / run_folder.SUMMARY, "summary of a run", ResultsError)
    with refusing(folder, "run folder", ResultsError):
        needed = {name: summary[name] for name in ("network", "gate", "outcome", "vehicles", "duration_s")}
    positions, fronts = folder / run_folder.POSITIONS, folder / run_folder.FRONTS
    file = folder / run_folder.LAYOUT
    layout = read_layout(file) if file.is_file() else None
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
