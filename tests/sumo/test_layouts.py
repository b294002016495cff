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
