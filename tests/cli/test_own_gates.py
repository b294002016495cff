"""Gates and negotiations of a user's own that fail in the middle of a run: one line; the rest is readable."""

import json
from pathlib import Path

import pytest
from command import loopgate

from loopgate.runs.results import read_results

OWN = """
from loopgate.gates.collision import CollisionGate

class Late(CollisionGate):
    left = 40
    def decide(self, configuration, robot):
        self.left -= 1
        if self.left < 0:
            raise SystemExit(0)
        return super().decide(configuration, robot)

class Twice:
    def __init__(self, rng):
        self.left = 30
    def order(self, requests, view, now_s):
        self.left -= 1
        return requests if self.left > 0 else [requests[0]] * 2
"""
RUN = ("run", "networks/order2.net.xml", "--routes", "routes/order2.rou.xml", "--abstraction", "segments")


@pytest.mark.parametrize(
    ("kind", "name", "says"),
    [
        (
            "gate",
            "Late",
            "decide raised SystemExit: 0 (own.py, line 9); expected a Decision (loopgate.gates.",
        ),
        ("negotiation", "Twice", "order returned Request("),
    ],
)
def test_one_that_fails_in_the_middle(kind: str, name: str, says: str, tmp_path: Path) -> None:
    """Whatever it raises, the run ends with exit code 2; summary and tables hold what was until then."""
    file, out = tmp_path / "own.py", tmp_path / "out"
    file.write_text(OWN, encoding="utf-8")
    ended = loopgate(*RUN, f"--{kind}", f"{file}:{name}", "-o", out)
    assert (ended.returncode, ended.stdout) == (2, "")
    lines = ended.stderr.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"loopgate: {kind} {file}:{name}: ")
    assert says in lines[0]
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert (summary["outcome"], f"loopgate: {summary['fault']}") == ("interrupted", lines[0])
    assert 10.0 < summary["duration_s"] < 3600.0
    assert summary["laps"] > 0
    assert read_results(out).runs["laps"].to_list() == [summary["laps"]]


def test_one_that_fails_when_it_is_made(tmp_path: Path) -> None:
    """Nothing is run, and no folder is made."""
    file = tmp_path / "own.py"
    file.write_text("import sys\nsys.exit('not today')\n", encoding="utf-8")
    ended = loopgate(*RUN, "--gate", f"{file}:Mine", "-o", tmp_path / "out")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.splitlines() == [
        f"loopgate: loopgate run: gate {file}:Mine: the file fails (SystemExit: not today)"
    ]
    assert not (tmp_path / "out" / "summary.json").exists()
