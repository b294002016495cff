"""Robots, states, configurations and systems: pure data, no SUMO, no clock, no files but the system file."""

from loopgate.model.system import (
    Configuration,
    MutableConfiguration,
    Placement,
    Robot,
    RobotId,
    StateId,
    System,
)
from loopgate.model.system_file import read_system, system_from_dict, system_to_dict, write_system

__all__ = [
    "Configuration",
    "MutableConfiguration",
    "Placement",
    "Robot",
    "RobotId",
    "StateId",
    "System",
    "read_system",
    "system_from_dict",
    "system_to_dict",
    "write_system",
]
