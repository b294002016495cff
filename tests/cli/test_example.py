"""The files that the documentation's first lines use, written where the user stands."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from loopgate.cli.main import cli
from loopgate.network import RoadNetwork, read_loops
from loopgate.sweep import read_sweep


def test_the_first_commands_find_their_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops, networks and the first sweep, each where the documentation names it."""
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(cli, ["example"]).exit_code == 0
    network = RoadNetwork.open("networks/order2.net.xml")
    assert len(read_loops(network, "routes/order2.rou.xml").loops) == 5
    assert len(read_sweep("analysis/first_sweep.toml").points()) == 18
    assert Path("routes/berlin60.rou.xml").is_file()


def test_what_is_there_stays(tmp_path: Path) -> None:
    """A file that somebody has changed is not written over, and that is said."""
    CliRunner().invoke(cli, ["example", str(tmp_path)])
    changed = tmp_path / "analysis" / "first_sweep.toml"
    changed.write_text("mine", encoding="utf-8")
    told = CliRunner().invoke(cli, ["example", str(tmp_path)]).output
    assert changed.read_text(encoding="utf-8") == "mine"
    assert "0 files written" in told
    assert "13 were there already" in told
