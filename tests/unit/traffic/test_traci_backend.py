"""Starting SUMO as a process of its own, when it does not start."""

import subprocess
import sys
from pathlib import Path

import pytest

from loopgate.errors import TrafficError
from loopgate.traffic import traci_backend


@pytest.mark.parametrize("first", ["traci", "libsumo"])
def test_what_traci_raises_is_known_whatever_is_imported_first(first: str) -> None:
    """The exception that libsumo puts into ``traci.exceptions`` is not the one that traci raises."""
    code = (
        f"import {first}, traci, libsumo\n"
        "from loopgate.traffic import traci_backend\n"
        "try: traci.connect(1, numRetries=0, proc=None)\n"
        "except traci_backend.ERROR: pass\n"
        "try: traci.switch('nobody')\n"
        "except traci_backend.ERROR: pass\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


@pytest.mark.parametrize("variable", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_either_display_will_do(monkeypatch: pytest.MonkeyPatch, variable: str) -> None:
    """Whether sumo-gui can open it is seen when it starts."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(TrafficError, match="neither DISPLAY nor WAYLAND_DISPLAY is set"):
        traci_backend.check_display()
    monkeypatch.setenv(variable, ":0")
    traci_backend.check_display()


def test_a_program_that_ends_before_it_answers_is_started_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """As sumo-gui does where it cannot open the display: no sixty tries, and nothing on stdout."""
    program = tmp_path / "bin" / "sumo-gui"
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\necho started >> {tmp_path / 'tries'}\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr("sumo.SUMO_HOME", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":99")
    with pytest.raises(TrafficError, match="sumo-gui ended before it answered; can it open the display :99"):
        traci_backend.start([], gui=True)
    assert (tmp_path / "tries").read_text() == "started\n"
    assert capfd.readouterr().out == ""


def test_a_program_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line that says where it was sought."""
    monkeypatch.setattr("sumo.SUMO_HOME", str(tmp_path))
    with pytest.raises(TrafficError, match=r"bin/sumo-gui: cannot be started \(No such file"):
        traci_backend.start([], gui=True)
