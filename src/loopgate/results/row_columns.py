"""Column names of a results table: one row per run of a sweep, with units."""

from typing import Final

# Which run it is
KEY: Final = "key"  # stable key of the run: hash of the scenario and of the files it names
ATTEMPT: Final = "attempt"  # 1, 2, ...: how often the run was started before this row came
STATUS: Final = "status"  # ok or failed
STATUS_OK: Final = "ok"  # the run was made
STATUS_FAILED: Final = "failed"  # it was not: see error
ERROR: Final = "error"  # one line, empty if ok
SCENARIO: Final = "scenario"  # the whole scenario as asked for, as JSON
FOLDER: Final = "results"  # where the row was read from; only where several folders hold the same run

# Options that studies group by; all others are in the scenario
NETWORK: Final = "network"  # as in the scenario
NETWORK_HASH: Final = "network_hash"  # SHA-256 of the network file, or the package's name and version
ROUTES_HASH: Final = "routes_hash"  # the same of the route file
VEHICLES: Final = "vehicles"  # how many the run had
LOOPS: Final = "loops"  # how many the run had
GATE: Final = "gate"  # as in the scenario
ABSTRACTION: Final = "abstraction"  # as in the scenario
NEGOTIATION: Final = "negotiation"  # as in the scenario
LIGHTS: Final = "lights"  # as in the scenario, or what the run chose
SEED: Final = "seed"  # as in the scenario
DURATION: Final = "duration_s"  # asked for; MEASURED says how long it was
WARMUP: Final = "warmup_s"  # time before it is measured [s]
OPTION_COLUMNS: Final = (
    NETWORK,
    VEHICLES,
    LOOPS,
    GATE,
    ABSTRACTION,
    NEGOTIATION,
    LIGHTS,
    SEED,
    DURATION,
    WARMUP,
)

# What came out; the names are those of summary.json where it has them
LAPS: Final = "laps"  # of all vehicles together
DISTANCE_KM: Final = "distance_km"  # of all vehicles together
MEAN_SPEED: Final = "mean_speed_mps"  # of all vehicles together
LAPS_PER_H: Final = "laps_per_h"  # over the duration asked for, unless the run ended since all had arrived
KM_PER_H: Final = "km_per_h"  # as LAPS_PER_H
MEASURED: Final = "measured_s"  # simulated time measured
HOLD: Final = "hold_s"  # standing at gates; missing without a gate
STOOD: Final = "stood_s"  # slower than 0.1 m/s, under any gate
LONGEST_WAIT: Final = "longest_wait_s"  # missing without a gate
LONGEST_FOR: Final = {
    cause: f"longest_{cause}_s"
    for cause in ("crossing", "occupied", "deadlock", "reserve", "service", "red", "traffic")
}  # by cause, the longest time that one wait was for it; missing without a gate
ARRIVED: Final = (
    "arrived"  # of vehicles that drive once, those at the end of their route; missing without any
)
UNFINISHED: Final = "unfinished"  # the others of these
MEAN_TIME_LOSS: Final = "mean_time_loss_s"  # lost on the way, mean over all of these that were due
MEAN_DEPART_DELAY: Final = (
    "mean_depart_delay_s"  # wait to depart, mean over the same, or over those on loops if none drives once
)
MEAN_DELAY: Final = "mean_delay_s"  # time loss and wait to depart together, mean over the same
WORST_DELAY: Final = "worst_delay_s"  # the greatest of any
MEAN_WAITING: Final = "mean_waiting_s"  # standing on the way, own stops left out, mean over all as above
MEAN_TRIP: Final = "mean_trip_s"  # from departure to arrival, mean over those who have; missing if none has
OUTCOME: Final = "outcome"  # done or deadlock
DEADLOCKS: Final = "deadlocks"  # how many
FIRST_DEADLOCK: Final = "first_deadlock_s"  # simulated time, missing without deadlock
DEADLOCK_SIZE: Final = "deadlock_vehicles"  # vehicles in the first deadlock
OBSERVED: Final = "observed_s"  # simulated time until the first deadlock or the end
COLLISIONS: Final = "collisions"  # as SUMO reports them, of gated vehicles
TELEPORTS: Final = "teleports"  # as SUMO reports them
OVERRUNS: Final = "overruns"  # held vehicles that could not brake for their line, or did not
TRESPASSES: Final = "trespasses"  # vehicles that entered a state without a grant
ON_RED: Final = (
    "on_red"  # gated vehicles that crossed at red, unable to brake; missing unless lights are obeyed
)
STRAYS: Final = "strays"  # vehicles that SUMO took to another lane than their loop's
KEPT: Final = "clean"  # whether a gated run kept what is promised; missing under no gate
DECISIONS: Final = "decisions"  # how often the gate was asked
REFUSALS: Final = "refusals"  # all reasons together
REFUSAL_REASONS: Final = "refusal_reasons"  # JSON, reason: count
MESSAGES: Final = "messages"  # messages between robots, missing where the gate sends none
AUDIT: Final = "audit"  # clean, what the audit found as a JSON list, or not gated
NOT_GATED: Final = "not gated"  # what AUDIT says of a run without a gate, whose waits nobody measures
WARNINGS: Final = "warnings"  # what the run warned of, such as fewer loops than asked for; JSON, a list
LAPLESS: Final = "lapless_vehicles"  # vehicles without a lap in the last half hour that was measured
LAP_MEAN: Final = "lap_mean_s"  # mean time of a lap
LAP_QUANTILES: Final = "lap_quantiles_s"  # list: quantiles 0, 5, ..., 100 % of the run's lap times
MEAN_REVISIT: Final = "mean_revisit_s"  # mean over the edges visited twice
MAX_REVISIT: Final = "max_revisit_s"  # longest time between two visits of an edge
IDLENESS: Final = "idleness_s"  # mean over the edges and the time
WORST_IDLENESS: Final = "worst_idleness_s"  # longest time that some edge had no visit
UNVISITED: Final = "unvisited_edges"  # edges on loops without a visit in the measured time
COVERAGE_EDGES: Final = "coverage_edges"  # share of the network's passenger edges that are on some loop
COVERAGE_LANE_KM: Final = "coverage_lane_km"  # the same, of the length of its lanes
NEVER_SEEN: Final = "never_seen"  # streets open to the vehicles that nobody entered
HEADWAY_CV: Final = "headway_cv"  # deviation of the times between visits over their mean, mean over streets
BUNCHED: Final = "bunched"  # share of these times below a quarter of their mean, mean over streets
WITHIN: Final = "within"  # share of the streets' time within revisit_s, those never seen included
WITHIN_OF_SEEN: Final = "within_of_seen"  # the same, of the streets that were seen
STREETS_OVER: Final = "streets_over"  # streets that were seen, and at some time not for revisit_s
IF_EVEN: Final = "idleness_if_even_s"  # IDLENESS if every loop's vehicles came evenly, as fast as they were
WORST_IF_EVEN: Final = "worst_idleness_if_even_s"  # the same of WORST_IDLENESS
EDGE_KM: Final = "edge_km"  # length of all edges on some loop
EDGE_SET: Final = "edge_set"  # names the table of these edges, in the order of the lists below
EDGE_VISITS: Final = "edge_visits"  # per edge: how often vehicles entered it
EDGE_HOLD: Final = "edge_hold_s"  # per edge: standing at gates
EDGE_STOOD: Final = "edge_stood_s"  # per edge: slower than 0.1 m/s
EDGE_MEAN_REVISIT: Final = "edge_mean_revisit_s"  # per edge: mean time between two visits
EDGE_MAX_REVISIT: Final = "edge_max_revisit_s"  # per edge: longest time between two visits
EDGE_IDLENESS: Final = "edge_idleness_s"  # per edge: mean over the time
EDGE_LISTS: Final = (
    EDGE_VISITS,
    EDGE_HOLD,
    EDGE_STOOD,
    EDGE_MEAN_REVISIT,
    EDGE_MAX_REVISIT,
    EDGE_IDLENESS,
)

# What it was made with
LOOPGATE_VERSION: Final = "loopgate_version"  # of the package
LOOPGATE_CODE: Final = "loopgate_code"  # hash of the package's sources: a version under work is many
SUMO_VERSION: Final = "sumo_version"  # of SUMO
PYTHON_VERSION: Final = "python_version"  # of Python
COMMAND: Final = "command"  # reproduces the run

# What differs from one execution to the next: clocks and machines
DECISION_MEDIAN: Final = "decision_median_us"  # median time of a decision
DECISION_P99: Final = "decision_p99_us"  # 99 % took no longer
DECISION_MAX: Final = "decision_max_us"  # the longest
WALL_SUMO: Final = "wall_sumo_s"  # wall time in the steps of SUMO
WALL_GATE: Final = "wall_gate_s"  # wall time of the gate and all around it
WALL_TOTAL: Final = "wall_total_s"  # wall time of the run
TOOK: Final = "took_s"  # wall time of the whole task on its worker
PEAK_MEMORY: Final = "peak_mb"  # largest resident memory of the worker during the run
WORKER: Final = "worker"  # host and process
FINISHED: Final = "finished_at"  # UTC
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
