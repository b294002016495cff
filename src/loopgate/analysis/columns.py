"""Column names of the tables that analysis makes, with units; of the run folder: `results.columns`."""

from typing import Final

# one row per lap, hold, wait or revisit interval of a run
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
NEVER_SEEN: Final = "never_seen"  # how many of them nobody entered

# one row per group of runs
RUNS: Final = "runs"  # how many runs the row rests on
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
UNWATCHED: Final = "unwatched"  # streets that nobody entered meanwhile, and since when

# one row per kind of message
MESSAGE: Final = "message"  # its kind
MESSAGES: Final = "messages"  # transmissions
BYTES: Final = "bytes"  # what they hold
PER_MOVE: Final = "per_move"  # of them for each move of a vehicle to its next place
