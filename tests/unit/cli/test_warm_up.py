"""Everything is compiled ahead, and told."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from loopgate.research import kernel_cache


@pytest.mark.slow
def test_nothing_is_left_to_be_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each function that Python code may enter is compiled in an empty cache, and nothing the second time."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    told = subprocess.run(
        [sys.executable, "-c", _COUNT], check=True, capture_output=True, text=True
    ).stdout.splitlines()
    package = Path(kernel_cache.__file__).parents[1]
    entries = {
        f"loopgate.{'.'.join(file.relative_to(package).with_suffix('').parts)}.{name}"
        for file in package.rglob("*.py")
        for name in re.findall(
            r"^@(?:kernel|outer)\ndef (\w+)", file.read_text(encoding="utf-8"), re.MULTILINE
        )
    }
    assert entries - set(told) == set()
    again = [sys.executable, "-m", "loopgate", "study", "warm-up", "--json"]
    assert json.loads(subprocess.check_output(again, text=True))["compiled"] == 0


_COUNT = """
from loopgate.cli.warm_up import compile_all
from loopgate.research import kernel_cache
real = kernel_cache.listen_to_compiling
kernel_cache.listen_to_compiling = lambda tell: real(lambda name: (print(name), tell(name)))
compile_all()
"""
