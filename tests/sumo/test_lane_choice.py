"""Trips choose lanes as they drive, in real simulations: nothing touches, and what is written is driven."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import pandas as pd
import pytest
from made_networks import netgenerate

from loopgate import Scenario
from loopgate.audit import read_layout
from loopgate.network import RoadNetwork
from loopgate.results.figures import summary_rows
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

TRIPS = 240


def crossroads(folder: Path, **trip: str) -> dict[str, Any]:
    """Write a grid of roads with two lanes and lights, and trips in bursts between few ends.

    `trip`: further attributes, each with one value or several for the trips in turn.
    """
    net = netgenerate(
        "--grid --grid.number=3 --grid.length=150 --grid.attach-length=150 -L 2 --no-turnarounds "
        "--default-junction-type traffic_light",
        folder / "n.net.xml",
    )
    rng, network = Random(3), RoadNetwork.open(net)
    into = sorted(e.id for e in network.edges.values() if e.id.startswith(("left", "top")))
    out = sorted(e.id for e in network.edges.values() if e.id[2:].startswith(("right", "bottom")))
    said = {name: values.split() for name, values in trip.items()}
    more = [
        "".join(f' {name}="{values[k % len(values)]}"' for name, values in said.items()) for k in range(TRIPS)
    ]
    rows = [
        f'<trip id="t{k}" depart="{60 * (k // 40) + rng.randrange(20)}" '
        f'from="{into[k % 3]}" to="{rng.choice(out)}"{more[k]}/>'
        for k in range(TRIPS)
    ]
    file = folder / "n.rou.xml"
    file.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    return {"network": str(net), "routes": str(file), "lights": "obey", "duration_s": 900.0}


def first_lanes(folder: Path) -> pd.Series[str]:
    rows = pd.read_csv(folder / "positions.csv.gz", sep=";").dropna(subset="vehicle_id")
    return rows.groupby("vehicle_id")["vehicle_lane"].first()


def test_they_depart_and_go_on_where_fewer_stand(tmp_path: Path) -> None:
    """Clean by positions; and table and layout have the lanes that were driven."""
    scenario = Scenario.from_dict({**crossroads(tmp_path), "positions": True})
    summary = simulate(scenario, tmp_path / "out")
    assert (summary["audit"], summary["clean"], summary["arrived"]) == ("clean", True, TRIPS)
    chosen = summary["lane_choice"]
    assert min(chosen["at_departure"], chosen["on_the_way"]) > 0
    assert f"anew {chosen['on_the_way']} times" in dict(summary_rows(summary))["lane choice"]
    events = pd.read_parquet(tmp_path / "out" / "events.parquet")
    assert (events["event"] == "reroute").sum() == chosen["on_the_way"]
    vehicles = pd.read_parquet(tmp_path / "out" / "vehicles.parquet").set_index("vehicle")["loop"]
    planned = {start.vehicle: start.loop.id for start in assemble(scenario).departures}
    assert sum(vehicles[name] != way for name, way in planned.items()) == chosen["at_departure"]
    first = first_lanes(tmp_path / "out")
    layout = read_layout(tmp_path / "out" / "layout.json")
    for name, body in layout.vehicles.items():
        assert layout.loops[body.loop].legs[body.leg].state.startswith(first[name])


def test_who_wants_a_lane_departs_on_it(tmp_path: Path) -> None:
    """It may choose lanes farther on."""
    scenario = Scenario.from_dict(crossroads(tmp_path, departLane="0 1"))
    assert simulate(scenario, tmp_path / "out")["lane_choice"]["on_the_way"] > 0
    ways = {start.loop.id: start.loop for start in assemble(scenario).departures}
    driven = pd.read_parquet(tmp_path / "out" / "vehicles.parquet").set_index("vehicle")["loop"]
    first = {name: ways[way].roads[0].lane_in for name, way in driven.items()}
    assert first == {f"t{k}": k % 2 for k in range(TRIPS)}


def test_a_lane_that_is_not_there_is_named(tmp_path: Path) -> None:
    warnings = assemble(Scenario.from_dict(crossroads(tmp_path, departLane="7"))).warnings
    assert (
        sum("240 vehicles on another lane than asked for, first t0: departLane 7" in w for w in warnings) == 1
    )
