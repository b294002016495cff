"""Configurations as people lay them out: types, vehicles and routes in additional files, drawn ones."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import pytest

from loopgate import Scenario
from loopgate.errors import RouteError
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

GRID = Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml"
CARS = '<vType id="car" length="4.5"/><vType id="van" length="6.5" maxSpeed="12"/>'


def configuration(folder: Path, routes: str, *additional: str, end_s: float = 60.0) -> str:
    """Write a configuration with a route file, if there is anything in it, and additional files."""
    folder.mkdir(exist_ok=True)
    shutil.copy(GRID, folder / "n.net.xml")
    files = '<net-file value="n.net.xml"/>'
    if routes:
        (folder / "r.rou.xml").write_text(f"<routes>{routes}</routes>", encoding="utf-8")
        files += '<route-files value="r.rou.xml"/>'
    for number, text in enumerate(additional):
        (folder / f"a{number}.add.xml").write_text(text, encoding="utf-8")
    files += f'<additional-files value="{",".join(f"a{n}.add.xml" for n in range(len(additional)))}"/>'
    file = folder / "c.sumocfg"
    file.write_text(
        f'<configuration>{files}<begin value="0"/><end value="{end_s}"/></configuration>', encoding="utf-8"
    )
    return str(file)


def run(folder: Path, config: str, **more: Any) -> dict[str, Any]:  # noqa: ANN401  a scenario's keys
    return simulate(Scenario.from_dict({"network": config, **more}), folder, overwrite=True)


def types_in(folder: Path) -> dict[str, str]:
    """Return the types with which vehicles drove, as SUMO wrote them down."""
    top = ET.parse(folder / "tripinfo.xml").getroot()
    return {one.get("id", ""): one.get("vType", "").partition("@")[0] for one in top.iter("tripinfo")}


@pytest.mark.parametrize("root", ["additional", "routes", "add"])
@pytest.mark.parametrize("gated", ["all", "van"])
def test_types_in_additional_files(tmp_path: Path, root: str, gated: str) -> None:
    """Of gated vehicles and of ordinary ones; SUMO does not mind the root element, nor does the gate."""
    trips = "".join(
        f'<trip id="{kind}{k}" type="{kind}" depart="{k}" from="A0A1" to="A1B1"/>'
        for k in range(3)
        for kind in ("car", "van")
    )
    config = configuration(tmp_path, trips, f"<{root}>{CARS}</{root}>")
    summary = run(tmp_path / "out", config, gated=gated)
    assert summary["arrived"] + summary.get("others", {}).get("arrived", 0) == 6
    assert summary["arrived"] == (6 if gated == "all" else 3)
    assert summary["audit"] == "clean"
    assert types_in(tmp_path / "out") == {f"{kind}{k}": kind for k in range(3) for kind in ("car", "van")}


def test_buses_of_a_line_arrive(tmp_path: Path) -> None:
    """Types and stops in an additional file; a finite route, stops with times, the name of a line."""
    places = (
        '<additional><vType id="bus" vClass="bus" length="12"/>'
        '<busStop id="west" lane="A1B1_0" startPos="30" endPos="60" lines="7"/>'
        '<busStop id="east" lane="B1C1_0" startPos="30" endPos="60" lines="7"/></additional>'
    )
    stops = '<stop busStop="west" until="{}" duration="5"/><stop busStop="east" until="{}" duration="5"/>'
    buses = "".join(
        f'<vehicle id="bus{k}" type="bus" line="7" depart="{40 * k}"><route edges="A0A1 A1B1 B1C1 C1C2"/>'
        f"{stops.format(40 * k + 40, 40 * k + 70)}</vehicle>"
        for k in range(3)
    )
    config = configuration(tmp_path, buses, places, end_s=300)
    summary = run(tmp_path / "out", config, positions=True)
    assert (summary["arrived"], summary["unfinished"], summary["audit"]) == (3, 0, "clean")
    assert (summary["stops"]["served"], summary["stops"]["missed"]) == (6, 0)
    trips = pd.read_parquet(tmp_path / "out" / "vehicles.parquet").set_index("vehicle")["trip_s"]
    assert trips.min() > 70.0  # none goes on before its time
    assert set(types_in(tmp_path / "out").values()) == {"bus"}


BESIDE = f"""<additional>{CARS}
    <e1Detector id="d" lane="A1B1_0" pos="20" freq="60" file="d.xml"/>
    <route id="north" edges="A0A1 A1A2 A2A3"/>
    <route id="unused" edges="E0E1 E1E2"/>
    <trip id="t" type="car" depart="1" from="A0A1" to="A1B1"/>
    <flow id="f" type="van" begin="0" end="20" period="10" route="north"/>
    <vehicle id="v" type="car" depart="3"><route edges="B0B1 B1C1"/></vehicle>
</additional>"""


@pytest.mark.parametrize("routes", ["", '<trip id="mine" type="car" depart="0" from="C0C1" to="C1D1"/>'])
def test_vehicles_in_additional_files_are_gated(tmp_path: Path, routes: str) -> None:
    """With those of route files and without; the detectors beside them count on, where they did."""
    summary = run(tmp_path / "out", configuration(tmp_path, routes, BESIDE), positions=True)
    count = 5 if routes else 4
    assert (summary["trips"], summary["arrived"], summary["audit"]) == (count, count, "clean")
    assert "others" not in summary
    assert 'nVehContrib="1"' in (tmp_path / "d.xml").read_text(encoding="utf-8")
    open_ = run(tmp_path / "open", str(tmp_path / "c.sumocfg"), gate="open")
    assert (open_["trips"], open_["arrived"]) == (count, count)
    assert types_in(tmp_path / "open") == types_in(tmp_path / "out")


def test_vehicles_in_additional_files_beside_a_route_file(tmp_path: Path) -> None:
    """As `--stops` names them: under the gate, and in a run without one no more than once."""
    configuration(tmp_path, '<trip id="mine" type="car" depart="0" from="C0C1" to="C1D1"/>', BESIDE)
    given = {"routes": str(tmp_path / "r.rou.xml"), "stops": str(tmp_path / "a0.add.xml"), "duration_s": 60.0}
    for gate in ("certified", "open"):
        summary = run(tmp_path / gate, str(tmp_path / "n.net.xml"), gate=gate, **given)
        assert (summary["trips"], summary["arrived"]) == (5, 5)


def test_files_that_files_include(tmp_path: Path) -> None:
    """Trips of a route file, types and vehicles of an additional one, in a folder of their own; and wrong."""
    config = configuration(
        tmp_path,
        '<include href="more/trips.rou.xml"/>',
        '<additional><include href="more/types.xml"/><include href="more/beside.add.xml"/></additional>',
    )
    (tmp_path / "more").mkdir()
    trips = tmp_path / "more" / "trips.rou.xml"
    trip = '<trip id="mine" type="car" depart="0" from="C0C1" to="C1D1"/>'
    trips.write_text(f"<routes>{trip}</routes>", encoding="utf-8")
    (tmp_path / "more" / "types.xml").write_text(f"<routes>{CARS}</routes>", encoding="utf-8")
    (tmp_path / "more" / "beside.add.xml").write_text(BESIDE.replace(CARS, ""), encoding="utf-8")
    for gate in ("certified", "open"):
        summary = run(tmp_path / gate, config, gate=gate)
        assert (summary["trips"], summary["arrived"]) == (5, 5)
        assert "others" not in summary
    for name, why in (
        ("../more/trips.rou.xml", "and that includes it again"),
        ("none.xml", "and there is no such file"),
    ):
        trips.write_text(f'<routes><include href="{name}"/></routes>', encoding="utf-8")
        with pytest.raises(RouteError, match=f"it includes '{name}', {why}; correct href"):
            run(tmp_path / "wrong", config)


def test_loops_in_additional_files(tmp_path: Path) -> None:
    """Closed routes are loops there too; of routes that nobody drives there nothing is said."""
    loops = (
        BESIDE.replace("A0A1 A1A2 A2A3", "A0A1 A1B1 B1B0 B0A0")
        .replace("<trip", "<!--")
        .replace('to="A1B1"/>', "-->")
    )
    loops = loops.replace("B0B1 B1C1", "B1C1 C1C2 C2B2 B2B1")
    summary = run(tmp_path / "out", configuration(tmp_path, "", loops))
    assert (summary["vehicles"], summary["loops"], summary["audit"]) == (3, 2, "clean")


def test_a_type_that_is_nowhere_is_refused(tmp_path: Path) -> None:
    """In one line, with the types that there are."""
    trip = '<trip id="t" type="bus" depart="0" from="A0A1" to="A1B1"/>'
    config = configuration(tmp_path, trip, f"<additional>{CARS}</additional>")
    with pytest.raises(RouteError, match=r"trip t: its type 'bus' is no <vType> .*; they define car, van"):
        run(tmp_path / "out", config)


DRAWN = """
    <vType id="car" length="4.5" probability="3"/><vType id="bus" vClass="bus"/>
    <vTypeDistribution id="mixed"><vType id="slow" maxSpeed="9" probability="0.5"/>
        <vType refId="car" probability="0.5"/></vTypeDistribution>
    <vTypeDistribution id="named" vTypes="car bus" probabilities="0.75 0.25"/>
    <vTypeDistribution id="both" vTypes="mixed bus" probabilities="1 1"/>
"""


def kinds_of(summary: dict[str, Any], folder: Path, flow: str) -> list[str]:
    """Return the types of the vehicles of a flow, all of which have arrived."""
    assert (summary["unfinished"], summary.get("audit", "clean")) == (0, "clean")
    return [kind for name, kind in types_in(folder).items() if name.startswith(f"{flow}.")]


@pytest.mark.parametrize("where", ["routes", "additional"])
def test_types_are_drawn(tmp_path: Path, where: str) -> None:
    """By their shares, for each vehicle by the run's seed: one seed, one run, gate or no gate."""
    flows = "".join(
        f'<flow id="{kind}" type="{kind}" begin="0" end="40" period="2" from="{a}" to="{b}"/>'
        for kind, a, b in (("mixed", "A0A1", "A1A2"), ("named", "B0B1", "B1B2"), ("both", "C0C1", "C1C2"))
    )
    routes, beside = (DRAWN + flows, "") if where == "routes" else (flows, DRAWN)
    config = configuration(tmp_path, routes, f"<additional>{beside}</additional>", end_s=200)
    summary = run(tmp_path / "out", config)
    assert set(kinds_of(summary, tmp_path / "out", "mixed")) == {"slow", "car"}
    assert set(kinds_of(summary, tmp_path / "out", "both")) == {"slow", "car", "bus"}
    named = kinds_of(summary, tmp_path / "out", "named")
    assert len(named) == 20
    assert 0 < named.count("bus") < 10
    run(tmp_path / "again", config)
    assert types_in(tmp_path / "again") == types_in(tmp_path / "out")
    run(tmp_path / "other", config, seed=2)
    assert types_in(tmp_path / "other") != types_in(tmp_path / "out")
    given = {
        "routes": str(tmp_path / "r.rou.xml"),
        "stops": str(tmp_path / "a0.add.xml"),
        "duration_s": 200.0,
    }
    run(tmp_path / "open", str(tmp_path / "n.net.xml"), gate="open", **given)
    assert types_in(tmp_path / "open") == types_in(tmp_path / "out")


def test_each_class_of_a_distribution_is_led_its_own_way(tmp_path: Path) -> None:
    """Trips of buses may take a road that is closed to cars."""
    trips = '<flow id="f" type="named" begin="0" end="30" period="2" from="A0A1" to="A2B2"/>'
    config = configuration(tmp_path, DRAWN + trips, "<additional/>", end_s=200)
    text = (tmp_path / "n.net.xml").read_text(encoding="utf-8")
    lane = '<lane id="A1A2_0" index="0"'
    assert lane in text
    (tmp_path / "n.net.xml").write_text(text.replace(lane, f'{lane} allow="bus"'), encoding="utf-8")
    summary = run(tmp_path / "out", config)
    assert set(kinds_of(summary, tmp_path / "out", "f")) == {"car", "bus"}
    m = {
        kind: {
            float(one.get("routeLength", "0"))
            for one in ET.parse(tmp_path / "out" / "tripinfo.xml").iter("tripinfo")
            if one.get("vType", "").startswith(kind)
        }
        for kind in ("car", "bus")
    }
    assert max(m["bus"]) < min(m["car"])


SQUARES = 'edges="A0A1 A1B1 B1B0 B0A0"', 'edges="C0C1 C1D1 D1D0 D0C0"'


@pytest.mark.parametrize("where", ["routes", "additional"])
def test_routes_are_drawn(tmp_path: Path, where: str) -> None:
    """By name, by reference, inside; of a vehicle and of each of a flow."""
    spread = """
        <route id="r" edges="A0A1 A1A2"/><route id="s" edges="A0A1 A1B1"/>
        <routeDistribution id="d" routes="r s" probabilities="1 1"/>
        <routeDistribution id="e"><route refId="r" probability="1"/>
            <route edges="C0C1 C1C2" probability="2"/><route id="never" edges="E0E1 E1E2" probability="0"/>
        </routeDistribution>"""
    vehicles = """<vType id="car"/>
        <flow id="d" type="car" begin="0" end="20" period="2" route="d"/>
        <flow id="e" type="car" begin="0" end="20" period="2" route="e"/>
        <flow id="own" type="car" begin="0" end="20" period="2"><routeDistribution>
            <route edges="B0B1 B1B2"/><route edges="B0B1 B1C1"/></routeDistribution></flow>"""
    routes, beside = (spread + vehicles, "") if where == "routes" else (vehicles, spread)
    config = configuration(tmp_path, routes, f"<additional>{beside}</additional>", end_s=200)
    ends = []
    for number, gate in enumerate(("certified", "certified", "open")):
        folder = tmp_path / f"out{number}"
        more = {"gate": gate}
        if gate == "open":
            more |= {"routes": str(tmp_path / "r.rou.xml"), "stops": str(tmp_path / "a0.add.xml")}
        summary = run(folder, config, **more)
        assert (summary["trips"], summary["unfinished"]) == (30, 0)
        top = ET.parse(folder / "tripinfo.xml")
        lanes = {one.get("id", ""): one.get("arrivalLane", "") for one in top.iter("tripinfo")}
        ends.append({name: lane.rpartition("_")[0] for name, lane in lanes.items()})
    assert ends[0] == ends[1] == ends[2]
    for flow, edges in {"d": {"A1A2", "A1B1"}, "e": {"A1A2", "C1C2"}, "own": {"B1B2", "B1C1"}}.items():
        assert {edge for name, edge in ends[0].items() if name.startswith(f"{flow}.")} == edges


def test_loops_are_drawn(tmp_path: Path) -> None:
    """Closed routes and types of vehicles that go round."""
    vehicles = f"""{DRAWN}<routeDistribution id="d"><route {SQUARES[0]}/><route {SQUARES[1]}/>
        </routeDistribution><flow id="f" type="mixed" begin="0" end="40" period="4" route="d"/>"""
    config = configuration(tmp_path, vehicles, "<additional/>")
    summary = run(tmp_path / "out", config, outputs="tripinfo")
    assert (summary["audit"], summary["loops"]) == ("clean", 2)
    assert set(types_in(tmp_path / "out").values()) == {"slow", "car"}
    vehicles_there = pd.read_parquet(tmp_path / "out" / "vehicles.parquet")
    assert vehicles_there["loop"].nunique() == 2


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('<vTypeDistribution id="d" vTypes="a b"/>', "vTypeDistribution d: its type 'b' is no <vType>"),
        (
            '<vTypeDistribution id="d" vTypes="a a" probabilities="1"/>',
            "vTypeDistribution d: it has 1 probabilities for 2 vTypes; give one for each",
        ),
        (
            '<vTypeDistribution id="d" vTypes="a" probabilities="-1"/>',
            "vTypeDistribution d: a probability is '-1'; expected a share",
        ),
        ('<vTypeDistribution id="d"/>', "vTypeDistribution d: nothing can be drawn from it"),
    ],
)
def test_distributions_that_make_no_sense(tmp_path: Path, text: str, found: str) -> None:
    """One line with file, element and what is wrong."""
    vehicle = '<vehicle id="v" type="d" depart="0"><route edges="A0A1 A1A2"/></vehicle>'
    config = configuration(tmp_path, f'<vType id="a"/>{text}{vehicle}', "<additional/>")
    with pytest.raises(RouteError, match=found) as error:
        run(tmp_path / "out", config)
    assert "\n" not in str(error.value)
