"""Vehicle types that do not drive as SUMO's cars do, under the gate and on the road."""

from __future__ import annotations

import gzip
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from loopgate.network import RoadNetwork, write_loops
from loopgate.simulation import assembly
from loopgate.simulation.assembly import assemble
from loopgate.simulation.demand.allotment import random_loops
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

SLOW = 'maxSpeed="3"'
UNTOLD = 'desiredMaxSpeed="3"'
KINDS = {
    "slow": SLOW,
    "slow drivers": 'speedFactor="0.4" speedDev="0"',
    "dawdling": 'accel="6" sigma="0.9"',
    "motorcycle": 'vClass="motorcycle"',
    "bus": 'vClass="bus" length="18"',
}
GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")


def driven(folder: Path, attributes: str) -> Mapping[str, Any]:
    """Return the summary of 140 vehicles of a type on the grid, five minutes."""
    file = folder / "loops.rou.xml"
    write_loops(random_loops(Scenario(network=GRID), RoadNetwork.open(GRID), 40).loops, file)
    file.write_text(file.read_text().replace("<routes>", f'<routes><vType id="t" {attributes}/>'))
    return simulate(Scenario(network=GRID, routes=str(file), vehicles=140, duration_s=300.0, positions=True))


@pytest.mark.parametrize("kind", KINDS)
def test_each_vehicle_is_foreseen_by_what_it_can(kind: str, tmp_path: Path) -> None:
    """Its length, acceleration, top speed, speed factor and dawdling are its own: bodies never touch."""
    summary = driven(tmp_path, KINDS[kind])
    assert not any("nothing is foreseen" in warning for warning in summary["warnings"])
    assert (summary["audit"], summary["collisions"], summary["trespasses"]) == ("clean", 0, 0)


def test_nothing_is_foreseen_of_who_wants_to_be_slow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run says so and is clean; if something is foreseen of them all the same, they meet on crossings."""
    summary = driven(tmp_path, UNTOLD)
    (warning,) = summary["warnings"]
    assert "nothing is foreseen" in warning
    assert (summary["audit"], summary["collisions"], summary["trespasses"]) == ("clean", 0, 0)
    monkeypatch.setattr(assembly, "unforeseen", lambda _network, _users, **_: {})
    foreseen = driven(tmp_path, UNTOLD)
    assert foreseen["warnings"] == []
    assert any("on the stretch that" in finding for finding in foreseen["audit"])


def test_nothing_is_foreseen_of_who_is_slow_and_departs_later(tmp_path: Path) -> None:
    """Its type decides, as it does for vehicles that are there from the beginning."""
    file = tmp_path / "loops.rou.xml"
    write_loops(random_loops(Scenario(network=GRID), RoadNetwork.open(GRID), 2).loops, file)
    later = "".join(f'<vehicle id="v{k}" type="t" route="loop{k}" depart="{60 * k}"/>' for k in range(2))
    words = file.read_text().replace("<routes>", f'<routes><vType id="t" {UNTOLD}/>')
    file.write_text(words.replace("</routes>", f"{later}</routes>"))
    assembled = assemble(Scenario(network=GRID, routes=str(file), duration_s=300.0))
    assert [track.foreseen for track in (*assembled.tracks, *assembled.later_tracks)] == [False, False]
    assert len(assembled.later_tracks) == 1


def test_on_a_loop_too_who_cannot_be_gated_is_ordinary(tmp_path: Path) -> None:
    """Its type is one that no gate can drive: SUMO drives it round, and the others stay under the gate."""
    file = tmp_path / "loops.rou.xml"
    lap = "B3B4 B4C4 C4D4 D4D3 D3C3 C3B3"
    named = {"a": ("car", 0), "b": ("wild", 0), "c": ("wild", 30)}
    vehicles = "".join(
        f'<vehicle id="{name}" type="{kind}" depart="{at}"><route edges="{lap}"/></vehicle>'
        for name, (kind, at) in named.items()
    )
    kinds = '<vType id="car"/><vType id="wild" carFollowModel="W99"/>'
    file.write_text(f"<routes>{kinds}{vehicles}</routes>")
    fcd = tmp_path / "out"
    summary = simulate(Scenario(network=GRID, routes=str(file), duration_s=400.0, outputs="fcd"), fcd)
    assert (summary["vehicles"], summary["audit"], summary["collisions"]) == (1, "clean", 0)
    (warning,) = summary["warnings"]
    assert "2 vehicles in ordinary traffic" in warning
    assert "vType wild: carFollowModel W99" in warning
    told = gzip.decompress((fcd / "fcd.xml.gz").read_bytes()).decode()
    for name in "bc":  # it drives more than a lap
        assert len(re.findall(rf'id="{name}" [^>]*lane="B3B4_0"', told[len(told) // 2 :])) > 0


@pytest.mark.parametrize("model", ["KraussOrig1", "Daniel1"])
def test_other_models_of_following(model: str, tmp_path: Path) -> None:
    """Those that drive as SUMO's own does."""
    summary = driven(tmp_path, f'carFollowModel="{model}"')
    assert (summary["warnings"], summary["audit"], summary["collisions"]) == ([], "clean", 0)
