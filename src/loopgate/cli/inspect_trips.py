"""`loopgate inspect` of trips: which are gated, on which routes, and which are not."""

from typing import Any

from loopgate.cli.inspect_shared import print_warnings
from loopgate.cli.tables import console, print_table
from loopgate.cli.terminal import print_json
from loopgate.reading import counted
from loopgate.simulation.assembly import Assembly, assemble
from loopgate.simulation.scenario import Scenario

_MOST_ROWS = 40


def look_at_trips(scenario: Scenario, *, as_json: bool) -> None:
    """Show which vehicles of a scenario `loopgate run` puts under the gate.

    Raises `LoopgateError` if they cannot be run.
    """
    assembly = assemble(scenario)
    data = _data(assembly)
    if as_json:
        print_json(data)
        return
    to = console()
    roads = assembly.network.name
    title = f"{roads}: {counted(len(data['vehicles']), 'vehicle')} under the gate, {_once(data['once'])}"
    columns = ("vehicle", "departs [s]", "from", "to", "length [m]", "places")
    rows = [
        [v["id"], f"{v['depart_s']:g}", v["from"], v["to"], f"{v['length_m']:.0f}", v["places"]]
        for v in data["vehicles"]
    ]
    left = ("vehicle", "from", "to")
    print_table(to, title, columns, rows, left=left, most=_MOST_ROWS)
    places, ways = counted(data["places"], "place"), counted(data["ways"], "way")
    to.print(f"{places} with {counted(data['slots'], 'slot')} on {ways}", markup=False)
    print_warnings(to, data["warnings"])


def _once(number: int) -> str:
    return f"{number} {'drives' if number == 1 else 'drive'} once"


def _data(assembly: Assembly) -> dict[str, Any]:
    abstraction = assembly.abstraction
    ways = (*abstraction.itineraries, *abstraction.later) if abstraction else ()
    legs = {way.loop.id: len(way.legs) for way in ways}
    room = abstraction.room if abstraction else {}
    away = {leg.state for way in ways for leg in way.legs[-1:] if leg.away}
    slots = [most for state, most in room.items() if state not in away]
    return {
        "vehicles": [
            {
                "id": start.vehicle,
                "depart_s": start.depart_s or 0.0,
                "from": start.loop.edges[0],
                "to": start.loop.edges[-1],
                "length_m": round(start.loop.length_m, 2),
                "places": legs[start.loop.id] - (not start.loop.closed),
            }
            for start in assembly.everybody
        ],
        "once": len(assembly.trips),
        "ways": len(legs),
        "places": len(slots),
        "slots": sum(slots),
        "ordinary": list(assembly.others),
        "warnings": list(assembly.warnings),
    }
