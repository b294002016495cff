"""A vehicle that stands for good is named, with the vehicles that starve behind it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from loopgate import Scenario
from loopgate.analysis import compute_starving
from loopgate.analysis.rows import read_run_row
from loopgate.cli.run import exit_code
from loopgate.results.figures import summary_rows
from loopgate.runs.run import read_run
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]


def made(folder: Path, *, stands: bool, standing: str = "wait") -> dict[str, object]:
    """Run the grid, one of whose vehicles stands in the middle of its loop, or does not."""
    text = (ROOT / "routes/grid5.rou.xml").read_text(encoding="utf-8")
    first = re.search(r'<route id="([^"]+)" edges="([^"]+)"', text)
    assert first is not None
    edge = first[2].split()[3]
    stop = f'<stop lane="{edge}_0" endPos="60" duration="100000"/>' if stands else ""
    flows = [
        f'<vehicle id="v{n}" route="{route}" depart="0"/>'
        for n, route in enumerate(re.findall(r'<route id="([^"]+)"', text) * 3)
    ]
    flows.append(f'<vehicle id="broken" route="{first[1]}" depart="0">{stop}</vehicle>')
    file = folder / "routes.rou.xml"
    body = re.sub(r"<(vehicle|flow|trip)\b.*?(/>|</\1>)", "", text, flags=re.DOTALL)
    file.write_text(body.replace("</routes>", "\n".join(flows) + "</routes>"), encoding="utf-8")
    network = str(ROOT / "networks/grid5-priority.net.xml")
    scenario = Scenario(network=network, routes=str(file), duration_s=1000.0, standing=standing)
    return simulate(scenario, folder / "run")


def test_a_vehicle_that_stands_for_good_is_named(tmp_path: Path) -> None:
    """Whoever is behind it starves; the run is not done, and says when its promise ceased to hold."""
    summary = made(tmp_path, stands=True)
    assert summary["outcome"] == "starving"
    assert exit_code(summary) == 5
    sinks = summary["starving"]
    assert isinstance(sinks, list)
    assert {(sink["behind"], sink["why"]) for sink in sinks} == {("broken", "stop")}
    assert len(sinks[0]["vehicles"]) > 1
    assert "broken" not in sinks[0]["vehicles"]
    assert 600.0 <= sinks[0]["noticed_s"] <= 1000.0
    assert any("broken stood on lane" in line for line in summary["warnings"])  # type: ignore[attr-defined]
    assert "broken" in dict(summary_rows(summary))["starving"]
    run = read_run(tmp_path / "run")
    told = run.events[run.events["event"] == "starve"]
    starved = compute_starving(summary=run.summary)
    assert set(told["vehicle"]) == set(starved["vehicle"]) == set(sinks[0]["vehicles"])
    assert set(told["reason"]) == set(starved["waits_for"]) == {"broken"}
    rows = read_run_row(tmp_path / "run").row
    assert rows["starving_vehicles"] == len(starved)


def test_nobody_starves_where_all_drive(tmp_path: Path) -> None:
    """The same vehicles, none of which stops."""
    summary = made(tmp_path, stands=False)
    assert (summary["outcome"], summary["starving"], exit_code(summary)) == ("done", [], 0)


def test_a_street_on_which_nobody_may_drive_any_more_is_named(tmp_path: Path) -> None:
    """Where everybody stands nobody is let go, and it is said why, too."""
    sign = tmp_path / "sign.add.xml"
    steps = '<step time="0" speed="0"/>'
    sign.write_text(
        f'<additional><variableSpeedSign id="sign" lanes="s1_0">{steps}</variableSpeedSign></additional>',
        encoding="utf-8",
    )
    scenario = Scenario(
        network=str(ROOT / "networks/ring3.net.xml"),
        routes=str(ROOT / "routes/ring3.rou.xml"),
        stops=str(sign),
        duration_s=400.0,
    )
    summary = simulate(scenario)  # it ends before ten minutes are over
    assert (summary["outcome"], summary["deadlocks"], exit_code(summary)) == ("starving", [], 5)
    assert {sink["lane"] for sink in summary["starving"]} == {"s1_0"}
