"""The Parquet types of a results table."""

import pyarrow as pa

from loopgate.results import row_columns as c

_TEXT = (
    c.KEY,
    c.STATUS,
    c.ERROR,
    c.SCENARIO,
    c.NETWORK,
    c.NETWORK_HASH,
    c.ROUTES_HASH,
    c.GATE,
    c.ABSTRACTION,
    c.NEGOTIATION,
    c.LIGHTS,
    c.OUTCOME,
    c.REFUSAL_REASONS,
    c.AUDIT,
    c.WARNINGS,
    c.EDGE_SET,
    c.LOOPGATE_VERSION,
    c.LOOPGATE_CODE,
    c.SUMO_VERSION,
    c.PYTHON_VERSION,
    c.COMMAND,
    c.WORKER,
)
_WHOLE = (
    c.ATTEMPT,
    c.VEHICLES,
    c.LOOPS,
    c.SEED,
    c.LAPS,
    c.DEADLOCKS,
    c.DEADLOCK_SIZE,
    c.COLLISIONS,
    c.TELEPORTS,
    c.OVERRUNS,
    c.TRESPASSES,
    c.STRAYS,
    c.ON_RED,
    c.ARRIVED,
    c.UNFINISHED,
    c.DECISIONS,
    c.REFUSALS,
    c.UNVISITED,
    c.LAPLESS,
    c.NEVER_SEEN,
    c.STREETS_OVER,
)
_NUMBER = (
    c.DURATION,
    c.WARMUP,
    c.MEASURED,
    c.DISTANCE_KM,
    c.MEAN_SPEED,
    c.LAPS_PER_H,
    c.KM_PER_H,
    c.HOLD,
    c.STOOD,
    c.LONGEST_WAIT,
    *c.LONGEST_FOR.values(),
    c.MEAN_TIME_LOSS,
    c.MEAN_DEPART_DELAY,
    c.MEAN_DELAY,
    c.MEAN_WAITING,
    c.MEAN_TRIP,
    c.WORST_DELAY,
    c.FIRST_DEADLOCK,
    c.OBSERVED,
    c.MESSAGES,
    c.LAP_MEAN,
    c.MEAN_REVISIT,
    c.MAX_REVISIT,
    c.IDLENESS,
    c.WORST_IDLENESS,
    c.COVERAGE_EDGES,
    c.COVERAGE_LANE_KM,
    c.HEADWAY_CV,
    c.BUNCHED,
    c.WITHIN,
    c.WITHIN_OF_SEEN,
    c.IF_EVEN,
    c.WORST_IF_EVEN,
    c.EDGE_KM,
    c.DECISION_MEDIAN,
    c.DECISION_P99,
    c.DECISION_MAX,
    c.WALL_SUMO,
    c.WALL_GATE,
    c.WALL_TOTAL,
    c.TOOK,
    c.PEAK_MEMORY,
)

ROW_SCHEMA = pa.schema(
    [pa.field(name, pa.string()) for name in _TEXT]
    + [pa.field(name, pa.int64()) for name in _WHOLE]
    + [pa.field(name, pa.float64()) for name in _NUMBER]
    + [pa.field(name, pa.list_(pa.float32())) for name in (c.LAP_QUANTILES, *c.EDGE_LISTS)]
    + [pa.field(c.KEPT, pa.bool_())]
    + [pa.field(c.FINISHED, pa.timestamp("ms", tz="UTC"))]
)
