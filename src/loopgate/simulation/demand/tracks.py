"""Makes the tracks of the vehicles from their loops and itineraries."""

from loopgate.abstraction.itinerary import Itinerary, Leg
from loopgate.drive.track import StopLine, Track
from loopgate.network import Loop, RoadNetwork
from loopgate.simulation.sumo.input import Start, rounds


def make_track(
    network: RoadNetwork,
    start: Start,
    itinerary: Itinerary | None = None,
    position: int = 0,
    *,
    keeps_lane: bool = False,
) -> Track:
    """Return the track of a vehicle.

    Parameters
    ----------
    start
        The vehicle, its loop and where it stands.
    itinerary
        Its states; None for a vehicle under no gate.
    position
        The position on the itinerary in which it starts.
    keeps_lane
        Whether it changes lanes only where a guide says so.
    """
    loop = start.loop
    legs = itinerary.legs if itinerary else ()
    return Track(
        vehicle=start.vehicle,
        loop=loop.id,
        lap_m=loop.lap_m,
        start_m=start.front_m,
        top_speed_mps=max(network.lanes[span.lane_id].speed_mps for span in loop.spans),
        rounds=rounds(loop) if loop.closed else (),
        edges=tuple((span.begin_m, span.edge) for span in loop.roads),
        legs=legs,
        stop_lines=tuple(_stop_line(loop, leg) for leg in legs),
        start_position=position,
        keeps_lane=keeps_lane,
    )


def _stop_line(loop: Loop, leg: Leg) -> StopLine:
    place = loop.locate(leg.end_m)
    return StopLine(place.edge, place.lane if leg.lane is None else leg.lane, place.position_m)
