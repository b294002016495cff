"""Runs in SUMO of configurations, additional files and includes that were spoiled; and runs after these."""

from __future__ import annotations

import contextlib
import gzip
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from random import Random
from typing import Any

from fuzz_readers import NETWORK, ROUTES, Reader

from loopgate import Scenario
from loopgate.errors import LoopgateError
from loopgate.network import RoadNetwork, read_loops
from loopgate.network.additional import demand_beside, type_names
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate
from loopgate.simulation.sumo_options import sumo_options
from loopgate.sweep.files import file_identity

_VOLATILE = ("wall_s", "decision_us", "stage_us", "versions", "command")
"""What differs from one run to the next."""

CONFIGURATION = """<configuration>
    <input>
        <net-file value="n.net.xml"/>
        <route-files value="r.rou.xml,t.rou.xml"/>
        <additional-files value="a.add.xml"/>
    </input>
    <time><begin value="0"/><end value="30"/><step-length value="1"/></time>
    <processing><time-to-teleport value="-1"/><ignore-route-errors value="true"/></processing>
    <report><verbose value="true"/><duration-log.statistics value="true"/></report>
</configuration>
"""
ADDITIONAL = """<additional>
    <vType id="lorry" vClass="truck" length="9" accel="1.1" guiShape="truck"/>
    <include href="i.add.xml"/>
    <busStop id="stop1" lane="p1b_0" startPos="10" endPos="30" lines="1 2"/>
    <parkingArea id="park1" lane="p2b_0" startPos="5" endPos="40" roadsideCapacity="3" angle="90"/>
    <rerouter id="anew" edges="s1">
        <interval begin="0" end="60"><destProbReroute id="l1"/></interval>
    </rerouter>
    <calibrator id="cal" edge="p1a" pos="0" freq="10" output="nul">
        <flow begin="0" end="9" speed="9"/>
    </calibrator>
    <e1Detector id="det" lane="p1b_0" pos="9" freq="60" file="nul"/>
    <variableSpeedSign id="slow" lanes="l2_0"><step time="5" speed="5"/></variableSpeedSign>
    <poly id="house" color="red" shape="0,0 9,0 9,9"/><poi id="tree" x="3" y="4" color="green"/>
    <edgeData id="all" freq="30" file="nul"/>
</additional>
"""
INCLUDED = """<additional>
    <include href="deep/j.add.xml"/>
    <route id="around" edges="p1b p1c s1 l1 s2 p1a"/>
    <trip id="late" type="lorry" depart="2" from="p2b" to="s2"/>
    <vType id="tram" vClass="tram" length="20"/>
    <chargingStation id="charge" lane="p3b_0" startPos="0" endPos="9" power="100"/>
</additional>
"""
DEEPER = """<additional>
    <flow id="more" type="lorry" begin="0" end="20" period="9" from="p3b" to="s3"/>
    <containerStop id="box" lane="p1c_0" startPos="1" endPos="9"/>
</additional>
"""
TRIPS = """<routes>
    <include href="k.rou.xml"/>
    <trip id="a" depart="0" from="p1b" to="s1"><stop lane="s1_0" endPos="20" duration="3"/></trip>
    <vehicle id="b" depart="3"><route edges="p2b p2c s2"/></vehicle>
    <flow id="c" begin="0" end="20" number="3" from="p3b" to="s3"/>
</routes>
"""
MORE_TRIPS = """<routes>
    <vType id="slow" maxSpeed="7"/>
    <trip id="d" type="slow" depart="4" from="p1b" to="s2"/>
</routes>
"""
FILES = ("c.sumocfg", "a.add.xml", "i.add.xml", "deep/j.add.xml", "t.rou.xml", "k.rou.xml", "r.rou.xml")


def make_runs(folder: Path) -> None:
    """Make the valid inputs, and what comes of a run after which nothing else was run.

    Raises
    ------
    AssertionError
        If the valid configuration is refused.
    """
    place = folder / "driven"
    (place / "deep").mkdir(parents=True)
    shutil.copy(NETWORK, place / "n.net.xml")
    texts = (CONFIGURATION, ADDITIONAL, INCLUDED, DEEPER, TRIPS, MORE_TRIPS, ROUTES)
    for name, text in zip(FILES, texts, strict=True):
        (place / name).write_text(text, encoding="utf-8")
    (place / "z.add.xml.gz").write_bytes(gzip.compress(DEEPER.replace("more", "z").encode()))
    with contextlib.chdir(place):
        alone = _told(simulate(_valid(place)))
        for gate in ("certified", "open"):
            simulate(_spoiled(place, gate))
    (place / "alone.json").write_text(json.dumps(alone), encoding="utf-8")


def _valid(folder: Path) -> Scenario:
    routes = {"network": str(NETWORK), "routes": str(folder / "valid.rou.xml"), "duration_s": 20.0}
    if not (folder / "valid.rou.xml").exists():
        (folder / "valid.rou.xml").write_text(ROUTES, encoding="utf-8")
    return Scenario.from_dict(routes)


def _spoiled(folder: Path, gate: str) -> Scenario:
    given = {"network": str(folder / "c.sumocfg"), "gate": gate, "duration_s": 6.0}
    return Scenario.from_dict(given)


def _told(summary: Mapping[str, Any]) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(json.dumps({k: v for k, v in summary.items() if k not in _VOLATILE}))
    return told


def _read(folder: Path, random: Random) -> None:
    del random
    files = [folder / "a.add.xml", folder / "z.add.xml.gz"]
    type_names(files)
    demand_beside(files, [])
    file_identity("c.sumocfg", "network", folder)
    read_loops(RoadNetwork.open(NETWORK), folder / "t.rou.xml", once=True)
    sumo_options(_spoiled(folder, "open"))


def _assembled(folder: Path, random: Random) -> None:
    assemble(_spoiled(folder, random.choice(("certified", "open", "collision"))))


def _driven(folder: Path, random: Random) -> None:
    simulate(_spoiled(folder, random.choice(("certified", "certified", "open"))))


def _after(folder: Path, random: Random) -> None:
    """Make a run that is the same as ever after one that may have been refused, in one process."""
    refused: LoopgateError | None = None
    try:
        _driven(folder, random)
    except LoopgateError as error:
        refused = error
    alone = json.loads((folder / "alone.json").read_text(encoding="utf-8"))
    again = _told(simulate(_valid(folder)))
    if again != alone:
        other = [name for name in alone if again.get(name) != alone[name]]
        msg = f"a run after another is not as it is alone, in {other}"
        raise AssertionError(msg)
    if refused is not None:
        raise refused


RUNS = (
    Reader("additional, includes", 20, "driven", FILES, _read),
    Reader("configuration, whole", 3, "driven", FILES, _assembled),
    Reader("configuration, run", 3, "driven", FILES, _driven),
    Reader("two runs", 2, "driven", FILES, _after),
)
"""What SUMO is given, a file of it spoiled at a time."""
