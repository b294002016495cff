"""Columns of a results table (one row per run of a sweep): names, units, meanings."""

from functools import partial
from typing import Final

from loopgate.results import columns as run

STRANGE = "it holds what no run has, or another version made it"
"""Is said of results that can be read, but whose figures do not fit together."""

HELD = dict[str, str]()
"""What each column of the table holds, in Arrow's words, by its name."""


def _column(holds: str, name: str) -> str:
    HELD[name] = holds
    return name


_text, _whole, _number = partial(_column, "string"), partial(_column, "int64"), partial(_column, "float64")
_numbers = partial(_column, "list<float>")

# Which run it is
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
LAPS: Final = _whole("laps")  # of all vehicles together
DISTANCE_KM: Final = _number("distance_km")  # of all vehicles together
MEAN_SPEED: Final = _number("mean_speed_mps")  # of all vehicles together
LAPS_PER_H: Final = _number(
    "laps_per_h"
)  # over the duration asked for, unless it ended since all had arrived
KM_PER_H: Final = _number("km_per_h")  # as LAPS_PER_H
KM_PER_H_MEASURED: Final = _number("km_per_h_measured")  # over the time measured
TRUNCATED: Final = _column("bool", "truncated")  # whether it stopped at its deadlock, before its time
MEASURED: Final = _number("measured_s")  # simulated time measured
HOLD: Final = _number("hold_s")  # standing at gates; missing without a gate
STOOD: Final = _number("stood_s")  # slower than 0.1 m/s, under any gate
STOOD_SHARE: Final = _number("stood_share")  # the same as a share of the time that vehicles were there
LONGEST_STOOD: Final = _number("longest_stood_s")  # of any vehicle in one go, for whatever cause
LONGEST_WAIT: Final = _number("longest_wait_s")  # missing without a gate
LONGEST_FOR: Final = {
    cause: _number(f"longest_{cause}_s")
    for cause in ("crossing", "occupied", "deadlock", "reserve", "service", "red", "traffic")
}  # by cause, the longest time that one wait was for it; missing without a gate
ARRIVED: Final = _whole("arrived")  # of those who drive once, at the end of their route; missing without any
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
AUDIT: Final = _text("audit")  # clean, what the audit found as a JSON list, or not gated
NOT_GATED: Final = "not gated"  # what AUDIT says of a run without a gate, whose waits nobody measures
WARNINGS: Final = _text("warnings")  # what the run warned of, such as too few loops; JSON, a list
LAPLESS: Final = _whole("lapless_vehicles")  # vehicles without a lap in the last half hour that was measured
LAP_MEAN: Final = _number("lap_mean_s")  # mean time of a lap
LAP_QUANTILES: Final = _numbers("lap_quantiles_s")  # list: quantiles 0, 5, ..., 100 % of the run's lap times
MEAN_REVISIT: Final = _number("mean_revisit_s")  # mean over the edges visited twice
MAX_REVISIT: Final = _number("max_revisit_s")  # longest time between two visits of an edge
IDLENESS: Final = _number("idleness_s")  # mean over the edges and the time
WORST_IDLENESS: Final = _number("worst_idleness_s")  # longest time that some edge had no visit
UNVISITED: Final = _whole("unvisited_edges")  # edges on loops without a visit in the measured time
COVERAGE_EDGES: Final = _number("coverage_edges")  # share of the network's passenger edges on some loop
COVERAGE_LANE_KM: Final = _number("coverage_lane_km")  # the same, of the length of its lanes
NEVER_SEEN: Final = _whole("never_seen")  # streets open to the vehicles that nobody entered
HEADWAY_CV: Final = _number(
    "headway_cv"
)  # deviation of times between visits over their mean, mean over streets
BUNCHED: Final = _number("bunched")  # share of these times below a quarter of their mean, mean over streets
WITHIN: Final = _number("within")  # share of the streets' time within revisit_s, those never seen included
WITHIN_OF_SEEN: Final = _number("within_of_seen")  # the same, of the streets that were seen
STREETS_OVER: Final = _whole("streets_over")  # streets that were seen, and at some time not for revisit_s
IF_EVEN: Final = _number(
    "idleness_if_even_s"
)  # IDLENESS if all came evenly on their loops, as fast as they were
WORST_IF_EVEN: Final = _number("worst_idleness_if_even_s")  # the same of WORST_IDLENESS
EDGE_KM: Final = _number("edge_km")  # length of all edges on some loop
EDGE_SET: Final = _text("edge_set")  # names the table of these edges, in the order of the lists below
EDGE_VISITS: Final = _numbers("edge_visits")  # per edge: how often vehicles entered it
EDGE_HOLD: Final = _numbers("edge_hold_s")  # per edge: standing at gates
EDGE_STOOD: Final = _numbers("edge_stood_s")  # per edge: slower than 0.1 m/s
EDGE_MEAN_REVISIT: Final = _numbers("edge_mean_revisit_s")  # per edge: mean time between two visits
EDGE_MAX_REVISIT: Final = _numbers("edge_max_revisit_s")  # per edge: longest time between two visits
EDGE_IDLENESS: Final = _numbers("edge_idleness_s")  # per edge: mean over the time
EDGE_LISTS: Final = {
    run.VISITS: EDGE_VISITS,
    run.EDGE_HOLD: EDGE_HOLD,
    run.STOOD: EDGE_STOOD,
    run.MEAN_REVISIT: EDGE_MEAN_REVISIT,
    run.MAX_REVISIT: EDGE_MAX_REVISIT,
    run.IDLENESS: EDGE_IDLENESS,
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
