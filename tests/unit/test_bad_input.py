"""Spoiled inputs that once ended in a traceback, a hang or gigabytes: each is refused in one line.

``make fuzz`` looks for more of them; what it finds belongs here.
"""

from __future__ import annotations

import gzip
import json
import os
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest
from roads import roads

from loopgate import Scenario, Sweep, read_results, read_run, read_scenario, read_sweep
from loopgate.audit import audit_events, read_layout
from loopgate.errors import LoopgateError, NetworkError, RouteError
from loopgate.model import read_system, system_from_dict
from loopgate.network import RoadNetwork, read_loops
from loopgate.network.traffic_file import read_traffic
from loopgate.research.theory.certificates import CertificateError, check_certificate
from loopgate.results import columns as c
from loopgate.results.columns import EDGE_COLUMNS, EVENT_COLUMNS, VEHICLE_COLUMNS
from loopgate.results.recorder import Recorder, read_events
from loopgate.sweep.execution import Store
from loopgate.sweep.task import Result

RING = (Path(__file__).parents[2] / "networks" / "ring3.net.xml").read_text(encoding="utf-8")
NET = roads({"a": (100, 1), "b": (50, 1)}, ["a_0>b_0", "b_0>a_0"], buses_only=[])
BIG = "9" * 5000


def refusal(read: Callable[[], object]) -> str:
    """Return the line with which an input is refused."""
    with pytest.raises(LoopgateError) as error:
        read()
    text = str(error.value)
    assert "\n" not in text
    assert 0 < len(text) < 2500
    return text


@pytest.mark.parametrize(
    ("found", "spoiled", "says"),
    [
        ('from="p1a" to="p1b"', 'from="p1a" to="nowhere"', "there is no lane '0' on an edge 'nowhere'"),
        ('fromLane="0"', 'fromLane="7"', "there is no lane '7' on an edge"),
        ('toLane="0"', 'toLane="x"', "toLane is 'x'; expected a whole number"),
        ('fromLane="0"', "", "it has no fromLane"),
        (' length="', ' length="nan" was="', "its length is nan; expected a number above 1e-06"),
        (' length="', ' length="0" was="', "its length is 0; expected a number above 1e-06"),
        (' length="', ' length="1e-320" was="', "its length is 9.99989e-321; expected a number above 1e-06"),
        (' speed="', ' speed="-5" was="', "its speed is -5; expected a number from 0"),
        (' shape="', ' shape="1,nan 2,3" was="', "it is drawn through"),
        (' shape="', ' shape="1e308,0 2,3" was="', "it is drawn through 1e+308"),
        (' shape="', ' shape="7" was="', "its shape has the point '7'"),
        (' shape="', ' shape="1,2,nan 3,4,5" was="', "how high it lies is nan"),
        ('<request index="3"', '<request index="99999999999999999999"', "a request has an index outside"),
        (' x="', ' x="east" was="', "x is 'east'; expected a number"),
        ('encoding="UTF-8"', 'encoding="none-such"', "not XML that can be read"),
        ('encoding="UTF-8"', 'encoding="idna"', "not XML that can be read"),
        ("<location", "<a>" * 1000 + "<location", "not a SUMO network that can be read"),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_networks(tmp_path: Path, found: str, spoiled: str, says: str, *, packed: bool) -> None:
    """The element at fault is named, and what was expected."""
    assert found in RING
    content = RING.replace(found, spoiled, 1).encode()
    file = tmp_path / "n.net.xml"
    file.write_bytes(gzip.compress(content) if packed else content)
    with pytest.raises(NetworkError):
        RoadNetwork.open(file)
    text = refusal(lambda: RoadNetwork.open(file))
    assert text.startswith(f"{file}: ")
    assert says in text


@pytest.mark.parametrize("name", ["x" * 300, "x/" * 3000, "a\x00b", "\ud800"])
def test_names_that_no_file_has(name: str) -> None:
    """Too long for the system, or not to be written at all."""
    for read in (
        RoadNetwork.open,
        read_system,
        read_scenario,
        read_sweep,
        read_results,
        read_run,
        read_traffic,
    ):
        refusal(partial(read, name))


@pytest.mark.skipif(os.sep != "/", reason="there, such a path is right")
def test_a_path_of_windows(tmp_path: Path) -> None:
    """The message says what to write, also for a path in a configuration."""
    assert refusal(lambda: RoadNetwork.open(r"nets\a.net.xml")).endswith("write nets/a.net.xml")
    file = tmp_path / "x.sumocfg"
    file.write_text(r'<configuration><net-file value="nets\a.net.xml"/></configuration>')
    assert refusal(lambda: RoadNetwork.open(file)).endswith(f"write {tmp_path}/nets/a.net.xml")


@pytest.mark.parametrize(
    ("attribute", "value", "says"),
    [
        ("length", "nan", "length is 'nan'; expected metres, above 0 and up to 1000"),
        ("length", "0", "length is '0'"),
        ("minGap", "-1", "minGap is '-1'; expected metres, from 0 and up to 1000"),
        ("width", "wide", "width is 'wide'"),
        ("accel", "inf", "accel is 'inf'"),
        ("decel", "0", "decel is '0'"),
        ("tau", "-inf", "tau is '-inf'"),
        ("maxSpeed", "1e308", "maxSpeed is '1e308'"),
        ("sigma", "1.5", "sigma is '1.5'; expected a share, from 0 and up to 1"),
        ("speedFactor", "normc(1,nan,0.2,2)", "speedFactor is 'normc(1,nan,0.2,2)'"),
        ("speedFactor", "norm(0,0.1)", "speedFactor"),
        ("lcStrategic", "nan", "lcStrategic is 'nan'; expected a number"),
    ],
)
def test_vehicle_types(tmp_path: Path, attribute: str, value: str, says: str) -> None:
    """File, type and attribute are named, for vehicles on loops and for ordinary ones."""
    file = tmp_path / "r.rou.xml"
    file.write_text(
        f'<routes><vType id="t" {attribute}="{value}"/><route id="r" edges="a b"/>'
        '<vehicle id="v" route="r" type="t" depart="0"/></routes>'
    )
    for text in (refusal(lambda: read_loops(NET, file)), refusal(lambda: read_traffic(file))):
        assert text.startswith(f"{file}: vType t: ")
        assert says in text
    file.write_text(file.read_text().replace(' type="t"', ""))
    assert says in read_loops(NET, file).left_out[0]
    assert read_traffic(file).ids == {"v"}


@pytest.mark.parametrize(
    "value",
    [
        'speedFactor="normc(1,0.1,0.2,2)"',
        'lcStrategic="-1"',
        'startupDelay="0:00:01"',
        'sigma="0"',
        'lcOpposite="inf"',
        'maxSpeed="inf"',
    ],
)
def test_vehicle_types_that_sumo_takes(tmp_path: Path, value: str) -> None:
    """Distributions, settings below 0 or without a bound, and clock times are in order."""
    file = tmp_path / "r.rou.xml"
    file.write_text(f'<routes><vType id="t" {value}/><route id="r" edges="a b"/></routes>')
    assert "t" in read_loops(NET, file).types


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ('<?xml version="1.0" encoding="hex"?><routes/>', "not XML"),
        ("<routes>" + "<a>" * 50_000, "not XML"),
        (f"<{'r' * 5000}/>", "the root element is <rrr"),
        (
            '<routes><vehicle id="v" depart="0" departPos="nan"><route edges="a b"/></vehicle></routes>',
            "departPos",
        ),
        (
            '<routes><vehicle id="v" depart="0" departPos="1e308"><route edges="a b"/></vehicle></routes>',
            "departPos",
        ),
    ],
)
def test_route_files(tmp_path: Path, content: str, says: str) -> None:
    """Encodings that nobody knows, and places beyond any road."""
    file = tmp_path / "r.rou.xml"
    file.write_text(content)
    with pytest.raises(RouteError):
        read_loops(NET, file)
    assert says in refusal(lambda: read_loops(NET, file))


ROBOT = '{"id": "r1", "path": ["a", "b"]}'


@pytest.mark.parametrize(
    "content",
    [
        f'{{"robots": [{ROBOT}], "capacity": {{"a": {BIG}}}}}',
        f'{{"robots": [{ROBOT}], "capacity": {{"a": {"9" * 4000}}}}}',
        f'{{"robots": [{ROBOT[:-1]}, "start": {"9" * 4000}}}]}}',
        '{"robots": [{"id": "r\\ud800", "path": ["a"]}]}',
        '{"robots": [{"id": "r", "path": ["a\\u0000"]}]}',
        '{"robots": ' + "[" * 100_000,
        '{"robots": NaN}',
        f'{{"robots": "{"x" * 5000}"}}',
    ],
)
def test_system_files(tmp_path: Path, content: str) -> None:
    """Numbers of thousands of digits, halves of characters, lists without end."""
    file = tmp_path / "s.json"
    file.write_text(content)
    assert refusal(lambda: read_system(file)).startswith(f"{file}: ")


@pytest.mark.parametrize(
    "line",
    [
        "vehicles = 0x" + "f" * 5000,
        f"vehicles = {BIG}",
        "vehicles = " + "[" * 3000,
        "duration_s = inf",
        "duration_s = nan",
        f"who = 0x{'f' * 4000}",
        "step_s = 1e9",
        'routes = "\\u0000"',
        f'gate = "{"x" * 5000}"',
        f"gate = 0x{'f' * 5000}",
        f"negotiation = 0x{'f' * 5000}",
        'gate = "certifed"',
        'gate = "certified:budgt=3"',
        'gate = "certified:budget=nan"',
        'gate = "algorithm2:lookahead=0"',
        'gate = "agents:loss=2"',
        'negotiation = "presure"',
        'negotiation = "pressure:patience=inf"',
        'negotiation = "pressure:patience=soon"',
        "loop_length_m = [1, 2, 3]",
        "loop_length_m = [1.0, inf]",
        "loop_length_m = {}",
        "positions = 1",
        "u_turns = 1",
        "step_s = 1.5",
        "seed = 2147483648",
        "seed = 1979-05-27",
        '"\\u2028" = 1',
    ],
)
def test_scenarios(tmp_path: Path, line: str) -> None:
    """The same in a scenario file and in the base of a sweep, before anything runs."""
    file = tmp_path / "s.toml"
    file.write_text(f'network = "n.net.xml"\n{line}\n')
    assert refusal(lambda: read_scenario(file)).startswith(f"{file}: ")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[grid]\nseed = [nan]", "nan stands where a finite number is expected"),
        ("[grid]\nseed = { from = 0, to = 99999999999 }", "a range has at most 100000 numbers"),
        (f"[grid]\nseed = {{ from = 0, to = {'9' * 4000} }}", "a range has at most"),
        (
            "[grid]\n" + "\n".join(f"k{n} = {{ from = 1, to = 90 }}" for n in range(4)),
            "it asks for 65610000 runs",
        ),
        ('name = "../../x"', "name is '../../x'; expected the name of a folder"),
        ('name = ".."', "name is '..'"),
        (f'name = "{"x" * 300}"', "up to 100 bytes long"),
        ('name = ""', "name is ''"),
        ("name = 5", "name is 5; expected a text"),
        (f'[base]\nnetwork = "{"x" * 300}"', "there is no such file"),
        ('[base]\nnetwork = "\\u0000"', "there is no such file"),
        ("a = " + "[" * 3000, "not a TOML file"),
        (f'scenario = "{"x" * 300}"', "cannot read the file"),
    ],
)
def test_sweep_files(tmp_path: Path, text: str, says: str) -> None:
    """Nothing is counted out before it is known to be small enough; nothing leaves the results' folder."""
    file = tmp_path / "s.toml"
    file.write_text(text)
    assert says in refusal(lambda: read_sweep(file).points())


def test_sweeps_made_in_python() -> None:
    """Their names are folders too."""
    assert "expected the name of a folder" in refusal(lambda: Sweep("a/b", {}, {"seed": [1]}))


def results(folder: Path, scenario: str = "{}") -> Path:
    """Make a results folder of one row."""
    with Store(folder) as store:
        store.write_manifest({"name": "s"})
        store.add(Result({c.KEY: "k", c.ATTEMPT: 1, c.STATUS: "ok", c.SCENARIO: scenario}))
    return folder


@pytest.mark.parametrize("text", ["", "[]", "5", "[" * 100_000, BIG, "\ud800"])
def test_descriptions_in_results(tmp_path: Path, text: str) -> None:
    """`sweep.json` and the scenario of a row hold JSON objects, or are named."""
    folder = results(tmp_path / "spoiled")
    (folder / "sweep.json").write_text(text, encoding="utf-8", errors="replace")
    assert "sweep.json" in refusal(lambda: read_results(folder))
    if text and text != "\ud800":
        other = results(tmp_path / "row", scenario=text)
        assert "row k" in refusal(lambda: read_results(other))


def test_tables_in_results(tmp_path: Path) -> None:
    """What pandas says of itself is not needed; a row without a key says how to go on, to both readers."""
    folder = results(tmp_path)
    (file,) = (folder / "rows").glob("*.parquet")
    table = pq.read_table(file)
    pq.write_table(table.replace_schema_metadata({"pandas": "{spoiled"}), file)
    assert read_results(folder).runs[c.KEY].tolist() == ["k"]
    frame = table.to_pandas()
    frame[c.KEY] = None
    pq.write_table(table.from_pandas(frame, schema=table.schema), file)
    for text in (refusal(lambda: read_results(folder)), refusal(lambda: Store(folder))):
        assert "a row has no key; remove it and run the same sweep again" in text


def run_folder(folder: Path, **summary: object) -> Path:
    """Make a run folder without a run."""
    folder.mkdir()
    (folder / "scenario.toml").write_text('network = "n"\n')
    figures: dict[str, object] = dict.fromkeys(
        ("loops", "vehicles", "seed", "laps", "distance_km", "laps_per_h", "km_per_h"), 0
    )
    figures |= {"duration_s": 60.0, "network": "n", "gate": "open", "outcome": "completed", "deadlocks": []}
    (folder / "summary.json").write_text(json.dumps(figures | summary))
    Recorder(folder / "events.parquet").close()
    for name, columns in (("vehicles", VEHICLE_COLUMNS), ("edges", EDGE_COLUMNS)):
        pd.DataFrame(columns=list(columns)).to_parquet(folder / f"{name}.parquet")
    return folder


def test_run_folders(tmp_path: Path) -> None:
    """Texts for numbers, lists for objects, columns that are missing: the file is named."""
    whole = run_folder(tmp_path / "whole")
    assert len(read_results(whole).runs) == 1
    assert read_run(whole).summary["loops"] == 0
    assert "no readable" in refusal(lambda: read_results(run_folder(tmp_path / "a", laps="many")))
    assert "no run has that" in refusal(lambda: read_results(run_folder(tmp_path / "c", hold_s=1e308)))
    assert "no readable" in refusal(lambda: read_results(run_folder(tmp_path / "b", duration_s=[])))
    pd.DataFrame({"time_s": ["x"]}).to_parquet(whole / "events.parquet")
    for read in (read_run, read_results):
        assert "events.parquet: it has no column vehicle, event" in refusal(partial(read, whole))
    frame = pd.DataFrame({name: ["x"] for name in EVENT_COLUMNS})
    frame.to_parquet(whole / "events.parquet")
    assert "the column time_s holds" in refusal(lambda: read_events(whole / "events.parquet"))
    (whole / "events.parquet").write_bytes(b"PAR1")
    assert "events.parquet: not a readable Parquet file" in refusal(
        lambda: read_events(whole / "events.parquet")
    )
    (whole / "summary.json").write_text("[]")
    assert "summary.json" in refusal(lambda: read_run(whole))


SYSTEM = system_from_dict(
    {
        "robots": [{"id": "r", "path": ["a", "s"]}, {"id": "q", "path": ["b", "s"]}],
        "fifo": ["s"],
        "capacity": {"s": 2},
    }
)


def test_traces_of_another_system() -> None:
    """Vehicles that no system has, and starts in wrong places, are findings."""
    rows = [
        (0.0, "x", "start", "a"),
        (1.0, "x", "grant", "s"),
        (0.0, "r", "start", "s"),
        (1.0, "r", "grant", "s"),
    ]
    rows += [(2.0, "r", "grant", "a")]
    events = pd.DataFrame([(*row, "", "") for row in rows], columns=list(EVENT_COLUMNS))
    found = audit_events(events, SYSTEM)
    assert {finding.rule for finding in found} >= {"start", "path"}


BODY: dict[str, Any] = {"loop": "l", "length_m": 5, "width_m": 2, "start_m": 0, "leg": 0, "jointed": False}
LEG = {"state": "a", "begin_m": 0, "end_m": 9, "crossings": []}
SPAN = {"begin_m": 0, "end_m": 10, "lanes": ["e_0"], "entered": ""}


@pytest.mark.parametrize(
    "spoil",
    [
        {"step_s": "1"},
        {"step_s": 1e308},
        {"loops": {"l": 5}},
        {"loops": {"l": {"length_m": 10, "spans": [], "legs": []}}},
        {"loops": {"l": {"length_m": 1e9, "spans": [SPAN | {"end_m": 1e9}], "legs": [LEG]}}},
        {
            "vehicles": {
                "v": {"loop": "l", "length_m": 5, "width_m": 2, "start_m": 1e9, "leg": 0, "jointed": False}
            }
        },
        {
            "vehicles": {
                "v": {"loop": "m", "length_m": 5, "width_m": 2, "start_m": 0, "leg": 0, "jointed": False}
            }
        },
        {
            "vehicles": {
                "v": {"loop": "l", "length_m": 5, "width_m": 2, "start_m": 0, "leg": 7, "jointed": False}
            }
        },
        {"room": {"a": "many"}},
        {"room": {"a": 10**20}},
        {"heights": {"e_0": float("nan")}},
        {"heights": {"e_0": "high"}},
        {"heights": []},
        {"shapes": {}},
        {"shapes": {"e_0": [[0, 0]]}},
        {
            "vehicles": {
                "v": {"loop": "l", "length_m": 1e9, "width_m": 2, "start_m": 0, "leg": 0, "jointed": False}
            }
        },
        {
            "vehicles": {
                "v": {"loop": "l", "length_m": 5, "width_m": 1e9, "start_m": 0, "leg": 0, "jointed": False}
            }
        },
        {"vehicles": {"v": BODY | {"jointed": 2}}},
        {"loops": {"l": {"length_m": 10, "spans": [SPAN | {"entered": 5}], "legs": [LEG]}}},
        {"loops": {"l": {"length_m": 10, "spans": [SPAN | {"entered": "e_1"}], "legs": [LEG]}}},
        {"unregulated": ["e_1"]},
        {"bridges": [{"x_m": 0, "y_m": "high", "one": ["e_0"], "other": ["e_1"]}]},
        {"bridges": [{"x_m": 0, "y_m": 0, "one": ["e_0"], "other": []}]},
    ],
)
def test_layouts(tmp_path: Path, spoil: dict[str, Any]) -> None:
    """A start a billion metres off its loop would be walked back lap by lap."""
    loop = {"length_m": 10, "spans": [SPAN], "legs": [LEG]}
    whole = {
        "step_s": 1,
        "room": {},
        "loops": {"l": loop},
        "vehicles": {"v": BODY},
        "movements": {},
        "shapes": {"e_0": [[0, 0], [10, 0]]},
        "heights": {"e_0": 4.5},
        "unregulated": ["e_0"],
        "bridges": [{"x_m": 0, "y_m": 0, "one": ["e_0"], "other": ["e_1"]}],
    }
    file = tmp_path / "layout.json"
    file.write_text(json.dumps(whole))
    assert read_layout(file).step_s == 1
    file.write_text(json.dumps({**whole, **spoil}))
    assert refusal(lambda: read_layout(file)).startswith(f"{file}: no layout of a run")


@pytest.mark.parametrize(
    "spoil",
    [
        {"positions": None},
        {"positions": [[], 0]},
        {"positions": [10**400, 0]},
        {"queues": 5},
        {"kind": []},
        {"verdict": {}},
        {"moves": [["r"]]},
        {"kind": "dead", "verdict": "refused", "proof": [[]]},
        {
            "kind": "dead",
            "verdict": "refused",
            "proof": [{"at": {"r": 0}, "harmless": [["r", 10**12]], "to": 0}],
        },
    ],
)
def test_certificates(spoil: dict[str, Any]) -> None:
    """Whatever stands where something else should; a robot is not driven round for ever."""
    whole = {
        "positions": [0, 0],
        "queues": [[]],
        "robot": "r",
        "verdict": "admitted",
        "kind": "home",
        "moves": ["r", "r"],
    }
    check_certificate(SYSTEM, whole)
    with pytest.raises(CertificateError):
        check_certificate(SYSTEM, {**whole, **spoil})


def test_python_says_the_same_as_files() -> None:
    """A scenario made in Python is checked as one from a file; numpy's numbers are numbers."""
    for given in (
        {"gate": "certifed"},
        {"negotiation": "luck"},
        {"duration_s": float("inf")},
        {"vehicles": 10**21},
    ):
        refusal(partial(Scenario, network="n", **given))
    made = Scenario(network="n", vehicles=pd.Series([3])[0], duration_s=60)
    assert (made.vehicles, type(made.vehicles), type(made.duration_s)) == (3, int, float)


def _without(pattern: str, instead: str = "") -> str:
    return re.sub(pattern, instead, RING)


@pytest.mark.parametrize(
    ("spoiled", "says"),
    [
        (_without(r'    <connection from=":[^>]*/>\n'), "leads nowhere; a <connection from="),
        (_without(r'    <connection from=":D1_0"[^>]*/>\n'), "its internal lane :D1_0_0 leads nowhere"),
        (_without(r'(<connection from=":[^"]*" to=")[^"]*"', r'\1p1a"'), "leads to p1a; a <connection from="),
        (_without(r' via="[^"]*"'), "no connection names the internal lane that it leads over (via)"),
        (_without(r'    <connection from="s1" to="l1"[^>]*/>\n'), "leads over the internal lane :D1_1_0"),
        (_without(r' via=":X12_4_0"'), "no connection leads over the internal lane :X12_4_0"),
        (_without(r'incLanes="p2c_0 l1_0"', 'incLanes=""'), "junction M1: incLanes lacks "),
        (_without(r'(?<=foes="00" )cont="0"', 'cont="true"'), "junction D1: request 0 has cont, but its"),
        (_without(r'intLanes=":X12_0_0 ', 'intLanes="'), "junction X12: 3 lanes in intLanes for 4 requests"),
        (_without(r'    <junction id=":X13_4_0"[^>]*/>\n'), "no internal junction :X13_4_0 between"),
    ],
)
def test_networks_on_which_sumo_ends_by_a_signal(tmp_path: Path, spoiled: str, says: str) -> None:
    """Without a word, and with the process that it is in: so it is found before SUMO starts."""
    file = tmp_path / "n.net.xml"
    file.write_text(spoiled, encoding="utf-8")
    text = refusal(lambda: RoadNetwork.open(file))
    assert text.startswith(f"{file}: ")
    assert says in text
