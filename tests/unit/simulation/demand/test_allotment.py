"""Who drives where, and in what: the scenario's words about its fleet."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from loopgate.errors import LoopgateError, ScenarioError
from loopgate.network import RoadNetwork, generate_loops
from loopgate.network.routes_text import routes_text
from loopgate.simulation.assembly import Assembly, assemble
from loopgate.simulation.scenario import Scenario, read_scenario

GRID = "networks/grid5-priority.net.xml"


@pytest.fixture
def routes(tmp_path: Path) -> str:
    """Four loops and two types."""
    loops = generate_loops(RoadNetwork.open(GRID), 4, length_m=(400.0, 2000.0))
    kinds = '<vType id="slow" maxSpeed="12"/><vType id="van" vClass="delivery"/>'
    file = tmp_path / "four.rou.xml"
    file.write_text(routes_text(loops).replace("<routes>", f"<routes>{kinds}"))
    return str(file)


def fleet(routes: str, **said: object) -> Assembly:
    """Put a run together."""
    return assemble(Scenario.from_dict({"network": GRID, "routes": routes, **said}))


def test_so_many_for_each_kilometre(routes: str) -> None:
    """As many as the length asks for, at least one, evenly round the loop."""
    made = fleet(routes, vehicles_per_km=4.0)
    numbers = Counter(start.loop.id for start in made.starts)
    assert numbers == {loop.id: max(1, round(loop.length_m / 250.0)) for loop in made.loops}
    for loop in made.loops:
        fronts = sorted(start.track.start_m for start in made.starts if start.loop.id == loop.id)
        gaps = [b - a for a, b in zip(fronts, [*fronts[1:], fronts[0] + loop.length_m], strict=True)]
        assert max(gaps) < 2.5 * loop.length_m / len(gaps)  # moved to where places have room


def test_so_many_on_each_of_some_loops(routes: str, tmp_path: Path) -> None:
    """As words, and as a table of a scenario file; a loop that is not named has none."""
    made = fleet(routes, on_loops="loop2=3, loop0=1")
    assert Counter(start.loop.id for start in made.starts) == {"loop0": 1, "loop2": 3}
    file = tmp_path / "s.toml"
    file.write_text(f'network = "{GRID}"\nroutes = "{routes}"\non_loops = {{ loop2 = 3, loop0 = 1 }}\n')
    assert read_scenario(file).on_loops == "loop2=3,loop0=1"
    with pytest.raises(ScenarioError, match=r"there is no loop nix in .*; there are loop0, loop1"):
        fleet(routes, on_loops="nix=3")


def test_types_take_turns_by_their_shares(routes: str) -> None:
    """Types of the file and classes of SUMO; every loop gets some of each."""
    made = fleet(routes, vehicles=12, types="slow=1,bus=0.5,van=1.5")
    assert Counter(start.type.id for start in made.starts) == {"slow": 4, "bus": 2, "van": 6}
    assert len({start.type.id for start in made.starts[:4]}) == 3
    assert {start.type.length_m for start in made.starts if start.type.id == "bus"} == {12.0}
    with pytest.raises(LoopgateError, match="types: vehicle class 'lorry'"):
        fleet(routes, vehicles=3, types="lorry=1")


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"vehicles": 3, "vehicles_per_km": 1}, "give one"),
        ({"on_loops": "loop0=0"}, "expected names with whole numbers above 0"),
        ({"on_loops": "loop0=1.5"}, "expected names with whole numbers above 0"),
        ({"on_loops": "loop0=1,loop0=2"}, "expected names"),
        ({"types": "bus"}, "expected names with numbers above 0"),
        ({"types": {"bus": "many"}}, "expected names with numbers above 0"),
        ({"types": "bus=nan"}, "expected names with numbers above 0"),
    ],
)
def test_what_makes_no_sense_is_refused(said: dict[str, object], words: str) -> None:
    """In one line that names the key."""
    with pytest.raises(ScenarioError, match=words) as error:
        Scenario.from_dict({"network": GRID, **said})
    assert str(next(reversed(said))) in str(error.value)
