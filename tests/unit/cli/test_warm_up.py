"""Everything is compiled ahead, and told."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from loopgate import kernel_cache
from loopgate.cli import warm_up
from loopgate.cli.main import cli
from loopgate.errors import LoopgateError


def test_each_part_is_compiled_by_one_process() -> None:
    """None by both, none by neither."""
    assert sorted(part for share in warm_up._SHARES for part in share) == sorted(warm_up.PARTS)


def test_functions_are_counted_as_they_come(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what the processes print; other lines do not count."""
    real = subprocess.Popen

    def started(command: list[str], **how: object) -> object:
        code = f"print('a word')\nfor name in {command[3:]!r}: print('compiled:', name)"
        return real([sys.executable, "-c", code], **how)  # type: ignore[call-overload]

    monkeypatch.setattr(subprocess, "Popen", started)
    seen: list[int] = []
    assert warm_up.compile_all(seen.append) == len(warm_up.PARTS)
    assert seen == list(range(1, len(warm_up.PARTS) + 1))
    done = CliRunner().invoke(cli, ["warm-up", "--json"])
    assert json.loads(done.stdout)["compiled"] == len(warm_up.PARTS)


def test_a_process_that_fails_is_told_with_its_last_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, as any other error."""
    real = subprocess.Popen
    monkeypatch.setattr(
        subprocess,
        "Popen",
        lambda _, **how: real([sys.executable, "-c", "raise OSError('full')"], **how),
    )
    with pytest.raises(LoopgateError, match=r"warm-up: OSError: full"):
        warm_up.compile_all()


@pytest.mark.slow
def test_nothing_is_left_to_be_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each function that Python code may enter is compiled in an empty cache, and nothing the second time."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    told = subprocess.run(
        [sys.executable, "-c", _COUNT], check=True, capture_output=True, text=True
    ).stdout.splitlines()
    package = Path(kernel_cache.__file__).parent
    entries = {
        f"loopgate.{'.'.join(file.relative_to(package).with_suffix('').parts)}.{name}"
        for file in package.rglob("*.py")
        for name in re.findall(
            r"^@(?:kernel|outer)\ndef (\w+)", file.read_text(encoding="utf-8"), re.MULTILINE
        )
    }
    assert entries - set(told) == set()
    assert warm_up.compile_all() == 0


_COUNT = """
from loopgate.cli.warm_up import PARTS, compile_parts
from loopgate.kernel_cache import listen_to_compiling
listen_to_compiling(print)
for part in PARTS.values():
    part()
"""
