"""`loopgate study verify` says whether a gate keeps its promise, by words, figures and exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from loopgate.cli.main import cli
from loopgate.errors import LoopgateError
from loopgate.model import write_system
from loopgate.research.theory.instances import instance
from loopgate.research.theory.random_systems import random_system, sparse

_RUN = CliRunner()


def _file(tmp_path: Path, name: str) -> str:
    write_system(instance(name), tmp_path / "system.json")
    return str(tmp_path / "system.json")


@pytest.mark.parametrize("name", ["unsound_n5", "blocked_n6"])
def test_certified_is_safe_and_as_permissive_as_can_be(tmp_path: Path, name: str) -> None:
    """On both counterexamples to Algorithm 2, explored to the end: safe, never stuck, all reached."""
    result = _RUN.invoke(cli, ["study", "verify", _file(tmp_path, name), "--json"])
    found = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (found["unsafe_admitted"], found["stuck"], found["budget_stops"]) == (0, 0, 0)
    assert found["method"] == "exhaustive"
    assert found["permissiveness"] == found["coverage"] == 1.0


def test_finds_the_move_that_algorithm_2_should_not_admit(tmp_path: Path) -> None:
    """Algorithm 2 admits an unsafe move in the five-robot system; a shortest way to it is printed."""
    result = _RUN.invoke(cli, ["study", "verify", _file(tmp_path, "unsound_n5"), "--gate", "algorithm2"])
    assert result.exit_code == 1
    line = next(line for line in result.stdout.splitlines() if line.startswith("unsafe   "))
    moves = line.removeprefix("unsafe").strip().removeprefix("after ").split(":")[0].split()
    assert len(moves) == 8
    assert moves[-1] == "r5"


def test_random_systems() -> None:
    """Random systems are judged one by one and counted together."""
    result = _RUN.invoke(cli, ["study", "verify", "--random", "8", "--seed", "3", "--steps", "20", "--json"])
    found = json.loads(result.stdout)
    assert result.exit_code == 0
    assert found["systems"] == 8
    assert found["permissiveness"] == 1.0


def test_a_gate_that_looks_nowhere_is_caught() -> None:
    """The collision gate admits moves into deadlocks."""
    result = _RUN.invoke(
        cli, ["study", "verify", "--random", "20", "--gate", "collision", "--steps", "20", "--json"]
    )
    found = json.loads(result.stdout)
    assert result.exit_code == 1
    assert found["unsafe_admitted"] > 0
    assert found["counterexample"]["kind"] in {"unsafe", "stuck"}


def test_large_systems_are_walked(tmp_path: Path) -> None:
    """Where exploring does not fit, walks are judged by the search for a way home."""
    write_system(random_system(sparse(16), 1), tmp_path / "large.json")
    arguments = [
        "study",
        "verify",
        str(tmp_path / "large.json"),
        "--limit",
        "100",
        "--walks",
        "2",
        "--steps",
        "30",
    ]
    result = _RUN.invoke(cli, [*arguments, "--json"])
    found = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (found["method"], found["judge"], found["permissiveness"]) == ("walks", "homing", 1.0)


def test_wants_either_a_file_or_random_systems() -> None:
    """Neither, or both, is bad input."""
    assert _RUN.invoke(cli, ["study", "verify"]).exit_code == 2


def test_certificates_are_written_and_checked(tmp_path: Path) -> None:
    """What verify writes, check-certificate accepts; a line that was changed is found and named."""
    file = tmp_path / "certificates.jsonl"
    arguments = ["study", "verify", _file(tmp_path, "unsound_n5"), "--certificates", str(file)]
    assert _RUN.invoke(cli, arguments).exit_code == 0
    result = _RUN.invoke(cli, ["study", "check-certificate", str(file), "--json"])
    checked = json.loads(result.stdout)
    assert result.exit_code == 0
    assert checked["checked"] == sum(checked["kinds"].values()) > 2000
    lines = file.read_text(encoding="utf-8").splitlines()
    refused = next(n for n, line in enumerate(lines) if '"refused"' in line)
    lines[refused] = lines[refused].replace('"refused"', '"admitted"')
    file.write_text("\n".join(lines), encoding="utf-8")
    result = _RUN.invoke(cli, ["study", "check-certificate", str(file)])
    assert result.exit_code == 1
    assert f"line {refused + 1}" in result.stdout


def test_other_gates_give_no_certificates(tmp_path: Path) -> None:
    """Asking a gate without certificates for some is bad input."""
    out = str(tmp_path / "c.jsonl")
    arguments = [
        "study",
        "verify",
        _file(tmp_path, "unsound_n5"),
        "--gate",
        "collision",
        "--certificates",
        out,
    ]
    assert isinstance(_RUN.invoke(cli, arguments).exception, LoopgateError)


def test_no_certificates_in_the_file(tmp_path: Path) -> None:
    """A file that is none of certificates is bad input."""
    file = tmp_path / "c.jsonl"
    for text in ("no json", "[1]", '{"robot": "r1"}', '{"system": {"robots": 3}}'):
        file.write_text(text, encoding="utf-8")
        assert isinstance(
            _RUN.invoke(cli, ["study", "check-certificate", str(file)]).exception, LoopgateError
        )
