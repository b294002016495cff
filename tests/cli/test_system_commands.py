"""The commands on system files: explore, trace, montecarlo."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import pytest
from command import loopgate as run

INSTANCES = files("loopgate.research.theory.instances")


def run_json(*arguments: str) -> Any:  # noqa: ANN401 - whatever the command prints
    """Return what the command prints as JSON."""
    done = run(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_explore_prints_the_keys_that_are_promised() -> None:
    """All keys, and the figures of Fig. 8 under its own gate."""
    found = run_json("study", "explore", str(INSTANCES / "fig8.json"), "--gate", "algorithm2")
    assert list(found) == [
        "configurations",
        "transitions",
        "live",
        "deadlocks",
        "higher_order",
        "stuck",
        "unsafe_admitted",
        "seconds",
    ]
    assert (found["configurations"], found["live"], found["stuck"], found["unsafe_admitted"]) == (
        288,
        288,
        0,
        0,
    )


def test_explore_shows_a_shortest_counterexample() -> None:
    """Eight moves lead Algorithm 2 into an inevitable deadlock."""
    found = run_json(
        "study", "explore", str(INSTANCES / "unsound_n5.json"), "--gate", "algorithm2", "--counterexample"
    )
    assert found["unsafe_admitted"] == 1
    assert found["counterexample"]["kind"] == "unsafe"
    assert len(found["counterexample"]["moves"]) == 8


def test_trace_says_who_is_refused_and_why() -> None:
    """The first two steps of the printed evolution."""
    steps = run_json(
        "study", "trace", str(INSTANCES / "fig10.json"), "--gate", "algorithm2", "--moves", "r3,r7"
    )
    assert [step["step"] for step in steps] == [0, 1, 2]
    assert steps[0]["admitted"] == ["r3", "r5", "r6", "r7", "r8"]
    assert steps[1]["admitted"] == ["r2", "r5", "r6", "r7", "r8"]
    first = steps[0]["refused"]
    assert first["r1"]["reason"] == "deadlock"
    assert first["r1"]["order"] == 5
    assert len(first["r1"]["circuit"]) == 8
    assert first["r2"]["reason"] == first["r4"]["reason"] == "occupied"
    assert first["r5"]["reason"] == "negotiation"
    assert " ".join(steps[2]["configuration"]) == "s1 s6 s5 s10 s11 s12 s3 s14"


def test_trace_refuses_a_move_that_the_gate_refuses() -> None:
    """One line that says which move and why; exit code 2."""
    done = run("study", "trace", str(INSTANCES / "fig10.json"), "--gate", "algorithm2", "--moves", "r1")
    assert done.returncode == 2
    assert done.stdout == ""
    assert "move 1: robot r1 is refused: deadlock (order-5 deadlock" in done.stderr
    assert done.stderr.count("\n") == 1


def test_montecarlo() -> None:
    """Same seed, same rounds; under Algorithm 2 all live, each of 27 transitions."""
    file = str(INSTANCES / "fig10.json")
    gated = run_json("study", "montecarlo", file, "--gate", "algorithm2", "--rounds", "20", "--seed", "3")
    assert (gated["live"], gated["deadlocked"], gated["stuck"]) == (20, 0, 0)
    assert gated["transitions"] == {"mean": 27.0, "min": 27, "max": 27}
    assert set(gated["decision_us"]) == {f"r{k}" for k in range(1, 9)}
    first, second = (run_json("study", "montecarlo", file, "--rounds", "50", "--seed", "3") for _ in range(2))
    assert first["live"] == second["live"] < 50
    assert (first["deadlocked"], first["stuck"]) == (50 - first["live"], 0)
    assert first["confidence"][0] < first["live_rate"] < first["confidence"][1]


@pytest.mark.parametrize("command", ["explore", "trace", "montecarlo"])
def test_bad_file(command: str) -> None:
    """A missing file: one line, exit code 2."""
    done = run("study", command, "missing.json")
    assert done.returncode == 2
    assert done.stderr == "loopgate: missing.json: cannot read the system file (No such file or directory)\n"
