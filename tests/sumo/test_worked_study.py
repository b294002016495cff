"""The worked study runs from its first cell to its last."""

import subprocess
import sys
from pathlib import Path

import pytest

STUDY = Path(__file__).resolve().parents[2] / "analysis" / "worked_study.py"


@pytest.mark.sumo
@pytest.mark.slow
def test_the_worked_study(tmp_path: Path) -> None:
    """24 simulations, none failed; tables are printed and the report is there."""
    result = subprocess.run(
        [sys.executable, str(STUDY), str(tmp_path)], check=False, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    assert "24 runs made" in result.stdout
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "24 runs, none failed." in text
    assert "loopgate" in text
    assert " in 0 of 12" in text
