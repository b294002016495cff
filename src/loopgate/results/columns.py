"""All columns of all tables, of a run, of a sweep and of an analysis: names, units, and what they hold."""

from enum import StrEnum
from functools import partial
from typing import Final

STRANGE = "it holds what no run has, or another version made it"
"""Is said of results that can be read, but whose figures do not fit together."""

HELD = dict[str, str]()
"""What each column of the table holds, in Arrow's words, by its name."""


def _column(holds: str, name: str) -> str:
    HELD[name] = holds
    return name


_text, _whole, _number = partial(_column, "string"), partial(_column, "int64"), partial(_column, "float64")
_numbers = partial(_column, "list<float>")

_CAUSES: Final = (
    *("crossing", "occupied", "deadlock", "reserve", "service"),
    *("red", "traffic", "closed", "blocked"),
)
"""The reasons of refusals for which a vehicle waits."""

# Tables of a run: summary.json
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
LAPS: Final = _whole("laps")  # completed laps
DISTANCE: Final = "distance_m"  # distance driven [m]
MEAN_SPEED: Final = _number("mean_speed_mps")  # distance over time on the road [m/s]
HOLD: Final = _number("hold_s")  # total time standing at gates
STOOD: Final = (
    _number("stood_s")  # time slower than 0.1 m/s, under any gate; of an edge also in the junction behind it
)
LONGEST_STOOD: Final = _number("longest_stood_s")  # longest time without moving, for whatever cause
STOPS: Final = "stops"  # stops made
STOPPED: Final = "stopped_s"  # time at these
DEPART_DELAY: Final = "depart_delay_s"  # time from when it wanted to depart until it did
TIME_LOSS: Final = "time_loss_s"  # what it lost against driving at its ideal speed; of those who drive once
WAITING: Final = "waiting_s"  # how long it stood on its way, at gates too, not at its own stops; of the same
TRIP_TIME: Final = "trip_s"  # how long it was under way, so far if it has not arrived; of the same
ARRIVAL: Final = "arrival_s"  # when it was at the end of its route; NaN if it is not; of the same
ARRIVED: Final = _whole("arrived")  # whether it is at the end of its route; of the same
LONGEST_WAIT: Final = _number("longest_wait_s")  # longest time from asking to being granted
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
MEAN_REVISIT: Final = _number("mean_revisit_s")  # mean time between two visits
MAX_REVISIT: Final = _number("max_revisit_s")  # longest time between two visits
WEIGHTED_REVISIT: Final = "weighted_revisit_s"  # mean time between two visits, weighted by its length
IDLENESS: Final = _number("idleness_s")  # time-weighted mean time since the last visit
WORST_IDLENESS: Final = _number("worst_idleness_s")  # longest time since the last visit
EDGE_HOLD: Final = "hold_s"  # vehicles' hold time on the edge
JUNCTION: Final = "junction"  # where the edge ends
SHAPE: Final = "shape"  # "x,y x,y ..." [m], network coordinates
HEADWAY_CV: Final = _number("headway_cv")  # standard deviation over mean of the times between two visits
BUNCHED: Final = _number("bunched")  # share of these below a quarter of their mean, 0 to 1
WITHIN: Final = _number("within")  # share of the time in which the idleness is at most the bound, 0 to 1
_SEEN = (VISITS, MEAN_REVISIT, MAX_REVISIT, WEIGHTED_REVISIT, IDLENESS, WORST_IDLENESS)
EDGE_COLUMNS: Final = (EDGE, EDGE_LENGTH, *_SEEN, EDGE_HOLD, SHAPE)
BOUND: Final = "bound_s"  # time for which the street should not go unseen; infinity for none
STREET: Final = "street"  # name of the street, empty where the network has none
WATCH_COLUMNS: Final = (EDGE, *_SEEN, HEADWAY_CV, BUNCHED, BOUND, WITHIN)
STREET_COLUMNS: Final = (EDGE, STREET, EDGE_LENGTH, *WATCH_COLUMNS[1:], SHAPE)
"""``streets.parquet``: one row per edge that is open to the vehicles, also those on no loop."""

# junctions.parquet: one row per junction and movement on some loop (JUNCTION, EDGE from which it comes, and)
TO_EDGE: Final = "to_edge"  # edge to which it leads
CROSSED: Final = "vehicles"  # how many vehicles made the movement
CROSSED_PER_H: Final = "vehicles_per_h"  # the same over the time measured
DELAY: Final = (
    "delay_s"  # time on the edge and over the junction, less that at the limits and at own stops; mean
)
DELAY_95: Final = "delay_95_s"  # 95 % of the vehicles were delayed no longer
SERVICE_LEVEL: Final = "level_of_service"  # A to F by DELAY, as in the Highway Capacity Manual
QUEUE: Final = (
    "queue_mean"  # vehicles slower than 0.1 m/s on the edge and over the junction, mean over the time
)
QUEUE_95: Final = "queue_95"  # no more than so many stood in 95 % of the time
QUEUE_MOST: Final = "queue_longest"  # most that stood at a time
LOST: Final = "lost_h"  # vehicle-hours of delay, all vehicles together
GREEN_USED: Final = (
    "green_used"  # share of green used by vehicles on paths, at 2 s each; NaN if no light changes
)
MOVEMENT: Final = "movement"  # from which edge to which, by the names of the streets where they have names
WAITED_FOR: Final = {
    cause: f"waited_{cause}_s" for cause in _CAUSES
}  # by cause, vehicle-seconds for which the gate refused those first in line; 0 under no gate
JUNCTION_COLUMNS: Final = (
    *(JUNCTION, EDGE, TO_EDGE, MOVEMENT, CROSSED, CROSSED_PER_H, DELAY, DELAY_95, SERVICE_LEVEL),
    *(QUEUE, QUEUE_95, QUEUE_MOST, GREEN_USED, *WAITED_FOR.values()),
)

# visits.parquet: one row per stop that a vehicle completed, as in SUMO's stop-output (VEHICLE, LOOP, and)
STOP: Final = "stop"  # name of the bus stop or parking area, or of the lane
CAME: Final = "came_s"  # when it stopped there [s]
WENT_ON: Final = "went_on_s"  # when it might go on [s]
DUE: Final = "due_s"  # when it was to go on by the timetable (`until`) [s]; NaN without one
VISIT_COLUMNS: Final = (VEHICLE, STOP, LOOP, CAME, WENT_ON, DUE)

# stops.parquet: one row per stop and loop whose vehicles stop there (STOP, LOOP, VISITS completed, and)
DWELL: Final = "dwell_s"  # how long vehicles stood there, mean
HEADWAY: Final = "headway_s"  # time between two arrivals, mean; NaN if there were fewer than two
LONGEST_HEADWAY: Final = "longest_headway_s"  # the longest
TIMED: Final = "timed"  # visits with a time in the timetable
LATENESS: Final = "late_s"  # how long after that time vehicles went on, median; NaN without a time
WORST_LATENESS: Final = "worst_late_s"  # the longest
ON_TIME_60: Final = "within_60_s"  # share of the timed visits at most so late, 0 to 1
ON_TIME_120: Final = "within_120_s"  # the same
PERSONS: Final = (
    "persons_waiting"  # who waited there, mean over time; NaN where the simulation has no persons
)
PERSONS_MOST: Final = "persons_most"  # the most at one time
STOP_COLUMNS: Final = (
    *(STOP, LOOP, VISITS, DWELL, HEADWAY, HEADWAY_CV, LONGEST_HEADWAY),
    *(TIMED, LATENESS, WORST_LATENESS, ON_TIME_60, ON_TIME_120, PERSONS, PERSONS_MOST),
)

# persons.parquet: every ten seconds the persons who wait at each bus stop, where the simulation has persons
WAITING_COLUMNS: Final = (TIME, STOP, PERSONS)

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


# A row of a sweep: one row per run. Which run it is
KEY: Final = _text("key")  # stable key of the run: hash of the scenario and of the files it names
ATTEMPT: Final = _whole("attempt")  # 1, 2, ...: how often the run was started before this row came
STATUS: Final = _text("status")  # ok or failed
STATUS_OK: Final = "ok"  # the run was made
STATUS_FAILED: Final = "failed"  # it was not: see error
ERROR: Final = _text("error")  # one line, empty if ok
SCENARIO: Final = _text("scenario")  # the whole scenario as asked for, as JSON
FOLDER: Final = "results"  # where the row was read from; only where several folders hold the same run

# Options that studies group by; all others are in the scenario
NETWORK: Final = _text("network")  # as in the scenario
NETWORK_HASH: Final = _text("network_hash")  # SHA-256 of the network file, or the package's name and version
ROUTES_HASH: Final = _text("routes_hash")  # the same of the route file
VEHICLES: Final = _whole("vehicles")  # how many the run had
LOOPS: Final = _whole("loops")  # how many the run had
GATE: Final = _text("gate")  # as in the scenario
ABSTRACTION: Final = _text("abstraction")  # as in the scenario
NEGOTIATION: Final = _text("negotiation")  # as in the scenario
LIGHTS: Final = _text("lights")  # as in the scenario, or what the run chose
SEED: Final = _whole("seed")  # as in the scenario
DURATION: Final = _number("duration_s")  # asked for; MEASURED says how long it was
WARMUP: Final = _number("warmup_s")  # time before it is measured [s]
OPTION_COLUMNS: Final = (
    *(NETWORK, VEHICLES, LOOPS, GATE, ABSTRACTION),
    *(NEGOTIATION, LIGHTS, SEED, DURATION, WARMUP),
)

# What came out; the names are those of summary.json where it has them
DISTANCE_KM: Final = _number("distance_km")  # of all vehicles together
LAPS_PER_H: Final = _number(
    "laps_per_h"
)  # over the duration asked for, unless it ended since all had arrived
KM_PER_H: Final = _number("km_per_h")  # as LAPS_PER_H
KM_PER_H_MEASURED: Final = _number("km_per_h_measured")  # over the time measured
TRUNCATED: Final = _column("bool", "truncated")  # whether it stopped at its deadlock, before its time
MEASURED: Final = _number("measured_s")  # simulated time measured
STOOD_SHARE: Final = _number("stood_share")  # the same as a share of the time that vehicles were there
LONGEST_FOR: Final = {
    cause: _number(f"longest_{cause}_s") for cause in _CAUSES
}  # by cause, the longest time that one wait was for it; missing without a gate
UNFINISHED: Final = _whole("unfinished")  # the others of these
MEAN_TIME_LOSS: Final = _number("mean_time_loss_s")  # lost on the way, mean over all of these that were due
MEAN_DEPART_DELAY: Final = _number(
    "mean_depart_delay_s"  # wait to depart, mean over the same, or over those on loops if none drives once
)
MEAN_DELAY: Final = _number("mean_delay_s")  # time loss and wait to depart together, mean over the same
WORST_DELAY: Final = _number("worst_delay_s")  # the greatest of any
MEAN_WAITING: Final = _number(
    "mean_waiting_s"
)  # standing on the way, not at own stops, mean over all as above
MEAN_TRIP: Final = _number(
    "mean_trip_s"
)  # from departure to arrival, mean over those who arrived; else missing
OUTCOME: Final = _text("outcome")  # done, deadlock or starving
STARVING: Final = _whole("starving_vehicles")  # vehicles that starved; missing under no gate
CLOSURES: Final = _whole("closures")  # streets and lanes that were closed during the run
BREAKDOWNS: Final = _whole("breakdowns")  # vehicles that broke down
LED_ROUND: Final = _whole("led_round")  # vehicles that were led round what was closed or blocked
DEADLOCKS: Final = _whole("deadlocks")  # how many
FIRST_DEADLOCK: Final = _number(
    "first_deadlock_s"
)  # simulated time from the beginning until its circle closed, missing without deadlock
DEADLOCK_SIZE: Final = _whole("deadlock_vehicles")  # vehicles in the first deadlock
OBSERVED: Final = _number(
    "observed_s"
)  # simulated time until the first deadlock or the end, from the beginning
COLLISIONS: Final = _whole("collisions")  # as SUMO reports them, of gated vehicles
TELEPORTS: Final = _whole("teleports")  # as SUMO reports them
OVERRUNS: Final = _whole("overruns")  # held vehicles that could not brake for their line, or did not
TRESPASSES: Final = _whole("trespasses")  # vehicles that entered a state without a grant
ON_RED: Final = _whole("on_red")  # gated, crossed at red, unable to brake; missing unless lights are obeyed
STRAYS: Final = _whole("strays")  # vehicles that SUMO took to another lane than their loop's
KEPT: Final = _column("bool", "clean")  # whether a gated run kept what is promised; missing under no gate
DECISIONS: Final = _whole("decisions")  # how often the gate was asked
REFUSALS: Final = _whole("refusals")  # all reasons together
REFUSAL_REASONS: Final = _text("refusal_reasons")  # JSON, reason: count
MESSAGES: Final = _number("messages")  # messages between robots, missing where the gate sends none
AUDIT: Final = _text(
    "audit"
)  # clean, what the audit found as a JSON list, or not gated; missing if it was not made
OF_AN_OWNER: Final = "a script with loopgate.attach"  # what COMMAND says of a simulation that was attached to
NOT_AUDITED: Final = "not audited"  # what a summary says of a gated run that no audit checked
NOT_GATED: Final = "not gated"  # what AUDIT says of a run without a gate, whose waits nobody measures
WARNINGS: Final = _text("warnings")  # what the run warned of, such as too few loops; JSON, a list
LAPLESS: Final = _whole("lapless_vehicles")  # vehicles without a lap in the last half hour that was measured
LAP_MEAN: Final = _number("lap_mean_s")  # mean time of a lap
LAP_QUANTILES: Final = _numbers("lap_quantiles_s")  # list: quantiles 0, 5, ..., 100 % of the run's lap times
UNVISITED: Final = _whole("unvisited_edges")  # edges on loops without a visit in the measured time
COVERAGE_EDGES: Final = _number("coverage_edges")  # share of the network's passenger edges on some loop
COVERAGE_LANE_KM: Final = _number("coverage_lane_km")  # the same, of the length of its lanes
NEVER_SEEN: Final = _whole("never_seen")  # streets open to the vehicles that nobody entered
WITHIN_OF_SEEN: Final = _number("within_of_seen")  # the same, of the streets that were seen
STREETS_OVER: Final = _whole("streets_over")  # streets that were seen, and at some time not for revisit_s
IF_EVEN: Final = _number(
    "idleness_if_even_s"
)  # IDLENESS if all came evenly on their loops, as fast as they were
WORST_IF_EVEN: Final = _number("worst_idleness_if_even_s")  # the same of WORST_IDLENESS
EDGE_KM: Final = _number("edge_km")  # length of all edges on some loop
EDGE_SET: Final = _text("edge_set")  # names the table of these edges, in the order of the lists below
EDGE_VISITS: Final = _numbers("edge_visits")  # per edge: how often vehicles entered it
EDGE_HOLDS: Final = _numbers("edge_hold_s")  # per edge: standing at gates
EDGE_STOOD: Final = _numbers("edge_stood_s")  # per edge: slower than 0.1 m/s
EDGE_MEAN_REVISIT: Final = _numbers("edge_mean_revisit_s")  # per edge: mean time between two visits
EDGE_MAX_REVISIT: Final = _numbers("edge_max_revisit_s")  # per edge: longest time between two visits
EDGE_IDLENESS: Final = _numbers("edge_idleness_s")  # per edge: mean over the time
EDGE_LISTS: Final = {
    VISITS: EDGE_VISITS,
    EDGE_HOLD: EDGE_HOLDS,
    STOOD: EDGE_STOOD,
    MEAN_REVISIT: EDGE_MEAN_REVISIT,
    MAX_REVISIT: EDGE_MAX_REVISIT,
    IDLENESS: EDGE_IDLENESS,
}  # the columns of edges that these lists are made of

# What it was made with
LOOPGATE_VERSION: Final = _text("loopgate_version")  # of the package
LOOPGATE_CODE: Final = _text("loopgate_code")  # hash of the package's sources: a version under work is many
SUMO_VERSION: Final = _text("sumo_version")  # of SUMO
PYTHON_VERSION: Final = _text("python_version")  # of Python
COMMAND: Final = _text("command")  # reproduces the run

# What differs from one execution to the next: clocks and machines
DECISION_MEDIAN: Final = _number("decision_median_us")  # median time of a decision
DECISION_P99: Final = _number("decision_p99_us")  # 99 % took no longer
DECISION_MAX: Final = _number("decision_max_us")  # the longest
WALL_SUMO: Final = _number("wall_sumo_s")  # wall time in the steps of SUMO
WALL_GATE: Final = _number("wall_gate_s")  # wall time of the gate and all around it
WALL_TOTAL: Final = _number("wall_total_s")  # wall time of the run
TOOK: Final = _number("took_s")  # wall time of the whole task on its worker
PEAK_MEMORY: Final = _number("peak_mb")  # largest resident memory of the worker during the run
WORKER: Final = _text("worker")  # host and process
FINISHED: Final = _column("timestamp[ms, UTC]", "finished_at")  # UTC
VOLATILE_COLUMNS: Final = (
    ATTEMPT,
    DECISION_MEDIAN,
    DECISION_P99,
    DECISION_MAX,
    WALL_SUMO,
    WALL_GATE,
    WALL_TOTAL,
    TOOK,
    PEAK_MEMORY,
    WORKER,
    FINISHED,
)
"""Columns that say how long and where, never what: two executions of one sweep agree in all others."""


# Tables of an analysis: one row per lap, hold, wait or revisit interval of a run
SINCE: Final = "since_s"  # simulated time [s] at which it began
BEGIN: Final = "begin_s"  # the same, or the begin of the period of observation if that is later
END: Final = "end_s"  # simulated time [s] at which it ended, or at which observation ended
OPEN: Final = "open"  # True if it had not ended when observation ended
LAP_NUMBER: Final = "lap"  # 1 for a vehicle's first lap
LAP_TIME: Final = "lap_s"  # how long it took
WAIT: Final = "wait_s"  # from the first refusal to the grant
CAUSE: Final = "cause"  # why a wait was: the reason of the refusals
INTERVAL: Final = "revisit_s"  # time between two visits of an edge

# one row per time, or per district
SEEN_WITHIN: Final = "within_s"  # time since the last visit [s]
NOW: Final = "now"  # share of the streets seen no longer ago, mean over the time
ALWAYS: Final = "always"  # share of the streets of which that always held
DISTRICT: Final = "district"  # name of the district
STREETS: Final = "streets"  # how many edges

# one row per group of runs
RUNS: Final = "runs"  # how many runs the row rests on
OF: Final = "of"  # no column: the attribute of a table that names the value asked for
MEAN: Final = "mean"  # in the unit of the value asked for
MOST: Final = "most"  # of any run, same unit
STD: Final = "std"  # sample standard deviation over runs, same unit
LOW: Final = "low"  # lower end of the interval, same unit as the estimate
HIGH: Final = "high"  # upper end of it
CLEAN: Final = "audit_clean"  # runs under a gate whose audit found nothing
FAILED: Final = "failed"  # runs that could not be made; all other columns leave them out
DEADLOCKED: Final = "deadlocked"  # runs with a deadlock
RATE: Final = "rate"  # share of runs, 0 to 1
AT: Final = "time_s"  # simulated time [s]
AT_RISK: Final = "at_risk"  # runs under observation just before that time
CENSORED: Final = "censored"  # runs whose observation ended then without deadlock
SURVIVAL: Final = "survival"  # estimated share of runs without deadlock until then
MEDIAN_TIME: Final = "median_s"  # time by which half of the runs are deadlocked; missing if never seen
RESTRICTED_MEAN: Final = "restricted_mean_s"  # mean time without deadlock up to the horizon
HORIZON: Final = "horizon_s"  # time up to which runs are looked at
BASELINE: Final = "baseline"  # the gate compared with
PAIRS: Final = "pairs"  # runs of both gates that agree in everything else
DIFFERENCE: Final = "difference"  # mean of gate minus baseline over pairs, in the unit of the value
RATIO: Final = "ratio"  # sum over pairs of gate by sum of baseline
BETTER: Final = "better"  # share of pairs in which the gate has the greater value
KIND: Final = (
    "interval"  # how low and high were found: "bootstrap", "paired t", or "none" where no claim is made
)
DENSITY: Final = "density_veh_per_km"  # vehicles per kilometre of the edges on loops
FLOW: Final = "flow_veh_per_h"  # density times mean speed
SPEED: Final = "speed_km_per_h"  # mean speed of all vehicles
CAPACITY: Final = "capacity_vehicles"  # vehicle count at which the mean value is greatest
PEAK: Final = "peak"  # that greatest mean, in the unit of the value
AT_BORDER: Final = "at_border"  # True if it is the largest count measured: the capacity was not reached
QUANTILE: Final = "quantile"  # 0 to 1
MESSAGES_PER_DECISION: Final = "messages_per_decision"  # mean over the run
REFUSED_SHARE: Final = "refused_share"  # refusals per decision
SUMO_RULES: Final = "SUMO's rules"  # how series are named in which no gate decides
PROMISE: Final = "promise"  # kept, broken, never seen, or partly seen, by street
EDGES: Final = "edges"  # how many edges of that name
SEEN: Final = "seen"  # how many of them somebody entered
LATE: Final = "late"  # how many of these went unseen for longer than promised
SERIES: Final = "series"  # gate, and whatever else was chosen to differ besides network, vehicles and seed

# one row per interval of time, cause of waiting, vehicle that is stuck, edge entered, junction or street
STOOD_H: Final = "stood_h"  # vehicle-hours standing since the beginning
WAITS: Final = "waits"  # how many
LONGEST: Final = "longest_s"  # the longest
POSITION: Final = "position_m"  # along the loop
WAITS_FOR: Final = "waits_for"  # the vehicles whom it waits for
LANE: Final = "lane"  # the lane on which a vehicle stands
FROM: Final = "from_s"  # since when
UNTIL: Final = "to_s"  # until when
LED: Final = "led_round"  # how often the vehicle was led round what was shut
LONGER: Final = "longer_m"  # by how much its ways round were longer than what they replaced, in all
LATER: Final = "later_s"  # how much longer they took
SHUT_WAIT: Final = "waited_s"  # how long it was refused because the place ahead was shut
SHUT_QUEUE: Final = "behind_s"  # how long it was in a place behind a vehicle that was refused so
PHASE: Final = "phase"  # before, during or after the times in which some place was shut
UNWATCHED: Final = "unwatched"  # streets that nobody entered meanwhile, and since when

# one row per kind of message
MESSAGE: Final = "message"  # its kind
BYTES: Final = "bytes"  # what they hold
PER_MOVE: Final = "per_move"  # of them for each move of a vehicle to its next place
