"""Every reader of the package, with valid inputs to spoil for it."""

from __future__ import annotations

import contextlib
import gzip
import io
import json
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from random import Random

from fuzz_mutations import NASTY, spoiled_word

from loopgate import Scenario, Sweep, read_results, read_run, read_scenario, read_sweep, run, run_sweep
from loopgate.abstraction.queue_survey import survey_queues
from loopgate.abstraction.queues import make_queues
from loopgate.audit import audit_events, audit_positions, read_layout
from loopgate.cli.check_certificate import check_certificate
from loopgate.cli.verify import verify
from loopgate.gates import check_gate, make_gate
from loopgate.model import read_system, system_to_dict, write_system
from loopgate.negotiation.registry import check_negotiation
from loopgate.network import RoadNetwork, generate_loops, read_loops
from loopgate.network.cover.wishes import read_districts, read_streets, read_weights
from loopgate.network.sumo_config import read_sumo_config
from loopgate.network.traffic_file import read_traffic
from loopgate.replay.scene import load_scene
from loopgate.research.theory.instances import instance
from loopgate.results.recorder import read_events
from loopgate.simulation.sumo_options import sumo_options
from loopgate.sweep.execution import Store

ROOT = Path(__file__).resolve().parent.parent
NETWORK = ROOT / "networks" / "ring3.net.xml"

ROUTES = """<?xml version="1.0" encoding="UTF-8"?>
<routes>
    <vType id="car" length="5" minGap="2.5" accel="2.6" decel="4.5" sigma="0.5" tau="1.0" maxSpeed="30"/>
    <vType id="van" vClass="delivery" width="2.1" speedFactor="normc(1,0.1,0.2,2)" jmDriveAfterRedTime="-1"/>
    <route id="loop1" edges="p1b p1c s1 l1 s2 p1a"/>
    <route id="loop2" edges="p2b p2c s2 l2 s3 p2a p2b"/>
    <vehicle id="one" type="car" route="loop1" depart="0" departPos="20" departEdge="1"/>
    <flow id="two" type="van" route="loop2" begin="0" end="10" number="1"/>
    <vehicle id="three" depart="0"><route edges="p3b p3c s3 l3 s1 p3a"/></vehicle>
</routes>
"""
TRAFFIC = """<routes>
    <vType id="bus" vClass="bus" length="12"/>
    <trip id="a" type="bus" depart="0" from="p1b" to="s1"/>
    <vehicle id="b" depart="3"><route edges="p2b p2c s2"/></vehicle>
    <flow id="c" begin="0" end="60" period="10" from="p3b" to="s3"/>
</routes>
"""
CONFIGURATION = """<configuration>
    <input><net-file value="n.net.xml"/><route-files value="r.rou.xml"/></input>
    <time><begin value="0"/><end value="60"/></time>
</configuration>
"""
DISTRICTS = """<additional>
    <poly id="all of it" color="red" shape="-900,-900 900,-900 900,900 -900,900"/>
    <poly id="near" shape="-900,-900,0 900,-900,0 0,900,0"/>
</additional>
"""
WISHES = "# twice as often\np1b 2\ns1 1.5\n\nl1 1000\n"
STREETS = "edge:p1b\nedge:s1 p2b\njunction:x\n"
WORDS = (
    "--fcd-output.attributes x,y --device.rerouting.probability 0 --scale=1 --tls.actuated.jam-threshold 10",
    '--lateral-resolution 0.8 --summary-output "s 1.xml" --ignore-route-errors true',
)
SWEEP = """name = "small"
scenario = "base.toml"
[base]
network = "n.net.xml"
duration_s = 60
[grid]
gate = ["certified", "open", "algorithm2:lookahead=2"]
vehicles = [3, 2]
seed = { from = 0, to = 2 }
[[exclude]]
gate = "open"
vehicles = [2]
[[include]]
gate = "collision"
negotiation = "pressure:patience=50"
"""


@dataclass(frozen=True, slots=True)
class Reader:
    """A reader.

    Attributes
    ----------
    name
        For the table.
    share
        Of all inputs, relative to the other readers.
    folder
        The folder of inputs that it works in.
    files
        Those of its files that are spoiled, one at a time; patterns.
    read
        Reads the folder; the numbers are the input's, for what is not in a file.
    """

    name: str
    share: int
    folder: str
    files: tuple[str, ...]
    read: Callable[[Path, Random], object]


def make_inputs(folder: Path) -> None:
    """Make the valid inputs: this runs SUMO for a few simulated minutes."""
    for name in ("network", "packed", "routes", "configured", "scenario", "system", "sweep", "plugins"):
        (folder / name).mkdir(parents=True)
    shutil.copy(NETWORK, folder / "network" / "n.net.xml")
    (folder / "packed" / "n.net.xml.gz").write_bytes(gzip.compress(NETWORK.read_bytes(), 1))
    (folder / "routes" / "r.rou.xml").write_text(ROUTES, encoding="utf-8")
    (folder / "routes" / "t.rou.xml").write_text(TRAFFIC, encoding="utf-8")
    for name in ("configured", "sweep"):
        shutil.copy(NETWORK, folder / name / "n.net.xml")
        (folder / name / "r.rou.xml").write_text(ROUTES, encoding="utf-8")
    (folder / "wishes").mkdir()
    (folder / "wishes" / "d.add.xml").write_text(DISTRICTS, encoding="utf-8")
    (folder / "wishes" / "weights.txt").write_text(WISHES, encoding="utf-8")
    (folder / "wishes" / "streets.txt").write_text(STREETS, encoding="utf-8")
    (folder / "configured" / "c.sumocfg").write_text(CONFIGURATION, encoding="utf-8")
    (folder / "sweep" / "s.toml").write_text(SWEEP, encoding="utf-8")
    (folder / "sweep" / "base.toml").write_text('routes = "r.rou.xml"\nstep_s = 1.0\n', encoding="utf-8")
    scenario = Scenario(network=str(NETWORK), routes=str(folder / "routes" / "r.rou.xml"), duration_s=90.0)
    scenario.write(folder / "scenario" / "s.toml")
    write_system(instance("fig8"), folder / "system" / "s.json", note="the paper's")
    queues = {**system_to_dict(instance("fig8")), "capacity": {"s1": 2}, "fifo": ["s1"]}
    with contextlib.suppress(KeyError):
        (folder / "system" / "q.json").write_text(json.dumps(queues), encoding="utf-8")
    run(Scenario(**{**scenario.to_dict(), "positions": True}), folder / "run")
    for name, gate in (("one", "certified"), ("two", "open")):
        run(Scenario(**{**scenario.to_dict(), "gate": gate, "duration_s": 60.0}), folder / "runs" / name)
    sweep = Sweep("s", {"network": str(NETWORK), "duration_s": 60.0}, {"vehicles": [2, 3], "seed": [1, 2]})
    run_sweep(sweep, folder / "results", executor=ThreadPoolExecutor(1))
    (folder / "certificates").mkdir()
    certificates = folder / "certificates" / "c.jsonl"
    with contextlib.redirect_stdout(io.StringIO()):
        verify.main(
            ["--random", "8", "--certificates", str(certificates), "--limit", "200"], standalone_mode=False
        )
    kept = certificates.read_bytes().splitlines()[:400]
    certificates.write_bytes(b"\n".join(kept))


def _network(folder: Path, random: Random) -> None:
    roads = RoadNetwork.open(next(folder.glob("n.net.xml*")))
    loops = generate_loops(roads, 2, length_m=(100.0, 600.0), seed=random.randrange(9))
    kinds = read_loops(roads, _WITH_TYPES).robot_types()
    survey_queues(roads, [(loop, kinds[0]) for loop in loops])
    make_queues(roads, loops, kinds[: len(loops)], seed=1)


def _routes(folder: Path, random: Random) -> None:
    del random
    file = read_loops(_roads(), folder / "r.rou.xml")
    names, loops, starts_m = file.robots()
    file.longest_vehicle()
    survey_queues(_roads(), list(zip(loops, file.robot_types(), strict=True)))
    make_queues(_roads(), loops, file.robot_types(), seed=1, names=names, starts_m=starts_m)


def _configured(folder: Path, random: Random) -> None:
    del random
    config = read_sumo_config(folder / "c.sumocfg")
    roads = RoadNetwork.open(folder / "c.sumocfg")
    read_loops(roads, folder / "c.sumocfg")
    read_traffic(folder / "c.sumocfg").options()
    Path(config.net_file)


def _options(folder: Path, random: Random) -> None:
    del random
    sumo_options(Scenario(network=str(folder / "c.sumocfg")))


def _words(folder: Path, random: Random) -> None:
    words = random.choice(WORDS).split(" ")
    place = random.randrange(len(words))
    words[place] = spoiled_word(words[place], random)
    given = {"network": str(folder / "c.sumocfg"), "sumo": " ".join(words)}
    sumo_options(Scenario.from_dict(given, source="words"))


def _wishes(folder: Path, random: Random) -> None:
    del random
    read_weights(_roads(), str(folder / "weights.txt"))
    read_districts(_roads(), str(folder / "d.add.xml"), ["passenger"])
    for name in ("d.add.xml", "streets.txt"):
        read_streets(_roads(), str(folder / name), "passenger", option="--cover")


def _corners(folder: Path, random: Random) -> None:
    del folder
    corners = spoiled_word("-900,-900 900,-900 900,900 -900,900", random)
    read_streets(_roads(), corners, "passenger", option="--cover")


def _scenario(folder: Path, random: Random) -> None:
    del random
    scenario = read_scenario(folder / "s.toml")
    scenario.command("out")
    scenario.write(folder / "again.toml")


def _values(folder: Path, random: Random) -> None:
    del folder
    given: dict[str, object] = {"network": "n"}
    keys = list(Scenario(network="n").to_dict())
    for _ in range(random.choice((1, 1, 2))):
        given[random.choice((*keys, "duration", "x"))] = random.choice(NASTY)
    Scenario.from_dict(given, source="values").command("out")


def _system(folder: Path, random: Random) -> None:
    del random
    for file in sorted(folder.glob("*.json")):
        system = read_system(file)
        gate = make_gate("collision", system)
        for robot in range(len(system.robots)):
            gate.decide(system.initial, robot)


def _sweep(folder: Path, random: Random) -> None:
    del random
    for point in read_sweep(folder / "s.toml").points()[:50]:
        Scenario.from_dict(dict(point.scenario), source=str(folder / "s.toml"))


def _run(folder: Path, random: Random) -> None:
    del random
    read_run(folder)
    read_results(folder)


def _trace(folder: Path, random: Random) -> None:
    del random
    system = read_system(folder / "system.json")
    events = read_events(folder / "events.parquet")
    audit_events(events, system)
    layout = read_layout(folder / "layout.json")
    audit_positions(folder / "positions.csv.gz", layout, events)


def _replay(folder: Path, random: Random) -> None:
    del random
    (folder / "positions.csv.gz").unlink(missing_ok=True)
    load_scene(folder)


def _store(folder: Path, random: Random) -> None:
    del random
    with Store(folder) as store:
        len(store)


def _certificates(folder: Path, random: Random) -> None:
    del random
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        check_certificate.main([str(folder / "c.jsonl"), "--json"], standalone_mode=False)


def _names(folder: Path, random: Random) -> None:
    del folder
    gates = (
        "certified:budget=5,patience=3,promise=auto,budget_ms=1.5",
        "algorithm2:lookahead=2",
    )
    negotiations = ("pressure:crowded=0.5,patience=3", "oldest", "random")
    if random.random() < 0.5:  # noqa: PLR2004  half of them
        check_gate(spoiled_word(random.choice(gates), random))
    else:
        check_negotiation(spoiled_word(random.choice(negotiations), random))


_WITH_TYPES = ROOT / "routes" / "ring3.rou.xml"
_KEPT: list[RoadNetwork] = []


def _roads() -> RoadNetwork:
    if not _KEPT:
        _KEPT.append(RoadNetwork.open(NETWORK))
    return _KEPT[0]


READERS = (
    Reader("network", 20, "network", ("n.net.xml",), _network),
    Reader("network, gzipped", 8, "packed", ("n.net.xml.gz",), _network),
    Reader("routes", 14, "routes", ("r.rou.xml",), _routes),
    Reader("traffic", 6, "routes", ("t.rou.xml",), lambda f, _: read_traffic(f / "t.rou.xml")),
    Reader("configuration", 7, "configured", ("c.sumocfg",), _configured),
    Reader("options of SUMO", 6, "configured", ("c.sumocfg",), _options),
    Reader("words to SUMO", 3, "configured", (), _words),
    Reader("streets, weights", 8, "wishes", ("*.xml", "*.txt"), _wishes),
    Reader("polygons", 2, "wishes", (), _corners),
    Reader("scenario file", 14, "scenario", ("s.toml",), _scenario),
    Reader("scenario values", 8, "scenario", (), _values),
    Reader("system file", 14, "system", ("*.json",), _system),
    Reader("sweep file", 12, "sweep", ("s.toml", "base.toml"), _sweep),
    Reader("sweep results", 12, "results", ("sweep.json", "rows/*", "edges/*"), lambda f, _: read_results(f)),
    Reader("results store", 4, "results", ("rows/*",), _store),
    Reader("run folder", 10, "run", ("summary.json", "scenario.toml", "*.parquet"), _run),
    Reader("trace and layout", 9, "run", ("layout.json", "events.parquet", "positions.csv.gz"), _trace),
    Reader("replay", 9, "run", ("layout.json", "events.parquet", "fronts.parquet"), _replay),
    Reader("certificates", 10, "certificates", ("c.jsonl",), _certificates),
    Reader("gates, negotiations", 4, "scenario", (), _names),
)
