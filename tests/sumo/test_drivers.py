"""Machines at the wheel: the same loops and trips, without the spread and the dawdling of human drivers."""

from __future__ import annotations

from pathlib import Path

import pytest

from loopgate import Scenario
from loopgate.errors import ScenarioError
from loopgate.simulation.run import simulate

GRID = "networks/grid5-priority.net.xml"


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_machines_drive_farther_than_humans(tmp_path: Path, gate: str) -> None:
    """With every gate, and the summary says who drove."""
    found = {
        drivers: simulate(
            Scenario(
                network=GRID, loops=12, vehicles=60, gate=gate, duration_s=400.0, step_s=0.5, drivers=drivers
            ),
            tmp_path / drivers,
        )
        for drivers in ("human", "machine")
    }
    assert found["machine"]["distance_km"] > 1.03 * found["human"]["distance_km"]
    assert [one["drivers"] for one in found.values()] == ["human", "machine"]
    assert found["machine"]["collisions"] == 0


def test_trips_of_a_type_of_the_file(tmp_path: Path) -> None:
    """The type is told by its own name; a type of an additional file drives so too, and without a gate."""
    more, routes = tmp_path / "types.add.xml", tmp_path / "trips.rou.xml"
    more.write_text('<additional><vType id="van" sigma="0.9" speedFactor="normc(0.95,0.1)"/></additional>')
    rows = [f'<trip id="t{k}" type="van" depart="{9 * k}" from="A0A1" to="E4D4"/>' for k in range(10)]
    routes.write_text(f"<routes>{''.join(rows)}</routes>")
    for gate in ("certified", "open"):
        given = Scenario(
            network=GRID, routes=str(routes), stops=str(more), gate=gate, duration_s=900.0, drivers="machine"
        )
        delays = simulate(given, tmp_path / gate)["mean_time_loss_s"]
        human = simulate(Scenario(**{**given.to_dict(), "drivers": "human"}), tmp_path / f"{gate}-human")
        assert delays < human["mean_time_loss_s"]
    simulate(Scenario(**{**given.to_dict(), "gate": "certified", "who": "van"}), tmp_path / "van")


def test_a_configuration_alone_is_refused(tmp_path: Path) -> None:
    """SUMO reads its vehicles; the way out is named."""
    file = tmp_path / "a.sumocfg"
    routes = tmp_path / "a.rou.xml"
    routes.write_text('<routes><trip id="t" depart="0" from="A0A1" to="E4D4"/></routes>')
    files = f'<net-file value="{Path(GRID).resolve()}"/><route-files value="{routes}"/>'
    file.write_text(f"<configuration><input>{files}</input></configuration>")
    with pytest.raises(ScenarioError, match="--routes"):
        simulate(Scenario(network=str(file), gate="open", drivers="machine"), tmp_path / "out")
