"""Roads and loops: the SUMO network for the rest of the program."""

from loopgate.network.generate import FoundLoops, find_loops, generate_loops
from loopgate.network.lanes import make_loop
from loopgate.network.loop import LaneSpan, Loop
from loopgate.network.road import Connection, Edge, Junction, Lane, RoadNetwork, packaged_networks
from loopgate.network.routes_file import read_loops
from loopgate.network.routes_text import write_loops
from loopgate.network.sumo_config import read_sumo_config
from loopgate.network.vehicle_demand import RoutesFile, VehicleDemand
from loopgate.network.vehicle_type import VehicleType

__all__ = [
    "Connection",
    "Edge",
    "FoundLoops",
    "Junction",
    "Lane",
    "LaneSpan",
    "Loop",
    "RoadNetwork",
    "RoutesFile",
    "VehicleDemand",
    "VehicleType",
    "find_loops",
    "generate_loops",
    "make_loop",
    "packaged_networks",
    "read_loops",
    "read_sumo_config",
    "write_loops",
]
