"""Loops, streets and runs as files that maps, satellite receivers and spreadsheets read."""

from loopgate.export.maps import (
    LAYERS,
    LoopLine,
    RouteTurn,
    export_loops,
    export_run,
    find_turns,
    loop_line,
    run_features,
    vehicle_day,
)

__all__ = [
    "LAYERS",
    "LoopLine",
    "RouteTurn",
    "export_loops",
    "export_run",
    "find_turns",
    "loop_line",
    "run_features",
    "vehicle_day",
]
