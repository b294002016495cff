"""A simulation after others that SUMO refused, in the same process: as in a fresh one."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from loopgate.traffic import libsumo_backend

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
GRID = ROOT / "networks" / "grid5-priority.net.xml"
NET = GRID.read_text(encoding="utf-8")
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
