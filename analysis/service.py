"""How many moves it takes to serve the one who waits, on real networks filled to the most that can start.

    python analysis/service.py networks/grid5-priority.net.xml sumo:DRT sumo:bs3d my.net.xml

Random loops, vehicles given to them in turn until no more can start with a slot free in every place; with
``--brim`` more on top, wherever they close no circle and crowd no set of places, until nobody fits any more.
Then vehicles are served one after another: each time the head of a place, that of a vehicle drawn at random.
Each move is the one that the rule names, and the gate is asked about it. These are moves of the model only.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import time
from collections.abc import Sequence
from itertools import cycle, islice

from service_rule import next_mover

from loopgate.abstraction.queue_layout import lay_out_queues
from loopgate.abstraction.queues import choose_places, most_at_start
from loopgate.errors import TooManyVehiclesError
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.chain import circle_from
from loopgate.gates.certified.crowding import too_many
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.network import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.demand.allotment import random_loops
from loopgate.simulation.scenario import Scenario


def filled(network: RoadNetwork, scenario: Scenario, loops: int) -> System:
    """Return the system of random loops with the most vehicles that can start on them, in turn."""
    found = random_loops(scenario, network, loops).loops
    layout = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in found])
    most = most_at_start(layout)
    ways = list(islice(cycle(layout.itineraries[loop.id] for loop in found), sum(most.values()) + 1))
    while True:
        try:
            names = [f"v{k + 1}" for k in range(len(ways))]
            starts = choose_places(ways, most, names=names, wishes={}, rng=random.Random(scenario.seed))
            break
        except TooManyVehiclesError as error:
            del ways[error.fitting :]
    robots = [
        Robot(RobotId(name), tuple(leg.state for leg in way.legs), start=start)
        for name, way, start in zip(names, ways, starts, strict=True)
    ]
    capacity = {StateId(name): place.capacity for name, place in layout.places.items()}
    return _system(robots, capacity)


def _system(robots: Sequence[Robot], capacity: dict[StateId, int]) -> System:
    visited = {state for robot in robots for state in robot.path}
    slots = {state: n for state, n in capacity.items() if state in visited}
    return System(robots, slots, slots)


def brimful(system: System, seed: int) -> System:
    """Return the system with more vehicles, wherever they close no circle and leave who is crowded away."""
    rng = random.Random(seed)
    robots = list(system.robots)
    lines: dict[StateId, list[Robot]] = {state: [] for state in system.states}
    for robot in robots:
        lines[robot.path[robot.start]].append(robot)
    ways = list({robot.path: robot for robot in robots})
    spots = [(way, k) for way in ways for k, state in enumerate(way) if system.capacity[state] > 1]
    for way, k in rng.sample(spots, len(spots)) * max(system.capacity.values()):
        line, room = lines[way[k]], system.capacity[way[k]]
        if len(line) < room:
            line.append(Robot(RobotId(f"v{len(robots) + 1}"), way, start=k))
            if len(line) == room and circle_from(_Lines(lines, dict(system.capacity)), way[k]):
                line.pop()
            else:
                robots.append(line[-1])
    number = {state: k for k, state in enumerate(system.states)}
    loops = [[number[state] for state in robot.path] for robot in robots]
    gone = set(too_many(loops, [system.capacity[state] for state in system.states]))
    return _system([robot for k, robot in enumerate(robots) if k not in gone], dict(system.capacity))


class _Lines:
    """Vehicles at their starts, as the chain rule sees them."""

    def __init__(self, lines: dict[StateId, list[Robot]], capacity: dict[StateId, int]) -> None:
        self._lines, self._capacity = lines, capacity

    def free(self, place: StateId) -> int:
        """Return how many slots are free."""
        return self._capacity[place] - len(self._lines[place])

    def first(self, place: StateId) -> Robot | None:
        """Return the first in line."""
        return next(iter(self._lines[place]), None)

    def wanted(self, vehicle: Robot) -> StateId:
        """Return the place after that."""
        return vehicle.path[(vehicle.start + 1) % len(vehicle.path)]


def serve(system: System, seed: int) -> tuple[str, list[int], int]:
    """Serve as many heads as there are vehicles; return the gate's promise, the moves each took, refusals."""
    gate = CertifiedGate(system)
    stand = Occupancy.of(SystemIndex(system), system.initial)
    lengths: list[int] = []
    refused = 0
    order = random.Random(seed).sample(range(len(system.robots)), len(system.robots))
    for chosen in order:
        robot = next(iter(stand.occupants(stand.state(chosen))))
        moves, mover = 0, -1
        while mover != robot:
            mover = next_mover(stand, robot)
            refused += not gate.decide_here(mover).admitted
            gate.moved_here(mover)
            stand.step(mover)
            moves += 1
        lengths.append(moves)
    return gate.promise, lengths, refused


def main() -> None:
    """Print a row per network; exit code 1 if the gate refused a move of a service."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("networks", nargs="+")
    parser.add_argument("--loops", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--brim", action="store_true", help="more vehicles than can start with a slot free")
    options = parser.parse_args()
    print(
        "| network | loops | places | slots | vehicles | promise | moves per service, mean | median | most ",
        end="",
    )
    print("| refused | s |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    wrong = 0
    for name in options.networks:
        begin = time.perf_counter()
        scenario = Scenario(network=name, gate="certified", seed=options.seed)
        system = filled(RoadNetwork.open(name), scenario, options.loops)
        if options.brim:
            system = brimful(system, options.seed)
        promise, moves, refused = serve(system, options.seed)
        wrong += refused
        loops = len({robot.path for robot in system.robots})
        row = (name, loops, len(system.states), sum(system.room), len(moves), promise)
        took = f"{statistics.mean(moves):.1f}", statistics.median(moves), max(moves)
        print(
            "|",
            " | ".join(map(str, (*row, *took, refused, round(time.perf_counter() - begin)))),
            "|",
            flush=True,
        )
    sys.exit(int(wrong > 0))


if __name__ == "__main__":
    main()
