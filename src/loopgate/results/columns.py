"""The column names of all result tables, with units."""

from enum import StrEnum
from typing import Final

# summary.json
BEGINS: Final = "begins_s"  # when the simulation begins [s]; times of events are SUMO's, from there on

# events.parquet: one row per event
TIME: Final = "time_s"  # simulated time [s]
VEHICLE: Final = "vehicle"  # its name
EVENT: Final = "event"  # one of Event
PLACE: Final = "place"  # state the event is about (segment, place), or edge where there are no states
REASON: Final = "reason"  # why, where there is a reason
STAGE: Final = "stage"  # which stage of a staged gate decided a grant or a refusal
EVENT_COLUMNS: Final = (TIME, VEHICLE, EVENT, PLACE, REASON, STAGE)


class Event(StrEnum):
    """Kinds of events."""

    START = "start"
    """The vehicle stands in `place`, at the begin of the run or when it joins."""
    GRANT = "grant"
    """The vehicle may enter `place`, and occupies a slot of it from now on."""
    REFUSE = "refuse"
    """The vehicle may not enter `place`; recorded at the first refusal and when the reason changes."""
    HOLD = "hold"
    """The vehicle came to rest at the end of its state, before `place`."""
    GO = "go"
    """The vehicle that was held moves again, towards `place`."""
    ENTER = "enter"
    """The vehicle's front is in `place`."""
    LEAVE = "leave"
    """The vehicle's rear has left `place`; its slot is free."""
    LAP = "lap"
    """The vehicle has completed a lap; `place` is where its lap began."""
    EDGE = "edge"
    """The vehicle entered the road edge `place`."""
    DEADLOCK = "deadlock"
    """The vehicle is part of a circular wait and waits for `place`; `reason` names the vehicle that it waits
    for."""
    COLLISION = "collision"
    """SUMO reports a collision of the vehicle on lane `place` with the vehicle in `reason`."""
    TELEPORT = "teleport"
    """SUMO teleported the vehicle."""
    OVERRUN = "overrun"
    """The vehicle, held before `place`, can no longer brake for its stop line; it brakes as hard as it
    can."""
    END = "end"
    """The vehicle is no longer under the gate, for the given `reason`; it has left all places, the last being
    `place`."""
    STOP = "stop"
    """The vehicle has come to rest at its stop `place`."""
    SERVED = "served"
    """The vehicle has completed its stop `place`, and may go on."""
    PARK = "park"
    """The vehicle parks beside the road, and has given up its slot of `place`."""
    RETURN = "return"
    """The vehicle that parked is on the road again in `place`, behind the vehicle in `reason`, if any."""
    MISSED = "missed"
    """The vehicle could not stop at its stop `place`; it comes to the stop again a round later."""
    REROUTE = "reroute"
    """The vehicle turns at `place` to another way, named in `reason`."""
    BLOCK = "block"
    """The vehicle stands in `place`, or `place` is closed: no vehicle is let in; `reason` says which."""
    FREE = "free"
    """The vehicle no longer stands in `place`, or `place` is open again: vehicles are let in."""
    STARVE = "starve"
    """The vehicle has long been granted nothing, before `place`; `reason`: which vehicle stands, or why."""
    STRAY = "stray"
    """The vehicle is on lane `place`, which is not on its loop; it is led back."""


TAKEN_OUT: Final = "taken out"  # REASON of an `Event.END` before the end of its route, as by a calibrator

# vehicles.parquet: one row per vehicle (VEHICLE, and)
LOOP: Final = "loop"  # name of its loop
LOOP_LENGTH: Final = "loop_length_m"  # length of one lap [m]
LAPS: Final = "laps"  # completed laps
DISTANCE: Final = "distance_m"  # distance driven [m]
MEAN_SPEED: Final = "mean_speed_mps"  # distance over the time on the road, from departure to arrival [m/s]
HOLD: Final = "hold_s"  # total time standing at gates
STOOD: Final = (
    "stood_s"  # time slower than 0.1 m/s, under any gate; of an edge also in the junction behind it
)
LONGEST_STOOD: Final = "longest_stood_s"  # longest time without moving, for whatever cause
STOPS: Final = "stops"  # stops made
STOPPED: Final = "stopped_s"  # time at these
DEPART_DELAY: Final = "depart_delay_s"  # time from when it wanted to depart until it did
TIME_LOSS: Final = "time_loss_s"  # what it lost against driving at its ideal speed; of those who drive once
WAITING: Final = "waiting_s"  # how long it stood on its way, at gates too, not at its own stops; of the same
TRIP_TIME: Final = "trip_s"  # how long it was under way, so far if it has not arrived; of the same
ARRIVAL: Final = "arrival_s"  # when it was at the end of its route; NaN if it is not; of the same
ARRIVED: Final = "arrived"  # whether it is at the end of its route; of the same
LONGEST_WAIT: Final = "longest_wait_s"  # longest time from asking to being granted
STANDING: Final = "standing_s"  # time since it last moved, at the end of the run
X: Final = "x_m"  # where its front is at the end of the run, network coordinates; NaN if it has arrived
Y: Final = "y_m"  # the same
VEHICLE_COLUMNS: Final = (
    VEHICLE,
    LOOP,
    LOOP_LENGTH,
    LAPS,
    DISTANCE,
    MEAN_SPEED,
    HOLD,
    LONGEST_WAIT,
    STANDING,
    X,
    Y,
)

# edges.parquet: one row per edge on some loop
EDGE: Final = "edge"  # name of the road edge
EDGE_LENGTH: Final = "length_m"  # its length [m]
VISITS: Final = "visits"  # how often a vehicle entered it
MEAN_REVISIT: Final = "mean_revisit_s"  # mean time between two visits
MAX_REVISIT: Final = "max_revisit_s"  # longest time between two visits
WEIGHTED_REVISIT: Final = "weighted_revisit_s"  # mean time between two visits, weighted by its length
IDLENESS: Final = "idleness_s"  # time-weighted mean time since the last visit
WORST_IDLENESS: Final = "worst_idleness_s"  # longest time since the last visit
EDGE_HOLD: Final = "hold_s"  # vehicles' hold time on the edge
JUNCTION: Final = "junction"  # where the edge ends
SHAPE: Final = "shape"  # "x,y x,y ..." [m], network coordinates
HEADWAY_CV: Final = "headway_cv"  # standard deviation over mean of the times between two visits
BUNCHED: Final = "bunched"  # share of these below a quarter of their mean, 0 to 1
WITHIN: Final = "within"  # share of the time in which the idleness is at most the bound, 0 to 1
_SEEN = (VISITS, MEAN_REVISIT, MAX_REVISIT, WEIGHTED_REVISIT, IDLENESS, WORST_IDLENESS)
EDGE_COLUMNS: Final = (EDGE, EDGE_LENGTH, *_SEEN, EDGE_HOLD, SHAPE)
BOUND: Final = "bound_s"  # time for which the street should not go unseen; infinity for none
STREET: Final = "street"  # name of the street, empty where the network has none
WATCH_COLUMNS: Final = (EDGE, *_SEEN, HEADWAY_CV, BUNCHED, BOUND, WITHIN)
STREET_COLUMNS: Final = (EDGE, STREET, EDGE_LENGTH, *WATCH_COLUMNS[1:], SHAPE)
"""``streets.parquet``: one row per edge that is open to the vehicles, also those on no loop."""

FLOW_EVERY_S: Final = 10.0

# flow.parquet: one row every ten seconds, all vehicles together (TIME, its end, and)
ON_ROAD: Final = "vehicles"  # vehicles on the road
STILL: Final = "standing"  # mean number of vehicles slower than 0.1 m/s
FLOW_COLUMNS: Final = (TIME, ON_ROAD, STILL, DISTANCE, LAPS)

# fronts.parquet: one row per vehicle and step (TIME, VEHICLE, and)
FRONT: Final = "front_dm"  # where its front is, along its loop, laps counted on [tenths of a metre]
FRONTS_PER_M: Final = 10

# loops.parquet: one row per loop and edge on it, in their order (LOOP, EDGE, and)
EDGE_BEGIN: Final = "begin_m"  # where the edge begins, along the loop
LOOP_COLUMNS: Final = (LOOP, EDGE, EDGE_BEGIN)
