"""Loops, streets and runs as files that maps, satellite receivers and spreadsheets read."""

from loopgate.export.loops import export_loops
from loopgate.export.run_maps import LAYERS, export_run, run_features, vehicle_day
from loopgate.export.ways import Turn, Way, find_turns, loop_way

__all__ = [
    "LAYERS",
    "Turn",
    "Way",
    "export_loops",
    "export_run",
    "find_turns",
    "loop_way",
    "run_features",
    "vehicle_day",
]
