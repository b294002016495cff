"""A gate over vehicles of a simulation that is somebody else's: they join, are interfered with, and leave."""

from __future__ import annotations

import importlib
import re
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import attached
import libsumo
import pytest

import loopgate
from loopgate.errors import LoopgateError, SecondSimulationError, TrafficError, UnsafeStartError
from loopgate.gates import Decision, Reason
from loopgate.gates.open import OpenGate
from loopgate.model import Configuration, System
from loopgate.negotiation.base import Request, View
from loopgate.results.recorder import Happening

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
GRID = ROOT / "networks" / "grid5-priority.net.xml"
OFTEN = {"leave": 43, "stop": 17, "slow": 13, "move": 51, "remove": 91}


def start(*options: str, routes: Path = ROOT / "routes" / "grid5.rou.xml", network: Path = GRID) -> None:
    """Start the grid with its loops as routes, and nobody on them."""
    files = ("-n", str(network), "-r", str(routes))
    program = str(Path(sys.prefix) / "bin" / "sumo")
    libsumo.start([program, *files, "--no-step-log", "--no-warnings", "--seed", "1", *options])


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Leave no simulation behind."""
    yield
    libsumo.close()


def put(*vehicles: str, route: str = "loop0", kind: str = "DEFAULT_VEHTYPE") -> None:
    """Let vehicles depart on a loop."""
    for vehicle in vehicles:
        libsumo.vehicle.add(vehicle, route, typeID=kind)


def drive(
    gate: loopgate.Attached, until: Callable[[], bool] | None = None, *, steps: int = 300
) -> list[Happening]:
    """Make steps until something is so; return what happened."""
    happened: list[Happening] = []
    for _ in range(steps):
        libsumo.simulationStep()
        happened += gate.after_step()
        if until is not None and until():
            return happened
    assert until is None, "it never came to that"
    return happened


@contextmanager
def under_gate(*vehicles: str) -> Iterator[loopgate.Attached]:
    """Start the grid, and take vehicles that depart on its first loop under a gate."""
    start()
    put(*vehicles)
    with loopgate.attach(libsumo) as gate:
        gate.add(*vehicles)
        drive(gate, lambda: len(gate.vehicles) == len(vehicles))
        yield gate


def of(happened: list[Happening], event: str) -> list[tuple[str, str]]:
    """Return vehicle and reason of the events of a kind."""
    return [(row.vehicle, row.reason) for row in happened if row.event == event]


@pytest.mark.slow
def test_among_ordinary_traffic_with_an_owner_who_interferes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten minutes of the study, with more interference; both ways to SUMO make the same of it."""
    monkeypatch.setattr(attached, "EVERY_S", OFTEN)
    found = [attached.run(backend, 1, 600) for backend in ("libsumo", "traci")]
    for summary in found:
        assert (summary["trespasses"], summary["overruns"], summary["collisions"]) == (0, 0, 0)
        assert summary["vehicles"] + summary["waiting"] == attached.ON_LOOPS
        assert summary["left"] > 30
        assert summary["laps"] > 5
        assert summary["others"]["vehicles"] > 100
    for name in ("distance_km", "left", "hold_s", "decisions", "refusals"):
        assert found[0][name] == found[1][name], name
    libsumo.start(["sumo", "-n", str(GRID), "--no-step-log"])  # for the fixture


@pytest.mark.parametrize(
    ("gate", "negotiation"),
    [("one-step", "oldest"), ("banker", "pressure"), ("certified:promise=somebody", "random")],
)
def test_other_gates_and_negotiations(gate: str, negotiation: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Five minutes of the study, with more interference: the gate is made anew for all that come and go."""
    monkeypatch.setattr(attached, "EVERY_S", OFTEN)
    summary = attached.run("libsumo", 1, 300, gate=gate, negotiation=negotiation)
    assert [
        summary[name] for name in ("trespasses", "overruns", "collisions", "errors", "misordered")
    ] == 5 * [0]
    assert (summary["gate"], summary["negotiation"]) == (gate, negotiation)
    assert summary["left"] > 10
    assert summary["distance_km"] > 3.0
    assert summary["decisions"] > 50
    libsumo.start(["sumo", "-n", str(GRID), "--no-step-log"])  # for the fixture


class Noting(OpenGate):
    """Lets `v2` move first, and notes what it is told."""

    made: ClassVar[list[Noting]] = []

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.system, self.where = system, system.initial
        self.made.append(self)

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Refuse `v1` until `v2` has moved since the gate was made."""
        assert configuration == self.where
        number = {str(one.id): at for at, one in enumerate(self.system.robots)}
        other = number.get("v2", robot)
        begun = configuration.positions[other] != self.system.initial.positions[other]
        if number.get("v1") == robot != other and not begun:
            return Decision(admitted=False, reason=Reason.DEADLOCK, blockers=(other,))
        return super().decide(configuration, robot)

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Note a move."""
        assert self.system.moved(self.where, robot) == configuration
        self.where = configuration


class Informed:
    """A negotiation that looks up vehicles and places in the system that it was told."""

    def __init__(self) -> None:
        self.systems: list[System] = []
        self.seen: set[tuple[str, str]] = set()

    def prepare(self, system: System) -> None:
        """Note the system."""
        self.systems.append(system)

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Note each request, and look at all places."""
        del now_s
        system = self.systems[-1]
        for request in requests:
            robot = system.robots[request.robot]
            assert {system.states[request.here], system.states[request.wanted]} <= set(robot.path)
            self.seen.add((str(robot.id), str(system.states[request.wanted])))
        held = [view.held(state) for state in range(len(system.states))]
        assert sum(held) >= len(requests)
        assert min(view.room(state) for state in range(len(system.states))) >= -1
        return requests


def test_a_gate_and_a_negotiation_of_the_users_know_whoever_has_joined() -> None:
    """Both are told anew when vehicles come and go, and each by the numbers of what it was told."""
    Noting.made.clear()
    orders = Informed()
    start()
    put("v1")
    with loopgate.attach(libsumo, gate=Noting, negotiation=orders) as gate:
        gate.add("v1")
        drive(gate, lambda: gate.vehicles == ("v1",))
        assert [robot.id for robot in Noting.made[-1].system.robots] == ["v1"]
        put("v2", "v3", route="loop4")
        gate.add("v2", "v3")
        drive(gate, lambda: len(gate.vehicles) == 3)
        drive(gate, steps=200)
        last = Noting.made[-1]
        assert {str(robot.id) for robot in last.system.robots} == {"v1", "v2", "v3"}
        assert last.where != last.system.initial
        made = len(Noting.made)
        gate.leave("v2")
        assert len(Noting.made) == made + 1
        assert {str(robot.id) for robot in Noting.made[-1].system.robots} == {"v1", "v3"}
        drive(gate, steps=100)
    assert {vehicle for vehicle, _ in orders.seen} == {"v1", "v2", "v3"}
    assert gate.summary["trespasses"] == 0
    assert gate.summary["laps"] >= 1


def test_they_join_while_they_drive_and_get_round() -> None:
    """Three have driven by themselves for a minute; nobody goes where it was not let."""
    start()
    put("v1", "v2", "v3")
    for _ in range(60):
        libsumo.simulationStep()
    with loopgate.attach(libsumo) as gate:
        gate.add("v1", "v2", "v3")
        put("w1", "w2", route="loop4")
        gate.add("w1", "w2")
        happened = drive(gate, lambda: len(gate.vehicles) == 5)
        assert {vehicle for vehicle, _ in of(happened, "start")} == {"v1", "v2", "v3", "w1", "w2"}
        drive(gate, steps=900)
    assert gate.summary["laps"] >= 10
    assert (gate.summary["trespasses"], gate.summary["overruns"], gate.summary["collisions"]) == (0, 0, 0)
    assert set(gate.events["event"]) >= {"start", "grant", "enter", "leave", "lap", "edge", "end"}
    assert len(gate.events[gate.events["event"] == "start"]) == len(
        gate.events[gate.events["event"] == "end"]
    )


def test_who_leaves_drives_on_as_before() -> None:
    """Its modes are as they were, its route ends where it did, and its place is free for others."""
    with under_gate("v1", "v2") as gate:
        assert libsumo.vehicle.getLaneChangeMode("v1") != 1621
        drive(gate, steps=50)
        gate.leave("v1")
        assert gate.vehicles == ("v2",)
        assert (libsumo.vehicle.getSpeedMode("v1"), libsumo.vehicle.getLaneChangeMode("v1")) == (31, 1621)
        assert libsumo.vehicle.getStops("v1") == ()
        assert libsumo.vehicle.getRoute("v1")[-1] == "C3B3"
        assert of(gate.after_step(), "end") == [("v1", "left")]
        drive(gate, lambda: "v1" not in libsumo.vehicle.getIDList(), steps=600)
        gate.leave("v2")
        gate.add("v2")
        drive(gate, lambda: gate.vehicles == ("v2",))
        with pytest.raises(LoopgateError, match="vehicle v1: it is not under the gate"):
            gate.leave("v1")


def test_who_is_moved_or_removed_gives_its_place_back() -> None:
    """A moved vehicle is taken in anew where it is; the odometer of SUMO cannot tell."""
    with under_gate("v1", "v2") as gate:
        libsumo.vehicle.moveTo("v1", "D1D0_0", 40.0)
        happened = drive(gate, lambda: len(gate.vehicles) == 2)
        assert of(happened, "end") == [("v1", "moved")]
        assert ("v1", "") in of(happened, "start")
        libsumo.vehicle.remove("v2")
        assert of(drive(gate, steps=2), "end") == [("v2", "gone")]
        assert set(gate.vehicles) == {"v1"}
        drive(gate, steps=400)
        libsumo.vehicle.remove("v1")
        drive(gate, steps=2)
        assert not gate.vehicles
        put("v3")
        gate.add("v3")
        drive(gate, lambda: gate.vehicles == ("v3",))
    assert (gate.summary["trespasses"], gate.summary["overruns"]) == (0, 0)
    assert gate.summary["laps"] >= 1


def test_while_it_stops_for_its_owner_it_keeps_nothing_from_others() -> None:
    """It is refused with the reason `stop` until its stop is over, which is not taken for a hold."""
    with under_gate("v1") as gate:
        # Near enough to the line that it asks while it stands there.
        libsumo.vehicle.setStop("v1", "C1D1", pos=85.0, duration=60.0)
        happened = drive(gate, lambda: libsumo.vehicle.isStopped("v1") and speed("v1") == 0.0)
        happened += drive(gate, steps=50)
        assert libsumo.vehicle.getRoadID("v1") == "C1D1"
        assert ("v1", "stop") in of(happened, "refuse")
        assert "hold" not in {row.event for row in happened}
        drive(gate, lambda: libsumo.vehicle.getRoadID("v1") == "D0C0")


def test_nobody_is_let_in_behind_one_that_stops_where_its_place_begins() -> None:
    """The place holds more, but there is no room behind: the next one would stand on the junction."""
    with under_gate("v1", "v2") as gate:
        libsumo.vehicle.setStop("v1", "C1D1", pos=8.0, duration=60.0)
        happened = drive(gate, lambda: libsumo.vehicle.isStopped("v1") and speed("v1") == 0.0)
        happened += drive(gate, steps=40)
        assert ("v2", "stop") in of(happened, "refuse")
        assert libsumo.vehicle.getRoadID("v2") == "C2C1"
        drive(gate, lambda: libsumo.vehicle.getRoadID("v2") == "C1D1")
        assert not libsumo.vehicle.isStopped("v1")
    assert (gate.summary["trespasses"], gate.summary["overruns"]) == (0, 0)


def test_a_stop_of_the_next_round_bars_nobody_now() -> None:
    """It lies just behind where the vehicle stands, which is still to drive on."""
    with under_gate("v1") as gate:
        libsumo.vehicle.setStop("v1", "C1D1", pos=85.0, duration=20.0)
        drive(gate, lambda: libsumo.vehicle.isStopped("v1"))
        drive(gate, steps=5)
        libsumo.vehicle.setStop("v1", "C1D1", pos=84.0, duration=20.0)
        drive(gate, steps=400)
    assert gate.summary["laps"] >= 2


def test_who_joins_while_it_stops_for_its_owner_is_granted_nothing_yet() -> None:
    """It would keep the next crossing from others as long as it stands."""
    start()
    put("v1")
    libsumo.simulationStep()
    libsumo.vehicle.setStop("v1", "C1D1", pos=85.0, duration=100.0)
    while not libsumo.vehicle.isStopped("v1"):
        libsumo.simulationStep()
    with loopgate.attach(libsumo) as gate:
        gate.add("v1")
        happened = drive(gate, steps=30)
        assert of(happened, "start")
        assert libsumo.vehicle.isStopped("v1")
        assert of(happened, "refuse") == [("v1", "stop")]
        assert not of(happened, "grant")
        drive(gate, lambda: libsumo.vehicle.getRoadID("v1") == "D0C0")


@pytest.mark.parametrize("stops", [1, 2])
def test_time_at_an_owners_stop_is_no_wait_for_a_grant(stops: int) -> None:
    """Whether or not there is another one to come."""
    with under_gate("v1") as gate:
        libsumo.vehicle.setStop("v1", "C1D1", pos=85.0, duration=120.0)
        if stops > 1:
            libsumo.vehicle.setStop("v1", "D0C0", pos=40.0, duration=5.0)
        drive(gate, steps=400)
    assert gate.summary["laps"] >= 1
    assert gate.summary["longest_wait_s"] < 20.0


def speed(vehicle: str) -> float:
    """Return its speed [m/s]."""
    return float(libsumo.vehicle.getSpeed(vehicle))


class OneOnly(OpenGate):
    """Refuses to begin with more than one."""

    def __init__(self, system: System) -> None:
        super().__init__(system)
        if len(system.robots) > 1:
            msg = "one is enough"
            raise UnsafeStartError(msg)


def test_a_vehicle_waits_while_the_gate_cannot_take_it_in() -> None:
    """It stands before the end of a place until the other has left."""
    start()
    put("v1")
    with loopgate.attach(libsumo, gate=OneOnly) as gate:
        gate.add("v1")
        drive(gate, lambda: gate.vehicles == ("v1",))
        put("v2", route="loop4")
        gate.add("v2")
        drive(gate, steps=100)
        assert (gate.vehicles, gate.waiting) == (("v1",), ("v2",))
        assert speed("v2") == 0.0
        gate.leave("v1")
        drive(gate, lambda: gate.vehicles == ("v2",), steps=5)


def test_longer_vehicles_change_the_plan(tmp_path: Path) -> None:
    """All grants are withheld until everybody holds one place; then all go on by the new plan, at once."""
    routes = tmp_path / "some.rou.xml"
    known = (ROOT / "routes" / "grid5.rou.xml").read_text(encoding="utf-8")
    routes.write_text(known.replace("<routes>", '<routes><vType id="bus" length="12"/>', 1))
    start(routes=routes)
    put(*(f"v{number}" for number in range(6)))
    put(*(f"w{number}" for number in range(6)), route="loop4")
    with loopgate.attach(libsumo) as gate:
        gate.add(*(f"{kind}{number}" for kind in "vw" for number in range(6)))
        drive(gate, lambda: len(gate.vehicles) == 12)
        put("bus", kind="bus")
        gate.add("bus")
        happened = drive(gate, lambda: "bus" in gate.vehicles)
        again = {row.vehicle: row.time_s for row in happened if row.reason == "another plan"}
        assert len(again) == 12
        begun = {row.vehicle: row.time_s for row in happened if row.event == "start"}
        at_once = {vehicle for vehicle, at_s in again.items() if begun.get(vehicle) == at_s}
        assert len(at_once) >= 10  # who stands beyond a line that has moved back joins at its next place
        assert "traffic" in dict(of(happened, "refuse")).values()
        assert {type(reason) for reason in gate.summary["refusals"]} == {str}
        drive(gate, steps=600)
        assert len(gate.vehicles) == 13
    assert (gate.summary["trespasses"], gate.summary["overruns"], gate.summary["collisions"]) == (0, 0, 0)
    assert gate.summary["laps"] >= 13


def test_what_it_cannot_take_is_refused_by_name(tmp_path: Path) -> None:
    """Vehicles that do not exist, open routes, drivers no gate can count on; and nobody else is added."""
    routes = tmp_path / "some.rou.xml"
    routes.write_text(
        '<routes><vType id="near" tau="0.2"/><vType id="rail" carFollowModel="Rail"/>'
        '<vType id="rash" jmIgnoreJunctionFoeProb="0.5"/><vType id="slow" actionStepLength="2"/>'
        '<vType id="late" jmDriveAfterRedTime="3"/>'
        '<vType id="led"><param key="has.rerouting.device" value="true"/></vType>'
        '<route id="loop" edges="A0A1 A1B1 B1B0 B0A0"/><route id="open" edges="C0C1 C1D1"/></routes>'
    )
    start(routes=routes)
    kinds = {"near": "tau", "rail": "carFollowModel Rail", "rash": "jmIgnore", "slow": "actionStepLength"}
    kinds |= {"late": "jmDriveAfterRedTime lets it drive at red", "led": "rerouting device"}
    put("fine", route="loop")
    put("away", route="open")
    for kind in kinds:
        put(kind, route="loop", kind=kind)
    wrong: dict[str, Any] = {"starving_s": -1, "folder": 5}
    for name, value in wrong.items():
        with pytest.raises(LoopgateError, match=f"{name} is {value}; expected a"):
            loopgate.attach(libsumo, **{name: value})
    with loopgate.attach(libsumo) as gate:
        for vehicle, text in {**kinds, "away": "the route does not close|not lead|no", "x": "none"}.items():
            with pytest.raises(LoopgateError, match=f"vehicle {vehicle}: .*{text}"):
                gate.add("fine", vehicle)
        assert gate.waiting == ()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (("--step-length", "2"), "step-length is 2"),
        (("--step-method.ballistic",), "step-method.ballistic"),
        (("--lanechange.duration", "3"), "lanechange.duration 3"),
        (("--lateral-resolution", "0.8"), "lateral-resolution 0.8"),
        (("--default.carfollowmodel", "IDM"), "default.carfollowmodel IDM"),
        (("--default.action-step-length", "2"), "default.action-step-length 2"),
    ],
)
def test_unsafe_settings_are_refused_by_name(options: tuple[str, ...], text: str) -> None:
    """Before any vehicle is touched."""
    start(*options)
    with pytest.raises(LoopgateError, match=re.escape(text)):
        loopgate.attach(libsumo)


def test_arguments_are_checked() -> None:
    """As those of a scenario are."""
    start()
    for given, text in (
        ({"gate": "open"}, "gate open"),
        ({"gate": "nosuch"}, "nosuch"),
        ({"negotiation": "nosuch"}, "nosuch"),
        ({"lights": "off"}, "expected one of obey, keep"),
    ):
        with pytest.raises(LoopgateError, match=text):
            loopgate.attach(libsumo, **given)  # type: ignore[arg-type]  # all are words


def test_names_are_texts() -> None:
    """A list is none, and what the way out is depends on the call."""
    with under_gate("v1") as gate:
        for call, given in (("block", None), ("block", ["v1"]), ("free", None), ("leave", ["v1"])):
            with pytest.raises(TrafficError, match=rf"{call} takes names; .*gate\.{call}\(\*names\)"):
                getattr(gate, call)(given)
        with pytest.raises(TrafficError, match=r"why takes names; found \['v1'\]$"):
            gate.why(["v1"])  # type: ignore[arg-type]


def test_before_and_after_its_with_statement_a_gate_refuses_to_be_used() -> None:
    """Steps outside it would be driven without a gate, and nobody would notice."""
    start()
    put("v1")
    gate = loopgate.attach(libsumo)
    assert repr(gate) == "<Attached: not in a with statement yet>"
    for use in (lambda: gate.summary, lambda: gate.events, lambda: gate.block("v1"), gate.after_step):
        with pytest.raises(TrafficError, match="use what it returns in a with statement"):
            use()
    with gate:
        gate.add("v1")
        with pytest.raises(TrafficError, match="call attach anew"):
            gate.__enter__()
    libsumo.simulationStep()
    for use in (lambda: gate.add("v1"), lambda: gate.leave("v1"), lambda: gate.block("v1"), gate.after_step):
        with pytest.raises(TrafficError, match="the with statement of this gate has ended"):
            use()
    assert not gate.waiting
    assert gate.summary["waiting"] == 1


def test_the_simulation_may_end_first() -> None:
    """Figures and events are there all the same."""
    with under_gate("v1") as gate:
        libsumo.close()
    assert gate.summary["vehicles"] == 1
    assert "start" in set(gate.events["event"])
    start()


def test_no_simulation_is_running() -> None:
    """Nothing to attach to."""
    with pytest.raises(LoopgateError, match="traci: no simulation is running"):
        loopgate.attach(importlib.import_module("traci"))
    start()


def test_who_has_passed_a_light_heeds_the_next_one() -> None:
    """Let go into green they are not stopped by it, until they are over its line; who stands is counted."""
    start(network=ROOT / "networks" / "grid5-actuated.net.xml")
    vehicles = [f"v{number}" for number in range(12)]
    for number, vehicle in enumerate(vehicles):
        put(vehicle, route=f"loop{number % 4}")
    heeds: dict[str, list[bool]] = {vehicle: [] for vehicle in vehicles}
    with loopgate.attach(libsumo) as gate:
        gate.add(*vehicles)
        for _ in range(400):
            drive(gate, steps=1)
            for vehicle in gate.vehicles:
                heeds[vehicle].append(bool(libsumo.vehicle.getSpeedMode(vehicle) & 16))
    assert gate.summary["at_lights"]["grants"] > 50
    again = [vehicle for vehicle, some in heeds.items() if True in some[some.index(False) :]]
    assert again == vehicles


def test_vehicles_put_in_ahead_of_others_are_let_go_before_them() -> None:
    """Several come into one place at once, in any order; the books have the order on the road."""
    start()
    ids = [f"v{number}" for number in range(60)]
    for number, vehicle in enumerate(ids):
        libsumo.vehicle.add(
            vehicle, f"loop{number % 30}", departPos="random_free" if number >= 30 else "base"
        )
    with loopgate.attach(libsumo) as gate:
        gate.add(*ids)
        while libsumo.simulation.getTime() < 400:
            libsumo.simulationStep()
            gate.after_step()
            assert gate._fleet.mend_order() == 0
        assert gate.summary["longest_wait_s"] < 120.0
        early = gate.events
    granted = gate.events[(gate.events["event"] == "grant") & (gate.events["time_s"] > 250.0)]
    assert set(granted["vehicle"]) == set(ids)
    assert 0 < len(early) <= len(gate.events)


def test_a_summary_says_how_it_stands_as_that_of_a_run_does() -> None:
    """The outcome, the promise, deadlocks, and who starves behind whom."""
    start()
    ids = [f"v{number}" for number in range(40)]
    for number, vehicle in enumerate(ids):
        libsumo.vehicle.add(vehicle, f"loop{number % 10}")
    with loopgate.attach(libsumo, starving_s=120.0) as gate:
        gate.add(*ids)
        stopped = ""
        while libsumo.simulation.getTime() < 600:
            libsumo.simulationStep()
            gate.after_step()
            if libsumo.simulation.getTime() == 100:
                assert gate.summary["outcome"] == "done"
                stopped = next(v for v in ids if 10 < libsumo.vehicle.getLanePosition(v) < 40)
                libsumo.vehicle.setStop(stopped, libsumo.vehicle.getRoadID(stopped), 75.0, 0, 1e6)
        summary = gate.summary
    assert (summary["outcome"], summary["promise"], summary["deadlocks"]) == ("starving", "everyone", [])
    assert stopped in {sink["behind"] for sink in summary["starving"]}


def test_what_the_owner_sets_is_counted_on_from_then_on() -> None:
    """Weaker brakes: whoever could not brake by then does not, nobody later. Longer vehicles are refused."""
    start()
    ids = [f"v{number}" for number in range(40)]
    for number, vehicle in enumerate(ids):
        libsumo.vehicle.add(vehicle, f"loop{number}")
    with loopgate.attach(libsumo) as gate:
        gate.add(*ids)
        while libsumo.simulation.getTime() < 400:
            libsumo.simulationStep()
            gate.after_step()
            if libsumo.simulation.getTime() == 100:
                for vehicle in gate.vehicles:
                    libsumo.vehicle.setDecel(vehicle, 1.5)
            if libsumo.simulation.getTime() == 130:
                soon = gate.summary
        names = ("trespasses", "overruns", "collisions")
        assert [gate.summary[name] for name in names] == [soon[name] for name in names]
        assert soon["collisions"] == 0
        libsumo.vehicle.setLength(gate.vehicles[0], 12.0)
        libsumo.simulationStep()
        with pytest.raises(TrafficError, match="its length was 5 m when it came under the gate and is 12 m"):
            gate.after_step()


def test_a_vehicle_is_under_one_gate_at_a_time() -> None:
    """A second gate would let go whom the first holds; after leaving the first the vehicle may join it."""
    start()
    put("a", "b")
    with loopgate.attach(libsumo) as first, loopgate.attach(libsumo) as second:
        first.add("a")
        with pytest.raises(LoopgateError, match="vehicle a: another gate of this simulation has it"):
            second.add("b", "a")
        assert second.waiting == ()
        second.add("b")
        drive(first, lambda: "a" in first.vehicles)
        drive(second, lambda: "b" in second.vehicles)
        with pytest.raises(LoopgateError, match="vehicle b: another gate of this simulation has it"):
            first.add("b")
        first.leave("a")
        second.add("a")
    with loopgate.attach(libsumo) as third:
        third.add("a", "b")
        assert third.waiting == ("a", "b")


@pytest.mark.parametrize("backend", ["libsumo", "traci"])
def test_a_run_beside_an_attached_gate(backend: str) -> None:
    """In libsumo it would end the simulation under the gate, and is refused at its start; not in traci."""
    start()
    put("a")
    scenario = loopgate.Scenario(network=str(GRID), loops=2, gate="open", duration_s=20)
    with loopgate.attach(libsumo) as gate:
        gate.add("a")
        drive(gate, lambda: bool(gate.vehicles))
        if backend == "libsumo":
            with pytest.raises(SecondSimulationError, match="something else has started is under way"):
                loopgate.run(scenario)
        else:
            assert loopgate.run(scenario, backend=backend).summary["outcome"] == "done"
        drive(gate, steps=5)
        assert gate.vehicles == ("a",)


def test_nobody_attaches_to_a_run() -> None:
    """A run's own simulation is its own to drive."""

    def attach(_now_s: float, _course: object) -> None:
        loopgate.attach(libsumo)

    scenario = loopgate.Scenario(network=str(GRID), loops=2, gate="open", duration_s=20)
    with pytest.raises(SecondSimulationError, match=r"a run of .*grid5-priority.net.xml is under way"):
        loopgate.run(scenario, tick=attach)
    assert loopgate.run(scenario).summary["outcome"] == "done"


def test_two_runs_in_threads() -> None:
    """The second is refused by name while the first is under way; that one is as it is alone."""
    scenario = loopgate.Scenario(network=str(GRID), loops=2, gate="open", duration_s=60)
    alone = loopgate.run(scenario)
    refused: list[BaseException] = []

    def run() -> None:
        try:
            loopgate.run(scenario)
        except SecondSimulationError as error:
            refused.append(error)

    def beside(_now_s: float, _course: object) -> None:
        thread = threading.Thread(target=run)
        thread.start()
        thread.join()

    made = loopgate.run(scenario, tick=beside)
    assert refused
    assert made.events.equals(alone.events)
    assert "a run of" in str(refused[0])
    assert "traci" in str(refused[0])
