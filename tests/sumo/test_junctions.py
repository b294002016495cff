"""Junctions and stops of a run, counted again from what SUMO wrote."""

from collections import Counter, defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pandas as pd
import pytest

from loopgate import RoadNetwork, Scenario, run
from loopgate.analysis import compute_wait_causes
from loopgate.analysis.junctions import level_of_service, queue_figures

GRID = "networks/grid5-priority.net.xml"


def free_s(network: RoadNetwork, edge: str, following: str) -> float:
    """Return the time over an edge and the junction behind it at the speed limits [s]."""
    turn = next(t for t in network.connections if (t.from_edge, t.to_edge) == (edge, following))
    lanes = [network.lanes[name] for name in (f"{edge}_{turn.from_lane}", *turn.via)]
    return sum(lane.length_m / lane.speed_mps for lane in lanes)


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_movements_are_those_of_the_positions(tmp_path: Path, gate: str) -> None:
    """Vehicles and delay are exact; the queue is the number of vehicles that stand."""
    made = run(
        Scenario(network=GRID, gate=gate, vehicles=60, duration_s=200, positions=True), tmp_path / "run"
    )
    positions = pd.read_csv(tmp_path / "run" / "positions.csv.gz", sep=";")
    network = RoadNetwork.open(GRID)
    crossed, stood = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    under_way = 0
    delays_s = defaultdict[tuple[str, str], list[float]](list)
    for _, way in positions.groupby("vehicle_id"):
        on, since_s, still = "", None, 0
        for time_s, lane, speed in way[["timestep_time", "vehicle_lane", "vehicle_speed"]].itertuples(
            index=False
        ):
            edge = lane.rpartition("_")[0]
            if not lane.startswith(":") and edge != on:
                if on:
                    crossed[on, edge] += 1
                    stood[on, edge] += still
                    if since_s is not None:
                        delays_s[on, edge].append(time_s - since_s - free_s(network, on, edge))
                    since_s = time_s
                on, still = edge, 0
            still += speed < 0.1
        under_way += still
    told = made.junctions.set_index(["edge", "to_edge"])
    assert {key: n for key, n in told["vehicles"].items() if n} == crossed
    means_s = {key: sum(some) / len(some) for key, some in delays_s.items()}
    assert told["delay_s"].dropna().to_dict() == pytest.approx(means_s)
    queues = (told["queue_mean"] * 200).to_dict()
    all_s = sum(stood.values()) + under_way
    assert sum(queues.values()) == pytest.approx(all_s, abs=60)  # nobody stands in the step of its departure
    if gate == "certified":
        waits = compute_wait_causes(events=made.events, begin_s=1.0, end_s=201.0)
        by_cause = waits[waits["cause"] != "stop"]["wait_s"].sum()
        assert by_cause > 0.0
        assert made.junctions.filter(like="waited_").sum().sum() == pytest.approx(by_cause)
        assert set(made.junctions["level_of_service"]) <= set("ABCDEF") | {""}


def test_stops_are_those_of_stop_output(tmp_path: Path) -> None:
    """Headways and lateness are those that SUMO's stop-output gives, to the second."""
    (tmp_path / "stops.add.xml").write_text(
        '<additional><busStop id="market" lane="B2C2_0" startPos="30" endPos="60"/></additional>'
    )
    (tmp_path / "bus.rou.xml").write_text(
        '<routes><route id="line" edges="B2C2 C2C1 C1B1 B1B2" cycleTime="90">'
        '<stop busStop="market" duration="20" until="40"/></route>'
        '<flow id="bus" route="line" begin="0" period="30" number="2"/></routes>'
    )
    (tmp_path / "bus.sumocfg").write_text(
        f'<configuration><input><net-file value="{Path(GRID).resolve()}"/><route-files value="bus.rou.xml"/>'
        '<additional-files value="stops.add.xml"/></input>'
        '<output><stop-output value="told.xml"/></output></configuration>'
    )
    made = run(Scenario(network=str(tmp_path / "bus.sumocfg"), duration_s=900), tmp_path / "run")
    told = next(tmp_path.rglob("told.xml"))
    rows = [one.attrib for one in ET.parse(told).getroot().iter("stopinfo")]
    came = sorted(float(row["started"]) for row in rows)
    late = sorted(float(row["delay"]) for row in rows)
    (stop,) = made.stops.to_dict("records")
    headways = [after - before for before, after in pairwise(came)]
    assert (stop["visits"], stop["timed"]) == (len(rows), len(rows))
    assert stop["headway_s"] == pytest.approx(sum(headways) / len(headways))
    assert (stop["longest_headway_s"], stop["worst_late_s"]) == (max(headways), late[-1])
    assert stop["within_60_s"] == pytest.approx(sum(one <= 60 for one in late) / len(late))


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_share_of_green_is_that_of_the_states(tmp_path: Path, gate: str) -> None:
    """Greens that have ended, counted from SUMO's own record of a light's states; two seconds a vehicle."""
    record = tmp_path / "states.xml"
    asks = f'<timedEvent type="SaveTLSStates" source="B2" dest="{record}"/>'
    (tmp_path / "a.add.xml").write_text(f"<additional>{asks}</additional>")
    net, beside = "networks/grid5-actuated.net.xml", str(tmp_path / "a.add.xml")
    scenario = Scenario(network=net, gate=gate, vehicles=60, duration_s=300, stops=beside)
    if gate == "certified":
        scenario = replace(scenario, lights="obey")
    made = run(scenario, tmp_path / "run")
    states = [one.get("state", "") for one in ET.parse(record).getroot().iter("tlsState")]
    links = {(t.from_edge, t.to_edge): t.signal for t in RoadNetwork.open(net).connections if t.signal}
    rows = made.junctions.query("junction == 'B2'").dropna(subset="green_used")
    assert len(rows) > 3
    for edge, to_edge, crossed, share in rows[["edge", "to_edge", "vehicles", "green_used"]].to_numpy():
        _, link = links[edge, to_edge]
        colours = "".join(state[link] for state in states[1:301]).lower()
        ended_s = colours.count("g") - (len(colours) - len(colours.rstrip("g")))
        assert crossed == 0 or 2 * crossed / share == pytest.approx(ended_s, abs=2)
    assert not [*(tmp_path / "run").glob("greens*")]


def test_queue_figures() -> None:
    """The quantile is the least length that holds for 95 % of the time."""
    assert queue_figures({}, 10) == (0.0, 0, 0)
    assert queue_figures({2: 4}, 100) == (0.08, 0, 2)
    assert queue_figures({2: 6}, 100) == (0.12, 2, 2)
    assert [level_of_service(s, lit=False) for s in (10.0, 10.1, 51.0)] == ["A", "B", "F"]


def test_greens_are_counted_in_a_folder_that_is_named_from_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SUMO takes the name of its file for one beside the file that asks for it."""
    scenario = Scenario(
        network=str(Path("networks/grid5-actuated.net.xml").resolve()),
        gate="certified",
        vehicles=20,
        duration_s=60,
        lights="obey",
    )
    monkeypatch.chdir(tmp_path)
    assert run(scenario, Path("out")).junctions["green_used"].notna().any()
