"""What a run says of itself is what SUMO's own files say: counted again, by other means."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from recount import GRID, cases, recount
from sumolib import checkBinary

from loopgate import Scenario
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

NAMES = (
    "loops, gated",
    "loops, gated, incidents",
    "loops, truncated",
    "trips, gated",
    "trips, open",
    "trips, open, measured late",
)


CROWDED = {
    "loops, truncated": {"loops": 40, "vehicles": 240, "abstraction": "segments", "loops_seed": 2, "seed": 2}
}
"""They lock up after two minutes instead of ten."""


def differing(folder: Path, given: dict[str, Any]) -> list[str]:
    simulate(Scenario.from_dict(given), folder)
    found = recount(folder)
    assert len(found) >= 13
    return [str(one) for one in found if not one.agrees]


@pytest.mark.parametrize("name", NAMES)
def test_all_figures_are_those_counted_from_fcd_and_tripinfo(tmp_path: Path, name: str) -> None:
    """Distance, speed, standing, waits by reason, laps, deadlock and delay, by vehicle and in all."""
    given = cases(tmp_path, duration_s=450.0 if "trips" in name else 240.0)[name] | CROWDED.get(name, {})
    assert not differing(tmp_path / "run", given)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert bool(summary["deadlocks"]) == (name == "loops, truncated")


def test_trips_of_a_configuration_beside_others_in_half_steps_with_stops(tmp_path: Path) -> None:
    """Only its own trips count; a stop beside the road is time on it; nobody counts who has not departed."""
    rows = [
        f'<trip id="t{k}" depart="{3 * k}" from="A0A1" to="E4D4">'
        f'<stop edge="C0C1" endPos="60" duration="7" parking="{str(k % 2 == 0).lower()}"/></trip>'
        if k % 3 == 0
        else f'<trip id="t{k}" depart="{3 * k}" from="E0D0" to="A4A3"/>'
        for k in range(40)
    ]
    rows += [f'<trip id="late{k}" depart="100" from="E0D0" to="A4A3"/>' for k in range(40)]
    (tmp_path / "own.rou.xml").write_text(f"<routes>{''.join(rows)}</routes>")
    others = [f'<trip id="o{k}" depart="{5 * k}" from="A4B4" to="E0E1"/>' for k in range(20)]
    (tmp_path / "others.rou.xml").write_text(f"<routes>{''.join(others)}</routes>")
    config = tmp_path / "c.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{GRID}"/><step-length value="0.5"/><end value="150"/>'
        "</configuration>"
    )
    given: dict[str, Any] = {"network": str(config), "routes": str(tmp_path / "own.rou.xml"), "gate": "open"}
    given |= {"traffic": str(tmp_path / "others.rou.xml"), "outputs": "fcd", "sumo": "--precision 6"}
    assert not differing(tmp_path / "run", given)


def test_where_a_train_turns_round_only_what_it_drives_counts(tmp_path: Path) -> None:
    """SUMO's odometer leaps there by hundreds of metres, and nobody is faster than 14 m/s."""
    nodes = ((0, 0, "a"), (300, 0, "s"), (600, 0, "t"), (900, 0, "b"))
    rows = [f'<node id="{name}" x="{x}" y="{y}" type="priority"/>' for x, y, name in nodes]
    (tmp_path / "n.nod.xml").write_text(f"<nodes>{''.join(rows)}</nodes>")
    beside = ' shape="600,8 300,8"'
    ways = ("as", ""), ("sa", ""), ("st", ""), ("ts", beside), ("tb", ""), ("bt", "")
    rows = [
        f'<edge id="{way}" from="{way[0]}" to="{way[1]}" speed="14" allow="tram rail" '
        f'spreadType="center"{more}/>'
        for way, more in ways
    ]
    (tmp_path / "n.edg.xml").write_text(f"<edges>{''.join(rows)}</edges>")
    net = tmp_path / "n.net.xml"
    files = ("-n", str(tmp_path / "n.nod.xml"), "-e", str(tmp_path / "n.edg.xml"), "-o", str(net))
    subprocess.run([checkBinary("netconvert"), *files], check=True, capture_output=True)
    routes = tmp_path / "r.rou.xml"
    routes.write_text(
        '<routes><vType id="t" vClass="tram" length="30"/><route id="r" edges="as st tb bt ts sa"/>'
        '<vehicle id="x" type="t" route="r" depart="0"/></routes>'
    )
    given = {"network": str(net), "routes": str(routes), "gate": "open", "duration_s": 300.0}
    given |= {"outputs": "fcd", "sumo": "--precision 6"}
    # Where it turns early it drives less than the length of its loop, so laps cannot be told by distance.
    assert [one for one in differing(tmp_path / "run", given) if "name='laps'" not in one] == []
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert 5.0 < summary["mean_speed_mps"] <= 14.0
    assert [line for line in summary["warnings"] if "odometer leapt by" in line]
