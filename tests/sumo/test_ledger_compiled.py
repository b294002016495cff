"""The ledger compiled ahead of time by mypyc: it drives as the plain source does, event by event."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from compiled_wheel import compile_copy

ROOT = Path(__file__).resolve().parents[2]
DRIVE = """
import sys
import heart
from loopgate.control import ledger
from loopgate.simulation.assembly import assemble
from loopgate.simulation.scenario import Scenario
net, trips, events = sys.argv[1:]
heart.draw_trips(net, 3.0, 120.0, 1, trips)
made = Scenario(
    network=net, vehicles=60, loops=20, duration_s=120, lights="obey", traffic=trips, spacing="hold",
    on_deadlock="continue", seed=1,
)
heart.drive(made, assemble(made)).events.to_csv(events, index=False)
print(ledger.__file__)
"""


@pytest.mark.slow
@pytest.mark.skipif(not (find_spec("mypyc") and shutil.which("cc")), reason="needs mypyc and a compiler")
def test_compiled_it_drives_as_plain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lights, ordinary traffic and spacing in a town; compiled in a copy of the source."""
    monkeypatch.setenv("MYPYC_OPT_LEVEL", "0")
    compile_copy(tmp_path)
    told = {}
    for kind, source in (("plain", ROOT / "src"), ("compiled", tmp_path)):
        paths = os.pathsep.join((str(source), str(ROOT / "analysis")))
        words = ("sumo:DRT", str(tmp_path / "trips.rou.xml"), str(tmp_path / f"{kind}.csv"))
        done = subprocess.run(
            [sys.executable, "-c", DRIVE, *words],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": paths},
        )
        told[kind] = done.stdout.strip()
        said = subprocess.run(
            [sys.executable, "-m", "loopgate", "--version"],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": paths},
        )
        assert f", {kind} ledger" in said.stdout
    assert told["plain"].endswith("ledger.py")
    assert not told["compiled"].endswith(".py")
    plain, compiled = ((tmp_path / f"{kind}.csv").read_text() for kind in told)
    assert plain == compiled
    assert "traffic" in plain
