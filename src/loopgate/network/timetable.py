"""A timetable for loops: stops on their streets, and a vehicle every so many minutes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil
from xml.sax.saxutils import quoteattr

from loopgate.errors import RouteError
from loopgate.network.loop import LaneSpan, Loop
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

DWELL_S = 20.0
"""Time that a vehicle stands at a stop [s]."""

_STOP_M = 20.0
_LEAST_LANE_M = 30.0


@dataclass(frozen=True, slots=True)
class Timetable:
    """What a timetable asks for.

    Attributes
    ----------
    stops
        Names of streets or edges at which vehicles stop, where their loop passes them.
    every_s
        Time between two vehicles of a loop [s].
    first_s
        Departure of the first vehicle [s].
    margin
        Driving time over that at the speed limits.
    """

    stops: tuple[str, ...]
    every_s: float
    first_s: float = 0.0
    margin: float = 1.5


def timetable_texts(
    network: RoadNetwork, loops: Sequence[Loop], kind: VehicleType, wish: Timetable, *, note: str = ""
) -> tuple[str, str]:
    """Return the text of a route file with stops and departures, and that of the file with the bus stops.

    Of a street the longest edge on the loop gets the stop, near its middle. A loop gets the least number of
    vehicles that can keep the time between them, and its timetable repeats after a round of all of them.

    Raises `RouteError` if no loop passes a stop, or only on edges shorter than 30 m.
    """
    places = {name: {name, *network.on_street(name)} for name in wish.stops}
    for name, edges in places.items():
        on = [span for loop in loops for span in loop.roads if span.edge in edges]
        if not on:
            msg = f"no loop passes the stop {name} in {network.name}; name it in --via too"
            raise RouteError(msg)
        if max(span.length_m for span in on) < _LEAST_LANE_M:
            msg = f"the stop {name}: all its edges on loops are shorter than {_LEAST_LANE_M:g} m"
            raise RouteError(msg)
    lines, stands = [], dict[str, str]()
    if kind != DEFAULT_TYPE:
        attributes = " ".join(f"{name}={quoteattr(value)}" for name, value in kind.attributes.items())
        lines.append(f"    <vType {attributes}/>")
    for loop in loops:
        lines += _line(network, loop, kind, wish, _stands(loop, places, stands))
    head = ['<?xml version="1.0" encoding="UTF-8"?>', f"<!-- {note.replace('--', '- -')} -->"]
    return (
        "\n".join([*head, "<routes>", *lines, "</routes>\n"]),
        "\n".join([*head, "<additional>", *stands.values(), "</additional>\n"]),
    )


def _stands(loop: Loop, places: dict[str, set[str]], stands: dict[str, str]) -> list[tuple[float, str]]:
    """Return the stops of a loop, as arc length of their ends [m] and name, and note their bus stops."""
    found = []
    for name, edges in places.items():
        on = [span for span in loop.roads if span.edge in edges]
        if not on or (span := max(on, key=lambda one: (one.length_m, one.edge))).length_m < _LEAST_LANE_M:
            continue
        end_m = min(span.length_m / 2.0 + _STOP_M / 2.0, span.length_m - 5.0)
        ids = _names(name.replace(" ", "_"))
        stop = next(
            one for one in ids if stands.get(one, _stand(one, span, end_m)) == _stand(one, span, end_m)
        )
        stands[stop] = _stand(stop, span, end_m)
        found.append((span.begin_m + end_m, stop))
    return sorted(found)


def without_stops(network: RoadNetwork, loops: Sequence[Loop], wish: Timetable) -> tuple[str, ...]:
    """Return the names of the loops that pass none of the stops, if stops are wished for."""
    edges = {edge for name in wish.stops for edge in (name, *network.on_street(name))}
    return tuple(loop.id for loop in loops if edges.isdisjoint(loop.edges)) if edges else ()


def _names(name: str) -> Iterable[str]:
    """Yield the name of a stop, then others like it, for loops that pass the street elsewhere."""
    yield name
    number = 2
    while True:
        yield f"{name}_{number}"
        number += 1


def _stand(name: str, span: LaneSpan, end_m: float) -> str:
    where = f'startPos="{end_m - _STOP_M:.1f}" endPos="{end_m:.1f}"'
    return f"    <busStop id={quoteattr(name)} lane={quoteattr(span.lane_id)} {where}/>"


def _line(
    network: RoadNetwork, loop: Loop, kind: VehicleType, wish: Timetable, stops: Sequence[tuple[float, str]]
) -> list[str]:
    """Return the route with its timetable, and the flow of its vehicles."""

    def driven_s(end_m: float) -> float:
        times = (
            (min(span.end_m, end_m) - span.begin_m) / network.lanes[span.lane_id].speed_mps
            for span in loop.spans
            if span.begin_m < end_m
        )
        return wish.margin * sum(times)

    number = max(1, ceil((driven_s(loop.length_m) + DWELL_S * len(stops)) / wish.every_s))
    head = f"    <route id={quoteattr(loop.id)} edges={quoteattr(' '.join(loop.edges))}"
    if stops:
        head += f' cycleTime="{number * wish.every_s:g}"'
    lines = [f"{head}>"]
    for before, (end_m, name) in enumerate(stops, start=1):
        until_s = round(driven_s(end_m) + DWELL_S * before)
        lines.append(f'        <stop busStop={quoteattr(name)} duration="{DWELL_S:g}" until="{until_s}"/>')
    flow = f"    <flow id={quoteattr(loop.id)} type={quoteattr(kind.id)} route={quoteattr(loop.id)} "
    flow += f'begin="{wish.first_s:g}" period="{wish.every_s:g}" number="{number}"/>'
    return [*lines, "    </route>", flow]
