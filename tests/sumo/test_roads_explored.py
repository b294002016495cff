"""Small real networks, abstracted as a run does it: every configuration, under the certified gate."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
import sumo

from loopgate.abstraction.queue_layout import why_not
from loopgate.abstraction.queues import make_queues
from loopgate.gates import Gate, make_gate
from loopgate.model import System
from loopgate.network import RoadNetwork, VehicleType, generate_loops
from loopgate.research.state_space import StateSpace, verify_space

pytestmark = pytest.mark.sumo

MADE = {
    "grid": "--grid --grid.number=3 --grid.length=34",
    "blocks": "--grid --grid.x-number=3 --grid.y-number=2 --grid.length=34",
    "roundabout": "--spider --spider.arm-number=4 --spider.circle-number=2 --spider.space-radius=36 "
    "--spider.omit-center",
    "random": "--rand --rand.iterations=12 --rand.min-distance 32 --rand.max-distance 47 --seed 3",
}
_MOST_FOR_EVERYONE = 4_000
"""Beyond so many configurations the exact stage takes more than a few seconds."""

CASES = [
    # network, length of the vehicles [m], range of lengths of the loops [m], loops, vehicles
    ("grid", 6.9, (60, 160), 4, 8),
    ("grid", 7.0, (60, 260), 3, 6),
    ("blocks", 6.9, (60, 260), 2, 6),
    ("blocks", 8.0, (60, 600), 4, 5),
    ("roundabout", 8.0, (60, 260), 2, 8),
    ("random", 5.0, (60, 260), 2, 6),
    ("random", 8.0, (60, 260), 3, 6),
]


@pytest.fixture(scope="module")
def network_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], RoadNetwork]:
    """Return what makes a network, once, with SUMO's netgenerate."""
    folder = tmp_path_factory.mktemp("networks")

    @cache
    def make(name: str) -> RoadNetwork:
        tool = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
        command = [str(tool), *MADE[name].split(), "-o", str(folder / f"{name}.net.xml")]
        environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
        subprocess.run(command, check=True, capture_output=True, env=environment)
        return RoadNetwork.open(folder / f"{name}.net.xml")

    return make


@pytest.mark.parametrize(("name", "length_m", "loop_m", "loops", "vehicles"), CASES)
def test_every_configuration_is_safe(
    network_of: Callable[[str], RoadNetwork],
    name: str,
    length_m: float,
    loop_m: tuple[float, float],
    loops: int,
    vehicles: int,
) -> None:
    """Vehicles lock up where they may; under certified never, and it refuses no move that is safe."""
    network = network_of(name)
    kind = replace(VehicleType(), length_m=length_m)
    made = generate_loops(
        network,
        loops,
        length_m=loop_m,
        seed=2,
        u_turns=True,
        admits=lambda loop: not why_not(network, loop, kind),
    )
    driven = [made[k % loops] for k in range(vehicles)]
    system = make_queues(network, driven, [kind] * vehicles).system
    assert min(system.room) >= 2
    space = StateSpace(system, limit=25_000)
    assert space.live[0]
    assert space.locked.any()
    assert (space.somebody == ~space.locked).all()
    for promise in ("somebody", "everyone")[: 2 if space.count < _MOST_FOR_EVERYONE else 1]:

        def make(of: System, gate: str = f"certified:promise={promise}") -> Gate:
            return make_gate(gate, of)

        found = verify_space(space, make, promise=promise)
        assert found.holds
        assert found.decisions > found.safe
        assert (found.permissiveness, found.coverage) == (1.0, 1.0)
        assert (found.deadlocks, found.starving, found.budget_stops) == (0, 0, 0)
