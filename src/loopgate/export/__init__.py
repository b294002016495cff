"""Loops, streets and runs as files that maps, satellite receivers and spreadsheets read."""

from loopgate.export.loop_lines import LoopLine, Turn, find_turns, loop_line
from loopgate.export.loops import export_loops
from loopgate.export.run_maps import LAYERS, export_run, run_features, vehicle_day

__all__ = [
    "LAYERS",
    "LoopLine",
    "Turn",
    "export_loops",
    "export_run",
    "find_turns",
    "loop_line",
    "run_features",
    "vehicle_day",
]
