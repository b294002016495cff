"""Robots, states, configurations and systems: pure data, no SUMO, no clock, no files but the system file."""

from loopgate.model.configuration import Configuration, MutableConfiguration, Placement
from loopgate.model.ids import RobotId, StateId
from loopgate.model.robot import Robot
from loopgate.model.system import System
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
