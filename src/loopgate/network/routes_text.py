"""Loops as an ordinary SUMO route file."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from loopgate.errors import RouteError
from loopgate.network.loop import Loop
from loopgate.network.vehicle_demand import VehicleDemand
from loopgate.network.vehicle_type import DEFAULT_TYPE


def write_loops(loops: Iterable[Loop], file: Path | str, *, note: str = "") -> None:
    """Write loops as a SUMO route file, which SUMO, netedit and `read_loops` can read.

    `note` becomes a comment at the top of the file. Raises `RouteError` if the file cannot be written.

    Examples
    --------
    >>> from loopgate import RoadNetwork, find_loops, read_loops
    >>> from loopgate.network import write_loops
    >>> network = RoadNetwork.open("networks/grid5-priority.net.xml")
    >>> loops = find_loops(network, 3, seed=2).loops
    >>> write_loops(loops, "mine.rou.xml", note="three random loops")
    >>> read_loops(network, "mine.rou.xml").loops == loops
    True
    """
    write_text(routes_text(loops, note=note), file)


def routes_text(loops: Iterable[Loop], *, note: str = "", vehicles: Sequence[VehicleDemand] = ()) -> str:
    """Return the text of `write_loops`: the vehicles' types, the loops, the vehicles."""
    by_id = {loop.id: loop for loop in loops}
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    if note:
        lines.append(f"<!-- {note.replace('--', '- -')} -->")  # XML allows no double hyphen in a comment
    lines.append("<routes>")
    for kind in dict.fromkeys(vehicle.type for vehicle in vehicles if vehicle.type != DEFAULT_TYPE):
        attributes = " ".join(f"{name}={quoteattr(value)}" for name, value in kind.attributes.items())
        lines.append(f"    <vType {attributes}/>")
    lines += [
        f"    <route id={quoteattr(loop.id)} edges={quoteattr(' '.join(loop.edges))}/>"
        for loop in by_id.values()
    ]
    lines += [_vehicle_line(vehicle) for vehicle in vehicles]
    lines.append("</routes>\n")
    return "\n".join(lines)


def _vehicle_line(vehicle: VehicleDemand) -> str:
    begin = f"    <vehicle id={quoteattr(vehicle.id)} type={quoteattr(vehicle.type.id)} "
    begin += f'route={quoteattr(vehicle.loop.id)} depart="0"'
    if vehicle.depart_m is None:
        return f"{begin}/>"
    roads = vehicle.loop.roads
    number = max(k for k, span in enumerate(roads) if k == 0 or span.begin_m <= vehicle.depart_m)
    position = min(vehicle.depart_m - roads[number].begin_m, roads[number].length_m)
    return f'{begin} departEdge="{number}" departPos="{position:.2f}"/>'


def write_text(text: str, file: Path | str) -> None:
    """Write a route file, making its folder; raise `RouteError` if it cannot be written."""
    path = Path(file)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        msg = f"{file}: cannot write the routes ({error.strerror or error})"
        raise RouteError(msg) from error
