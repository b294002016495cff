"""What owners of a simulation do to vehicles under an attached gate, and what the gate does then."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import libsumo
import pandas as pd
import pytest

import loopgate
from loopgate.errors import ScenarioError, TrafficError
from loopgate.replay import make_replay
from loopgate.report.page import write_report
from loopgate.runs.results import read_results
from loopgate.runs.run import read_run
from loopgate.simulation.attaching.joining_queue import JoiningQueue
from loopgate.simulation.attaching.plan import Plan

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
IDS = tuple(f"v{number}" for number in range(12))
CLEAN = "trespasses", "overruns", "strays", "collisions", "mended"
get = libsumo.vehicle


@pytest.fixture
def gate() -> Iterator[loopgate.Attached]:
    """Twelve vehicles under a gate on the grid; when it is left nobody is held."""
    networks, routes = ROOT / "networks", ROOT / "routes" / "grid5.rou.xml"
    network = networks / "grid5-priority.net.xml"
    words = "--no-step-log", "--no-warnings", "--seed", "1", "--collision.check-junctions"
    libsumo.start(["sumo", "-n", str(network), "-r", str(routes), *words])
    for number, vehicle in enumerate(IDS):
        get.add(vehicle, f"loop{number}")
    with loopgate.attach(libsumo) as gate:
        gate.add(*IDS)
        steps(gate, 30)
        yield gate
    if libsumo.isLoaded():
        assert not [vehicle for vehicle in get.getIDList() if get.isStopped(vehicle)]
        libsumo.close()


def steps(gate: loopgate.Attached, count: int) -> set[tuple[str, str, str]]:
    """Make steps; return event, vehicle and reason of what happened."""
    happened = set()
    for _ in range(count):
        libsumo.simulationStep()
        happened |= {(str(row.event), row.vehicle, row.reason) for row in gate.after_step()}
    return happened


def figures(gate: loopgate.Attached) -> list[int]:
    """Return what is zero where the gate and its vehicles did as they should."""
    return [gate.summary[name] for name in CLEAN]


def on_a_street(gate: loopgate.Attached) -> str:
    """Return a vehicle that is in no junction."""
    return next(vehicle for vehicle in gate.vehicles if not get.getRoadID(vehicle).startswith(":"))


def test_a_street_that_is_closed_and_opened(gate: loopgate.Attached) -> None:
    """Who has it on its way keeps the route that it has; afterwards routes are renewed as before."""
    lane = ""
    while not lane:
        steps(gate, 1)
        for number, vehicle in enumerate(IDS):
            route, at = get.getRoute(vehicle), get.getRouteIndex(vehicle)
            if route[at + 1 : at + 2] == libsumo.route.getEdges(f"round@loop{number}")[:1]:
                lane = f"{route[at]}_0"  # its route is renewed on the next edge
                break
    steps(gate, 1)
    libsumo.lane.setDisallowed(lane, ["passenger"])
    for _ in range(40):
        steps(gate, 1)
        if gate.summary["without_way"]:
            break
    assert gate.summary["without_way"]
    libsumo.lane.setDisallowed(lane, [])
    steps(gate, 12)
    assert gate.summary["without_way"] == []
    laps = gate.summary["laps"]
    steps(gate, 150)
    assert gate.summary["laps"] > laps
    assert figures(gate) == [0] * len(CLEAN)
    assert set(gate.vehicles) == set(IDS)


def test_who_is_put_into_a_junction_gives_back_what_it_holds(gate: loopgate.Attached) -> None:
    """It is where no grant has let it: its owner's doing, and no trespass of the gate's."""
    vehicle = on_a_street(gate)
    get.moveToXY(vehicle, "", 0, *libsumo.junction.getPosition("C2"), keepRoute=1)
    assert ("end", vehicle, "moved") in steps(gate, 3)
    assert figures(gate) == [0] * len(CLEAN)


@pytest.mark.parametrize("stands", [True, False])
def test_who_is_put_a_little_ahead_has_not_driven_there(gate: loopgate.Attached, *, stands: bool) -> None:
    """SUMO's odometer counts what `moveToXY` does: from its line into the junction is no trespass."""
    vehicle = ""
    while not vehicle:
        steps(gate, 1)
        some = [v for v in gate.vehicles if not get.getRoadID(v).startswith(":")]
        held = [v for v in some if get.isStopped(v)] if stands else some
        far = [v for v in held if stands or 20.0 < get.getLanePosition(v) < 40.0 < 5.0 * get.getSpeed(v)]
        vehicle = next(iter(far), "")
    junction = libsumo.edge.getToJunction(get.getRoadID(vehicle))
    get.moveToXY(vehicle, "", 0, *libsumo.junction.getPosition(junction), keepRoute=1)
    assert ("end", vehicle, "moved") in steps(gate, 2)
    assert figures(gate)[:2] == [0, 0]


@pytest.mark.parametrize("brakes", [False, True])
def test_who_is_on_a_lane_that_is_closed_stands_before_its_line(
    gate: loopgate.Attached, *, brakes: bool
) -> None:
    """SUMO takes no stop there; told to drive while it brakes or stands, a vehicle waits for its grant."""
    lanes = [lane for lane in map(get.getLaneID, gate.vehicles) if not lane.startswith(":")]
    for lane in lanes:
        libsumo.lane.setDisallowed(lane, ["passenger"])
    gate.block("C2C1")  # for ways round that all grants are withheld
    refused: set[str] = set()
    for _ in range(10):
        fresh = {vehicle for event, vehicle, _ in steps(gate, 1) if event == "refuse"} - refused
        for vehicle in fresh if brakes else gate.vehicles:
            if brakes or get.getSpeed(vehicle) == 0.0:
                get.setSpeed(vehicle, -1.0)
        refused |= fresh
    assert refused
    assert figures(gate) == [0] * len(CLEAN)


def test_others_know_how_hard_a_vehicle_brakes(gate: loopgate.Attached) -> None:
    """SUMO's `setDecel` leaves what others reckon with as it was: one that follows closely would hit it."""
    vehicle = on_a_street(gate)
    get.setDecel(vehicle, 6.0)
    steps(gate, 1)
    assert get.getApparentDecel(vehicle) == get.getDecel(vehicle) == 6.0
    get.setDecel(vehicle, 2.5)
    steps(gate, 1)
    assert get.getApparentDecel(vehicle) >= get.getDecel(vehicle) == 2.5


def test_who_is_led_elsewhere_comes_back_or_is_taken_for_moved(gate: loopgate.Attached) -> None:
    """The gate renews the routes of its vehicles; one that drives off its loop has left it."""
    first, second, third = gate.vehicles[:3]
    get.changeTarget(first, "E3E4")
    way = get.getRoute(second)[get.getRouteIndex(second) :]
    get.setRoute(second, way[:3])
    get.remove(third)
    happened = steps(gate, 60)
    assert ("end", third, "gone") in happened
    assert figures(gate) == [0] * len(CLEAN)


@pytest.mark.parametrize(
    "sets",
    [
        lambda vehicle: get.setMinGap(vehicle, 1.0),
        lambda vehicle: get.setTau(vehicle, 3.0),
        lambda vehicle: get.setLength(vehicle, 3.0),
        lambda vehicle: get.setMaxSpeed(vehicle, 3.0),
    ],
)
def test_setters_that_a_gate_can_work_with(gate: loopgate.Attached, sets: Callable[[str], None]) -> None:
    """Shorter vehicles and gaps, and slower drivers, need no more than there is."""
    sets(on_a_street(gate))
    steps(gate, 40)
    assert figures(gate) == [0] * len(CLEAN)


@pytest.mark.parametrize(
    ("sets", "says"),
    [
        (lambda vehicle: get.setLength(vehicle, 12.0), "its length was 5 m"),
        (lambda vehicle: get.setMinGap(vehicle, 6.0), "its minGap was 2.5 m .* and is 6 m; let it leave"),
        (lambda vehicle: get.setTau(vehicle, 0.3), "tau 0.3 is below the step"),
        (lambda vehicle: get.setVehicleClass(vehicle, "bus"), "its class was passenger .* and is bus"),
        (lambda vehicle: get.setActionStepLength(vehicle, 5.0), "actionStepLength 5 is above the step"),
    ],
)
def test_setters_that_no_gate_can_count_on(
    gate: loopgate.Attached, sets: Callable[[str], None], says: str
) -> None:
    """Refused by name; the others go on when that vehicle has left."""
    vehicle = on_a_street(gate)
    sets(vehicle)
    libsumo.simulationStep()
    with pytest.raises(TrafficError, match=f"vehicle {vehicle}: .*{says}"):
        gate.after_step()
    gate.leave(vehicle)
    steps(gate, 20)
    assert figures(gate) == [0] * len(CLEAN)


def test_one_that_stands_in_a_junction_for_its_owner(gate: loopgate.Attached) -> None:
    """Nobody is let into what it is in the way of, and all go on when it does."""
    inside: list[str] = []
    while not inside:
        steps(gate, 1)
        inside = [vehicle for vehicle in gate.vehicles if get.getRoadID(vehicle).startswith(":")]
    get.setSpeed(inside[0], 0.0)
    steps(gate, 60)
    assert get.getRoadID(inside[0]).startswith(":")
    get.setSpeed(inside[0], -1.0)
    steps(gate, 60)
    assert figures(gate) == [0] * len(CLEAN)
    assert not get.getRoadID(inside[0]).startswith(":") or get.getSpeed(inside[0]) > 0.0


def test_a_simulation_that_is_closed_or_goes_back_in_time(gate: loopgate.Attached, tmp_path: Path) -> None:
    """What is over raises in one line, and is left as any other."""
    state = str(tmp_path / "s.xml")
    libsumo.simulation.saveState(state)
    steps(gate, 30)
    libsumo.simulation.loadState(state)
    with pytest.raises(TrafficError, match="the clock went back"):
        steps(gate, 1)
    libsumo.close()
    with pytest.raises(TrafficError):
        gate.after_step()


@pytest.mark.parametrize("named", [False, True])
def test_vehicles_are_led_round_one_that_stands(gate: loopgate.Attached, *, named: bool) -> None:
    """Nobody is let in behind it, whether its owner names it or has set a long stop; then all go back."""
    routes, ahead = [set(get.getRoute(vehicle)) for vehicle in IDS], get.getRouteIndex("v1") + 2
    street = max(get.getRoute("v1")[ahead : ahead + 6], key=lambda edge: sum(edge in some for some in routes))
    get.setStop("v1", street, pos=50.0, duration=60.0 if named else 400.0)
    while not get.isStopped("v1") or get.getRoadID("v1") != street:
        steps(gate, 1)
    assert get.isStopped("v1")
    if named:
        get.setSpeed("v1", 0.0)
        gate.block("v1")
    steps(gate, 150)
    standing, driven_m = gate.summary["standing"], get.getDistance("v1")
    assert ("breakdown" if named else "stop", "v1") in {(o["why"], o["vehicle"]) for o in standing["blocked"]}
    assert standing["led_round"] > 0
    if named:
        get.setSpeed("v1", -1.0)
        gate.free("v1")
    else:
        get.resume("v1")
    steps(gate, 100)
    assert get.getDistance("v1") > driven_m + 100.0
    assert all(one["to_s"] for one in gate.summary["standing"]["blocked"])
    assert figures(gate) == [0] * len(CLEAN)


def test_vehicles_are_led_round_a_street_that_is_told_to_be_closed(gate: loopgate.Attached) -> None:
    """Lanes and edges by name; nobody drives there until it is free."""
    street = get.getRoute("v1")[get.getRouteIndex("v1") + 3]
    gate.block(street)
    steps(gate, 60)
    drove_there = False
    for _ in range(150):
        steps(gate, 1)
        drove_there |= street in {get.getRoadID(vehicle) for vehicle in gate.vehicles}
    assert not drove_there
    assert gate.summary["standing"]["led_round"] > 0
    gate.free(street)
    assert figures(gate) == [0] * len(CLEAN)


def test_ways_that_could_not_be_laid_are_laid_later(
    gate: loopgate.Attached, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Places cannot move while a vehicle stands across two of them; when it drives on, ways are laid."""
    asked, lay = [], JoiningQueue.lay

    def only_if_all_settle(queue: JoiningQueue, ways: Sequence[Any], *, all_settle: bool) -> bool:
        asked.append(all_settle)
        return all_settle and lay(queue, ways, all_settle=all_settle)

    monkeypatch.setattr(JoiningQueue, "lay", only_if_all_settle)
    street = get.getRoute("v2")[get.getRouteIndex("v2") + 4]
    while not get.getRoadID("v1").startswith(":"):
        steps(gate, 1)
    get.setSpeed("v1", 0.0)
    gate.block("v1", street)
    steps(gate, 20)
    assert asked == [False]
    gate.free("v1")
    get.setSpeed("v1", -1.0)
    steps(gate, 150)
    assert asked == [False, True]
    assert gate.summary["standing"]["led_round"] > 0


def test_a_vehicle_is_added_while_ways_are_laid_in_vain(
    gate: loopgate.Attached, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ways are given up after a minute, as a vehicle stands in a junction; its loop is not."""
    monkeypatch.setattr(Plan, "goes_on_with", lambda *_: False)
    street = get.getRoute("v2")[get.getRouteIndex("v2") + 4]
    while not get.getRoadID("v1").startswith(":"):
        steps(gate, 1)
    get.setSpeed("v1", 0.0)
    gate.block(street)
    steps(gate, 2)
    get.add("late", "loop20")
    gate.add("late")
    steps(gate, 80)
    get.setSpeed("v1", -1.0)
    steps(gate, 80)
    assert "late" in gate.vehicles
    assert figures(gate) == [0] * len(CLEAN)


def test_what_is_blocked_has_to_be_known(gate: loopgate.Attached) -> None:
    with pytest.raises(ScenarioError, match=r"C2C11: no vehicle under the gate.*did you mean 'C2C1'"):
        gate.block("v1", "C2C11")
    with pytest.raises(ScenarioError, match="v1: it is not blocked"):
        gate.free("v1")


def test_a_stop_of_the_owner_at_the_line_does_not_end_the_hold_there(gate: loopgate.Attached) -> None:
    """SUMO makes one stop of two so near to each other; the gate's stays, behind the owner's."""
    made = 0
    for _ in range(200):
        for vehicle in gate.vehicles:
            edge = get.getRoadID(vehicle)
            length_m = 0.0 if edge.startswith(":") else libsumo.lane.getLength(f"{edge}_0")
            mine = [stop for stop in get.getStops(vehicle) if stop.duration <= 3.0]
            if get.getLanePosition(vehicle) < length_m - 40.0 and not mine:
                get.setStop(vehicle, edge, length_m - 0.15 * (made % 5), 0, duration=3)
                made += 1
        steps(gate, 1)
    steps(gate, 20)
    assert made > 30
    assert figures(gate) == [0] * len(CLEAN)


def test_why_a_vehicle_waits(gate: loopgate.Attached) -> None:
    """In words, with the street that is closed, or the vehicle that stands; nothing for one that drives."""
    gate.block("C2C1", "v1")
    said = set()
    for _ in range(120):
        steps(gate, 1)
        said |= {gate.why(vehicle) for vehicle in gate.vehicles}
    assert "" in said
    assert any(words.startswith("another stands before it: v") for words in said)
    assert any(words.startswith("a vehicle stands there for long: v1 (breakdown)") for words in said)
    assert any(words.startswith("a conflicting movement has the crossing; it waits for v") for words in said)
    with pytest.raises(TrafficError, match="v99"):
        gate.why("v99")


def test_a_list_of_names_gets_the_way_out(gate: loopgate.Attached) -> None:
    """In one line, and nobody is added."""
    with pytest.raises(TrafficError, match=r"found \['v1'\]; of a list: gate\.add\(\*names\)"):
        gate.add(["v1"])  # type: ignore[arg-type]


def test_an_attached_gate_leaves_a_run_folder(tmp_path: Path) -> None:
    """Report and replay read it; figures are the gate's, positions SUMO's; it is not replaced."""
    network, folder = str(ROOT / "networks" / "grid5-priority.net.xml"), tmp_path / "run"
    words = ["--no-step-log", "--no-warnings", "--seed", "1"]
    libsumo.start(["sumo", "-n", network, "-r", str(ROOT / "routes" / "grid5.rou.xml"), *words])
    for number, vehicle in enumerate((*IDS, "car")):
        get.add(vehicle, f"loop{number}")
    there: dict[tuple[float, str], tuple[float, float]] = {}
    with loopgate.attach(libsumo, folder=folder) as gate:
        gate.add(*IDS)
        for _ in range(200):
            steps(gate, 1)
            there |= {
                (libsumo.simulation.getTime() - 1.0, one): get.getPosition(one) for one in get.getIDList()
            }
        gate.leave("v0")
    libsumo.close()
    made = read_run(folder)
    assert made.events.to_numpy().tolist() == gate.events.to_numpy().tolist()
    assert made.vehicles["vehicle"].tolist() == sorted(IDS)
    assert (
        made.summary["laps"]
        == gate.summary["laps"]
        == made.vehicles["laps"].sum()
        == made.flow["laps"].sum()
        > 5
    )
    assert made.summary["distance_km"] == pytest.approx(gate.summary["distance_km"], rel=0.05)
    assert made.summary["audit"] == "not audited"
    positions = pd.read_csv(folder / "positions.csv.gz", sep=";")
    told = {
        (time_s, vehicle): (x, y)
        for time_s, vehicle, x, y in positions[
            ["timestep_time", "vehicle_id", "vehicle_x", "vehicle_y"]
        ].itertuples(index=False)
    }
    assert told.keys() == there.keys()
    assert all(told[key] == pytest.approx(there[key], abs=0.01) for key in told)
    page = write_report(read_results(folder), tmp_path / "r.html").page.read_text("utf-8")
    assert "A script of its own steps the simulation" in page
    assert "audit clean" not in page
    assert make_replay(folder).write(tmp_path / "p.html").stat().st_size > 10_000
    libsumo.start(["sumo", "-n", network, *words])
    with (
        pytest.raises(ScenarioError, match="it holds the results of a run"),
        loopgate.attach(libsumo, folder=folder),
    ):
        pass
    libsumo.close()


def driven_in_block(folder: Path, wrong: type[BaseException] | None) -> None:
    """Drive for a minute, and end the block by an error, or close SUMO inside it."""
    with loopgate.attach(libsumo, folder=folder) as gate:
        gate.add(*IDS)
        steps(gate, 60)
        if wrong is not None:
            raise wrong
        libsumo.close()


@pytest.mark.parametrize("wrong", [None, KeyboardInterrupt, ZeroDivisionError])
def test_a_run_folder_is_left_however_the_block_ends(
    tmp_path: Path, wrong: type[BaseException] | None
) -> None:
    """SUMO closed inside it, Ctrl-C, an error of the script, which goes on as itself."""
    network, routes = ROOT / "networks" / "grid5-priority.net.xml", ROOT / "routes" / "grid5.rou.xml"
    libsumo.start(["sumo", "-n", str(network), "-r", str(routes), "--no-step-log", "--no-warnings"])
    for number, vehicle in enumerate(IDS):
        get.add(vehicle, f"loop{number}")
    if wrong is None:
        driven_in_block(tmp_path / "run", wrong)
    else:
        with pytest.raises(wrong):
            driven_in_block(tmp_path / "run", wrong)
        libsumo.close()
    made = read_run(tmp_path / "run")
    assert made.summary["distance_km"] > 1.0
    assert made.vehicles["vehicle"].tolist() == sorted(IDS)
