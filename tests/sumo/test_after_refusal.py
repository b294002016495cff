"""A simulation after others that SUMO refused, in the same process: as in a fresh one."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from loopgate.errors import TrafficError
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.traffic import libsumo_backend

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
GRID = ROOT / "networks" / "grid5-priority.net.xml"
NET = GRID.read_text(encoding="utf-8")
RING = (ROOT / "networks" / "ring3.net.xml").read_text(encoding="utf-8")
SPOILED = {
    "cut.net.xml": NET[: len(NET) // 2],
    "end.net.xml": NET.replace(' to="A1"', ' to="nowhere"', 1),
    "inside.net.xml": re.sub(r'    <connection from=":A1_0"[^>]*/>\n', "", NET),
    "cut.rou.xml": '<routes><vehicle id="a" depa',
    "way.rou.xml": '<routes><vehicle id="a" depart="0"><route edges="none"/></vehicle></routes>',
    "late.rou.xml": '<routes><vehicle id="a" depart="999"><route edges="none"/></vehicle></routes>',
    "kind.rou.xml": '<routes><vType id="k"/><vType id="k"/></routes>',
    "light.add.xml": '<additional><tlLogic id="none" programID="x"><phase duration="3" state="G"/></tlLogic>'
    "</additional>",
    "sign.add.xml": '<additional><variableSpeedSign id="s" lanes="none_0"/></additional>',
    "line.add.xml": '<additional><inductionLoop id="d" lane="A0A1_0" pos="9999" period="9" file="/no/x"/>'
    "</additional>",
}
KINDS = {".net.xml": "--net-file", ".rou.xml": "--route-files", ".add.xml": "--additional-files"}


def positions(folder: Path) -> str:
    """Return where thirty vehicles are in each second of a minute."""
    file = folder / "fcd.xml"
    routes = ROOT / "routes" / "grid5.rou.xml"
    sumo = libsumo_backend.start(
        ["--net-file", str(GRID), "--route-files", str(routes), "--no-step-log", "--fcd-output", str(file)]
    )
    for number in range(30):
        sumo.vehicle.add(f"v{number}", f"loop{number}")
    for _ in range(60):
        sumo.simulationStep()
    libsumo_backend.close()
    return re.sub("<!--.*?-->", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.spoils_libsumo
def test_what_sumo_refused_leaves_nothing_behind(tmp_path: Path) -> None:
    """Each spoiled input by itself, and one after the other."""
    fresh = positions(tmp_path)
    refused = 0
    for name, text in SPOILED.items():
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        option = KINDS[name[name.index(".") :]]
        network = [] if option == "--net-file" else ["--net-file", str(GRID)]
        try:
            sumo = libsumo_backend.start([*network, option, str(file), "--no-step-log", "--no-warnings"])
        except libsumo_backend.ERROR:
            refused += 1
        else:
            sumo.simulationStep()
            libsumo_backend.close()
        assert positions(tmp_path) == fresh, name
    assert refused > len(SPOILED) // 2


TWICE = re.sub(r'(    <connection from="p3a" to="p3b"[^>]*/>\n)', r"\1\1", RING)
"""SUMO stops in the middle of this: an internal lane has two predecessors."""
RUNS = """
import json, sys
from loopgate import Scenario
from loopgate.errors import TrafficError
from loopgate.simulation.run import simulate

def told(network):
    summary = simulate(Scenario(network=network, loops=2, vehicles=4, duration_s=60.0))
    volatile = ("wall_s", "decision_us", "stage_us", "command")
    return {name: value for name, value in summary.items() if name not in volatile}

*refused, good = sys.argv[1:]
for name in refused:
    try:
        told(name)
    except TrafficError as error:
        assert "2 predecessors" in str(error), error
    else:
        raise SystemExit("not refused")
print(json.dumps([told(good), told(good)]))
"""


def test_no_run_uses_what_sumo_left_of_a_network(tmp_path: Path) -> None:
    """The process would end by a signal in the run that follows."""
    (tmp_path / "twice.net.xml").write_text(TWICE, encoding="utf-8")
    good = str(ROOT / "networks" / "ring3.net.xml")
    told = []
    for refused in ([], [str(tmp_path / "twice.net.xml")] * 2):
        command = [sys.executable, "-c", RUNS, *refused, good]
        done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, (refused, done.returncode, done.stderr)
        told += json.loads(done.stdout)
    assert told == told[:1] * 4


REFUSED = [
    ("twice", "", "lane ':X23_0_0' has 2 predecessors"),
    ("ring3", "--no-such 3", "options --no-such 3"),
    ("ring3", "--summary-output no/such/file", "Could not build output file 'no/such/file'"),
]


@pytest.mark.parametrize(
    ("network", "more", "says", "backend"),
    [
        *(pytest.param(*case, "traci") for case in REFUSED),
        pytest.param(*REFUSED[1], "libsumo"),
        *(pytest.param(*REFUSED[k], "libsumo", marks=pytest.mark.spoils_libsumo) for k in (0, 2)),
    ],
)
def test_sumo_says_why_it_does_not_start(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], network: str, more: str, says: str, backend: str
) -> None:
    """In the error, and nowhere else: SUMO answers a connection before it has read its input."""
    file = tmp_path / f"{network}.net.xml"
    file.write_text(TWICE if network == "twice" else RING, encoding="utf-8")
    scenario = Scenario(network=str(file), loops=2, vehicles=2, duration_s=5.0, sumo=more)
    with pytest.raises(TrafficError, match=f"SUMO does not start: .*{re.escape(says)}"):
        simulate(scenario, backend=backend)
    assert "Error" not in capfd.readouterr().err
