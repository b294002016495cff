"""Tables of what is around the gated vehicles: lights that they obey, and traffic under no gate.

Of ordinary traffic those of the roads are made once for a network, those of the ways, with what can be met on
them, once for the loops that are driven; the rest is seen anew in each step.
"""

from __future__ import annotations

from typing import Final

__all__ = [
    "AROUND",
    "AcrossRow",
    "ApproachRow",
    "ArrivalRow",
    "CrossedRow",
    "EdgeRow",
    "JunctionRow",
    "LaneRow",
    "LightRow",
    "LinkRow",
    "OtherRow",
    "PhaseRow",
    "PlaceRow",
    "RearRow",
    "SignalRow",
    "WayRow",
]


class SignalRow:
    """What a light shows to a movement: the light, the number of its link, lowest limit behind it [m/s]."""

    light: int
    link: int
    speed_mps: float


class LightRow:
    """A light, as it was read.

    Attributes
    ----------
    phase, phases, fixed
        Its phase, how many its program has (0 where it follows none), and whether they last as planned.
    letters
        Where the letters are that it shows.
    changes_s, seen_s, spent_s
        When it may change next, when it was read, and for how long it had shown this then [s].
    unread
        Whether it has to be read now.
    """

    phase: int
    phases: int
    fixed: bool
    letters: int
    changes_s: float
    seen_s: float
    spent_s: float
    unread: bool


class PhaseRow:
    """A phase of a program: where its letters are, how long it lasts at most [s], and the phase after it."""

    letters: int
    longest_s: float
    following: int


class EdgeRow:
    """An edge: length of its longest lane [m], limit on its fastest [m/s], and when it was last marked.

    The last row is of all that are no roads, as connectors: nobody looks beyond these.
    """

    length_m: float
    limit_mps: float
    marked: int


class LaneRow:
    """A lane.

    Attributes
    ----------
    length_m, speed_mps, edge, inside
        Length [m] and limit [m/s]; the edge it is of, and whether it lies inside a junction.
    ahead_at, ahead_end, behind_at, behind_end
        Where in the table of links is to which edges it leads, over which lane, and from which it comes.
    place
        The first place on it, or `NOBODY`.
    first, last, over
        The first and last ordinary vehicle in the list of those whose fronts are on it, and the first rear of
        those whose fronts have left it; or `NOBODY`.
    """

    length_m: float
    speed_mps: float
    edge: int
    inside: bool
    ahead_at: int
    ahead_end: int
    behind_at: int
    behind_end: int
    place: int
    first: int
    last: int
    over: int


class LinkRow:
    """To or from an edge, any if it is `NOBODY`: the lane before or behind."""

    edge: int
    lane: int


class JunctionRow:
    """From an edge to another over a junction: how long that is [m], and the list of who comes there."""

    through_m: float
    first: int
    last: int


class OtherRow:
    """An ordinary vehicle. The rows of those that are gone are free.

    Attributes
    ----------
    lane, position_m, speed, parks
        The lane of its front, and how far that is on it [m]; its speed [m/s]; whether it stands beside it.
    length_m, accel, decel
        Length [m], acceleration and deceleration [m/s2].
    listed, following
        The lane in whose list it is, and the next one there, or `NOBODY`.
    route_at, route_end, at, on, until_s
        Where its route is in the table of routes; where in that is the edge that it is on or has just left;
        on which lane it was then; until when its route is taken to be as it was [s].
    since_s, seen_s
        Since when it stands at its line though it may drive, and when it was seen so last [s].
    marked
        When it was last marked.
    read, seen
        The n-th entry of two lists of vehicles: in the order in which they are read, and lane by lane.
    found
        The n-th entry of the list of those that a question was about.
    """

    lane: int
    position_m: float
    speed: float
    length_m: float
    accel: float
    decel: float
    parks: bool
    listed: int
    following: int
    route_at: int
    route_end: int
    at: int
    on: int
    until_s: float
    since_s: float
    seen_s: float
    marked: int
    read: int
    seen: int
    found: int


class RearRow:
    """A vehicle whose front has left a lane, where on that its rear is [m], and the next one there."""

    other: int
    lane: int
    rear_m: float
    following: int


class ArrivalRow:
    """When a vehicle gets to a junction, from now on [s]: gaining speed as it can, or as fast as now.

    One that `stands` at its line, or near it, may set out, or never. One that is `near` cannot stop before
    the junction any more. Then the next one who comes there.
    """

    other: int
    junction: int
    first_s: float
    last_s: float
    stands: bool
    near: bool
    following: int


class WayRow:
    """A leg of a loop: where its place is, and what lies behind its end.

    Attributes
    ----------
    place, away
        The place by number; whether it is where vehicles go that arrive.
    lane, begin_m, end_m
        The stretch of a lane [m]; a vehicle is held at the end.
    into_at, into_end
        Where in the list of lanes are those inside the junction from which others drive into it.
    between_at, between_end
        And those between the junctions of the crossing behind it, on which nobody may be either when a
        vehicle sets out.
    crossed_at, crossed_end
        The movements of that crossing, in order.
    """

    place: int
    away: bool
    lane: int
    begin_m: float
    end_m: float
    into_at: int
    into_end: int
    between_at: int
    between_end: int
    crossed_at: int
    crossed_end: int


class CrossedRow:
    """A movement of a crossing behind a leg; see `loopgate.simulation.around.crossing_ways.Movement`."""

    from_m: float
    length_m: float
    speed_mps: float
    wait_m: float
    waits_in_way: bool
    across_at: int
    across_end: int
    approach_at: int
    approach_end: int


class AcrossRow:
    """A lane across a movement, from where on a rear there is past it [m], whether SUMO does not see that."""

    lane: int
    past_m: float
    unseen: bool


class ApproachRow:
    """A way across a movement, by its junction, and whether its light, if there is one, is open."""

    junction: int
    is_open: bool


class PlaceRow:
    """A place: the first leg that it is on, its state by number, or `NOBODY`, and when it was last marked."""

    way: int
    state: int
    marked: int


AROUND: Final[dict[str, type]] = {
    "signals": SignalRow,
    "lights": LightRow,
    "phases": PhaseRow,
    "edges": EdgeRow,
    "lanes": LaneRow,
    "links": LinkRow,
    "junctions": JunctionRow,
    "others": OtherRow,
    "rears": RearRow,
    "arrivals": ArrivalRow,
    "ways": WayRow,
    "crossed": CrossedRow,
    "across": AcrossRow,
    "approaches": ApproachRow,
    "places": PlaceRow,
}
"""The rows of these tables, by their names in `Tables`."""
