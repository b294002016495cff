"""Compile the ledger by mypyc while the wheel is built, where `LOOPGATE_COMPILE` is 1: a hook of hatchling.

    LOOPGATE_COMPILE=1 pip install .

It needs a C compiler. An editable installation stays plain.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


def compile_ledger(folder: Path) -> list[Path]:
    """Compile the ledger of the package ``loopgate`` in a folder; return the libraries, by paths from there.

    Raises `subprocess.CalledProcessError` if that fails.
    """
    control = sorted((folder / "loopgate" / "control").glob("*.py"))
    modules = [one for one in control if one.name != "__init__.py"]
    modules.append(folder / "loopgate" / "gates" / "certified" / "chain.py")
    modules.append(folder / "loopgate" / "negotiation" / "formulas.py")
    words = ("--follow-imports=skip", "--ignore-missing-imports", "--config-file=")
    names = [str(one.relative_to(folder)) for one in modules]
    subprocess.run(
        [sys.executable, "-m", "mypyc", *words, *names], check=True, capture_output=True, cwd=folder
    )
    made = (*folder.glob("*.so"), *(folder / "loopgate").rglob("*.so"))
    return sorted(one.relative_to(folder) for one in made)


class CompiledLedger(BuildHookInterface[Any]):
    """Puts the compiled modules into the wheel, beside their source."""

    def dependencies(self) -> list[str]:
        """Return what it needs beside hatchling."""
        return ["mypy>=1.13", "setuptools"] if _is_wanted() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile in a copy of the source."""
        if not _is_wanted() or version == "editable":
            return
        if not any(map(shutil.which, ("cc", "gcc", "clang"))):
            msg = "LOOPGATE_COMPILE=1 needs a C compiler, and there is none; without it loopgate runs plain"
            raise SystemExit(msg)
        self._folder = Path(tempfile.mkdtemp())
        shutil.copytree(Path(self.root) / "src" / "loopgate", self._folder / "loopgate")
        for file in compile_ledger(self._folder):
            build_data["force_include"][str(self._folder / file)] = str(file)
        build_data["pure_python"], build_data["infer_tag"] = False, True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the copy."""
        del version, build_data, artifact_path
        shutil.rmtree(getattr(self, "_folder", ""), ignore_errors=True)


def _is_wanted() -> bool:
    return os.environ.get("LOOPGATE_COMPILE") == "1"
