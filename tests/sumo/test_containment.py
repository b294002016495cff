"""What stands is contained: vehicles are led round it, and everybody else goes on."""

from __future__ import annotations

import gzip
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import pytest

from loopgate import Scenario, read_results
from loopgate.analysis.rows import read_run_row
from loopgate.cli.run import exit_code
from loopgate.replay.scene import load_scene
from loopgate.replay.tracks import PER_M
from loopgate.report.page import write_report
from loopgate.results.columns import Event
from loopgate.results.figures import summary_rows
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
NETWORK = str(ROOT / "networks/grid5-priority.net.xml")
ROUTES = str(ROOT / "routes/grid5.rou.xml")


def ran(folder: Path, incidents: str = "", *, positions: bool = False, **more: Any) -> dict[str, Any]:  # noqa: ANN401  fields of a scenario
    """Run 120 vehicles on the grid for seven and a half minutes, with these incidents."""
    folder.mkdir(exist_ok=True)
    file = folder / "incidents.toml"
    file.write_text(incidents, encoding="utf-8")
    named: dict[str, Any] = {"incidents": str(file)} if incidents else {}
    named = {"duration_s": 450.0, **named, **more}
    named = {"vehicles": 120, "routes": ROUTES, **named}
    scenario = Scenario(network=NETWORK, positions=positions, **named)
    return simulate(scenario, folder / "run", overwrite=True)


@pytest.fixture(scope="module")
def round_street(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Return the folder and the summary of a run in which vehicles are led round one street and back."""
    folder = tmp_path_factory.mktemp("round")
    summary = ran(folder, '[[closures]]\nedge = "C2C1"\nfrom = 100\nto = 400\n')
    return folder / "run", summary


BROKEN = '[[breakdowns]]\nvehicle = "v1"\nfrom = 145\n'
CLOSED = (
    '[[closures]]\nedge = "C2C1"\nfrom = 50\nto = 200\n[[closures]]\nlane = "B2C2_0"\nfrom = 225\nto = 350\n'
)


@pytest.fixture(scope="module")
def free(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the same run in which nothing happens."""
    return ran(tmp_path_factory.mktemp("free"))


def test_everybody_else_goes_on_when_a_vehicle_breaks_down(tmp_path: Path, free: dict[str, Any]) -> None:
    """They drive as far as without it; where they wait for it they do not."""
    summary = ran(tmp_path, BROKEN, positions=True)
    assert summary["clean"]
    assert summary["distance_km"] > 0.93 * free["distance_km"]
    assert {one["why"] for one in summary["standing"]["blocked"]} == {"breakdown"}
    assert "(breakdown) from" in dict(summary_rows(summary))["blocked"]
    assert "blocked" not in dict(summary_rows(free))
    assert summary["standing"]["blocked"][0]["vehicle"] == "v1"
    assert summary["standing"]["led_round"] > 5
    victims = {vehicle for sink in summary["starving"] for vehicle in sink["vehicles"]}
    assert len(victims) <= 7
    waiting = ran(tmp_path, BROKEN, standing="wait", starving_s=150.0)
    assert waiting["distance_km"] < 0.8 * free["distance_km"]
    assert (waiting["outcome"], exit_code(waiting)) == ("starving", 5)


def test_nobody_drives_onto_what_is_closed(tmp_path: Path, free: dict[str, Any]) -> None:
    """Nor waits for it; afterwards they are back on their loops."""
    summary = ran(tmp_path, CLOSED, positions=True)
    assert summary["clean"]
    assert (summary["outcome"], summary["starving"]) == ("done", [])
    assert summary["distance_km"] > 0.93 * free["distance_km"]
    events = read_events(
        tmp_path / "run" / "events.parquet", (Event.ENTER, Event.GRANT, Event.BLOCK, Event.FREE)
    )
    granted = events[(events["event"] == "grant") & (events["place"] == "C2C1_0")]["time_s"]
    assert not ((granted > 50.0) & (granted < 200.0)).any()
    assert (granted > 200.0).any()
    happened = events[events["event"].isin(["block", "free"])]
    assert happened["time_s"].round().tolist() == [50.0, 200.0, 225.0, 350.0]
    assert happened["reason"].tolist() == ["closed"] * 4


def test_the_same_seed_gives_the_same_run(tmp_path: Path) -> None:
    """Turns of vehicles too."""
    one, other = (ran(tmp_path, BROKEN + CLOSED, duration_s=240.0) for _ in range(2))
    assert one["standing"]["turns"] > 20
    assert (one["distance_km"], one["standing"]) == (other["distance_km"], other["standing"])


@pytest.mark.parametrize(
    ("count", "duration_s"), [(6, 450.0), pytest.param(60, 900.0, marks=pytest.mark.slow)]
)
def test_breakdowns_at_any_time_end_in_no_lock_and_no_collision(
    tmp_path: Path, count: int, duration_s: float
) -> None:
    """Wherever vehicles stand when they break down, in the middle of junctions too."""
    draw = Random(7)
    each = []
    for _ in range(count):
        at_s, for_s = draw.uniform(60.0, duration_s - 100.0), draw.choice((20.0, 45.0, 90.0, 250.0))
        vehicle = f"v{draw.randrange(1, 120)}"
        each.append(f'[[breakdowns]]\nvehicle = "{vehicle}"\nfrom = {at_s:.0f}\nto = {at_s + for_s:.0f}\n')
    summary = ran(tmp_path, "".join(each), positions=count > 6, duration_s=duration_s)
    assert summary["clean"]
    assert (summary["outcome"], summary["deadlocks"], summary["starving"]) == ("done", [], [])
    assert any(one["place"] != other["place"] for one, other in pairwise(summary["standing"]["blocked"]))


LOOP = (
    '<routes><route id="a" edges="B2C2 C2C1 C1B1 B1B2"><stop lane="C2C1_0" endPos="40" duration="5"/></route>'
    '<vehicle id="x" route="a" depart="0"/><vehicle id="y" route="a" depart="0"/></routes>'
)


@pytest.mark.parametrize(
    ("incident", "reason"),
    [('closures]]\nedge = "C2C1"', "closed"), ('breakdowns]]\nvehicle = "x"', "blocked")],
)
def test_the_reason_says_what_is_closed_or_who_stands(incident: str, reason: str, tmp_path: Path) -> None:
    """A vehicle that must stop on the street cannot be led round it; its wait is booked under that."""
    (tmp_path / "incidents.toml").write_text(f"[[{incident}\nfrom = 45\nto = 400\n", encoding="utf-8")
    (tmp_path / "loop.rou.xml").write_text(LOOP, encoding="utf-8")
    files: dict[str, Any] = {"routes": str(tmp_path / "loop.rou.xml"), "duration_s": 600.0}
    scenario = Scenario(network=NETWORK, incidents=str(tmp_path / "incidents.toml"), **files)
    summary = simulate(scenario, tmp_path / "run")
    assert (summary["outcome"], summary["deadlocks"], summary["audit"]) == ("done", [], "clean")
    assert summary["refusals"] == {reason: 1}
    assert summary["longest_waits_s"][reason] > 300.0
    assert {one["until_s"] for one in summary["standing"]["blocked"]} >= {400.0}


def test_the_replay_draws_vehicles_where_they_are_after_a_detour(
    round_street: tuple[Path, dict[str, Any]],
) -> None:
    """And crossings as taken only as long as they are."""
    run, _ = round_street
    scene = load_scene(run)
    assert max(span.end - span.begin for span in scene.happenings.passages) < 60
    ends = pd.read_parquet(run / "vehicles.parquet").set_index("vehicle")
    tracks = scene.tracks
    for vehicle, spans in tracks.rows_of().items():
        _, rows = spans[-1]
        there = ends.loc[tracks.vehicles[vehicle]]
        assert tracks.x[rows][-1] / PER_M == pytest.approx(there["x_m"], abs=0.2)
        assert tracks.y[rows][-1] / PER_M == pytest.approx(there["y_m"], abs=0.2)


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_vehicles_with_stops_are_led_round_too(gate: str, tmp_path: Path) -> None:
    """They make all their stops, as SUMO counts them, on the road and beside it."""
    lines = ["<routes>"]
    for number, route in enumerate(ET.parse(ROUTES).getroot().iter("route")):
        edges = route.get("edges", "").split()
        edge = next(one for one in edges[len(edges) // 2 :] if one != "C2C1")
        where = f'lane="{edge}_0" startPos="30" endPos="40" parking="{str(number % 3 == 0).lower()}"'
        stop = f'<stop {where} duration="5"/>'
        lines.append(f'<route id="{route.get("id")}" edges="{" ".join(edges)}">{stop}</route>')
    file = tmp_path / "stops.rou.xml"
    file.write_text("\n".join([*lines, "</routes>"]), encoding="utf-8")
    words = f"--stop-output {tmp_path / 'stops.xml'}"
    more: dict[str, Any] = {"routes": str(file), "sumo": words, "vehicles": 60, "duration_s": 600.0}
    summary = ran(tmp_path, '[[closures]]\nedge = "C2C1"\nfrom = 100\nto = 400\n', gate=gate, **more)
    told = [one for one in ET.parse(tmp_path / "stops.xml").getroot() if float(one.get("pos", "")) < 45.0]
    times = sum(float(one.get("ended", "")) - float(one.get("started", "")) for one in told)
    assert summary["standing"]["led_round"] > 5
    assert summary["stops"]["missed"] == 0
    assert (summary["stops"]["served"], summary["stops"]["stopped_s"]) == (len(told), times)
    assert gate == "open" or (summary["audit"], summary["collisions"]) == ("clean", 0)


@pytest.mark.slow
def test_a_report_tells_of_closures_and_breakdowns(tmp_path: Path) -> None:
    """In the paragraph for a paper, in the table of runs, on the map, and in what must not happen."""
    for seed in (1, 2):
        ran(tmp_path, f"{BROKEN}{CLOSED}", duration_s=500.0, seed=seed)
        (tmp_path / "runs").mkdir(exist_ok=True)
        (tmp_path / "run").rename(tmp_path / "runs" / f"{seed}")
    for folder in (tmp_path / "runs" / "1", tmp_path / "runs"):
        page = write_report(read_results(folder), tmp_path / f"{folder.name}.html").page.read_text("utf-8")
        assert "Incidents in a run: closed edges 2, breakdowns 1, vehicles led round them" in page
        assert "2 closed edges and 1 breakdown" in page  # of each series
        assert "Dashed: closed or blocked for a time." in page
    assert read_run_row(tmp_path / "runs" / "1").row["closures"] == 2


def test_roads_that_rerouters_close_are_closures(tmp_path: Path) -> None:
    """SUMO's own way to close a road: the same run, and no vehicle is led round by SUMO itself."""
    beside = tmp_path / "closed.add.xml"
    beside.write_text(
        '<additional><rerouter id="r" edges="B2C2 C3C2 D2C2"><interval begin="100" end="400">'
        '<closingReroute id="C2C1"/></interval></rerouter></additional>'
    )
    closed = '[[closures]]\nedge = "C2C1"\nfrom = 100\nto = 400\n'
    one = ran(tmp_path / "one", vehicles=60, duration_s=500.0, stops=str(beside))
    other = ran(tmp_path / "other", closed, vehicles=60, duration_s=500.0)
    assert one["standing"]["led_round"] > 3
    assert (one["distance_km"], one["standing"]) == (other["distance_km"], other["standing"])
    assert (one["audit"], one["collisions"]) == ("clean", 0)


def test_lanes_that_rerouters_close_open_again(tmp_path: Path) -> None:
    """Vehicles are led round and back, past edges that they drove before: SUMO looks at these too."""
    beside = tmp_path / "closed.add.xml"
    beside.write_text(
        '<additional><rerouter id="r" edges="B2C2 C3C2 D2C2"><interval begin="100" end="250">'
        '<closingLaneReroute id="C2C1_0"/></interval></rerouter></additional>'
    )
    summary = ran(tmp_path / "one", vehicles=60, duration_s=400.0, stops=str(beside))
    (blocked,) = summary["standing"]["blocked"]
    assert (blocked["place"], blocked["from_s"], blocked["to_s"]) == ("C2C1_0", 100.0, 251.0)
    assert summary["standing"]["led_round"] > 3
    assert (summary["audit"], summary["collisions"]) == ("clean", 0)


def test_without_a_gate_streets_close_too(tmp_path: Path) -> None:
    """For a baseline: nobody drives in, and the trace has the edges that were driven."""
    summary = ran(tmp_path, CLOSED, gate="open", vehicles=30, outputs="fcd")
    assert summary["standing"]["closures"] == 2
    assert [one["place"] for one in summary["standing"]["blocked"]] == ["C2C1", "B2C2_0"]
    assert summary["standing"]["led_round"] > 5
    events = read_events(tmp_path / "run" / "events.parquet", (Event.EDGE,))
    driven: dict[str, list[str]] = {}
    with gzip.open(tmp_path / "run" / "fcd.xml.gz") as fcd:
        for _, step in ET.iterparse(fcd):
            for one in step if step.tag == "timestep" else ():
                edge, mine = one.get("lane", "").rpartition("_")[0], driven.setdefault(one.get("id", ""), [])
                if not edge.startswith(":") and mine[-1:] != [edge]:
                    mine.append(edge)
                    assert edge != "C2C1" or not 51.0 < float(step.get("time", "0")) < 200.0
    for vehicle, rows in events.groupby("vehicle"):
        edges = rows["place"].tolist()
        assert edges == driven[str(vehicle)][: len(edges)]
        assert len(driven[str(vehicle)]) - len(edges) <= 1


def test_a_round_on_a_detour_is_a_lap(round_street: tuple[Path, dict[str, Any]]) -> None:
    """A lap ends where it began, also if the vehicle was led round a street on its way there."""
    run, summary = round_street
    assert summary["standing"]["turns"] > 30
    events = read_events(run / "events.parquet", (Event.EDGE, Event.LAP))
    laps = events[events["event"] == Event.LAP].groupby("vehicle").size()
    edges = events[events["event"] == Event.EDGE].groupby("vehicle")["place"]
    rounds = edges.agg(lambda passed: (passed == passed.iloc[0]).sum() - 1)
    begins = edges.first()
    loops = pd.read_parquet(run / "loops.parquet").groupby("loop")["edge"].agg(list)
    vehicles = pd.read_parquet(run / "vehicles.parquet").set_index("vehicle")
    once = [
        v for v in rounds.index if loops[vehicles["loop"][v]].count(begins[v]) == 1 and begins[v] != "C2C1"
    ]
    off = laps.reindex(once, fill_value=0) - rounds[once]
    assert len(once) > 60
    assert off.abs().max() <= 1
    assert -15 <= off.sum() <= 0  # the last round of some is not complete
