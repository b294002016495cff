"""Compile the ledger by mypyc: while the wheel is built (a hook of hatchling), in place, or in a copy.

    pip install .                               # compiles where there is a C compiler; else it stays plain
    python analysis/compiled_wheel.py           # in place, for an editable installation
    python analysis/compiled_wheel.py --remove  # plain again
    python analysis/compiled_wheel.py --copy F  # a compiled copy of the package in a folder

`LOOPGATE_COMPILE=0` leaves the wheel plain; with `LOOPGATE_COMPILE=1` the wheel fails where it cannot be
compiled. An editable installation stays plain. A plain wheel says why it is plain, in `WHY_PLAIN`.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCE = Path(__file__).resolve().parents[1] / "src"
SETTING = "LOOPGATE_COMPILE"
WHY_PLAIN = Path("loopgate") / "why_plain.txt"
"""Where the package says why its ledger is plain."""


def sources(folder: Path) -> list[Path]:
    """Return the modules of the package in a folder that are compiled."""
    package = folder / "loopgate"
    control = sorted((package / "control").glob("*.py"))
    modules = [one for one in control if one.name != "__init__.py"]
    beside = "gates/certified/chain.py", "negotiation/formulas.py", "network/cover/ruin.py"
    return [*modules, *(package / name for name in beside)]


def libraries(folder: Path) -> list[Path]:
    """Return the compiled modules of the package in a folder, with the one that they share."""
    return sorted((*folder.glob("*__mypyc*.so"), *(folder / "loopgate").rglob("*.so")))


def compile_ledger(folder: Path) -> list[Path]:
    """Compile the ledger of the package ``loopgate`` in a folder; return the libraries, by paths from there.

    Raises `subprocess.CalledProcessError` if that fails.
    """
    words = ("--follow-imports=skip", "--ignore-missing-imports", "--config-file=")
    names = [str(one.relative_to(folder)) for one in sources(folder)]
    subprocess.run(
        [sys.executable, "-m", "mypyc", *words, *names], check=True, capture_output=True, cwd=folder
    )
    return [one.relative_to(folder) for one in libraries(folder)]


def compile_copy(folder: Path) -> list[Path]:
    """Copy the package into a folder, compile the ledger there, and return the libraries."""
    left_out = shutil.ignore_patterns("__pycache__", "*.so")
    shutil.copytree(SOURCE / "loopgate", folder / "loopgate", ignore=left_out)
    return compile_ledger(folder)


def no_compiler() -> str:
    """Return what is missing to compile, or an empty text."""
    if not any(map(shutil.which, (os.environ.get("CC") or "cc", "gcc", "clang"))):
        return "no C compiler was found"
    return "" if find_spec("mypyc") else "mypyc was not found"


def compile_or_say_why(folder: Path, build: Callable[[Path], list[Path]] = compile_copy) -> list[Path]:
    """Return the libraries, compiled in a folder; none if they cannot be compiled, with `WHY_PLAIN` there.

    Raises `SystemExit` if `LOOPGATE_COMPILE` is 1 and they cannot be compiled.
    """
    why = f"{SETTING} was 0" if os.environ.get(SETTING) == "0" else no_compiler()
    if not why:
        try:
            return build(folder)
        except subprocess.CalledProcessError as error:
            said = (error.stderr or b"").decode(errors="replace").split("\n")
            wrong = [line.strip() for line in said if "error" in line.lower()] or [f"{error.returncode}"]
            why = f"the compiler failed ({wrong[0][:200]})"
    if os.environ.get(SETTING) == "1":
        msg = f"{SETTING}=1: {why}; without {SETTING} loopgate is installed with a plain ledger"
        raise SystemExit(msg)
    sys.stderr.write(f"loopgate: {why}, so its ledger stays plain Python: slower, and the same results\n")
    file = folder / WHY_PLAIN
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"{why} when it was installed\n", encoding="utf-8")
    return []


def remove() -> None:
    """Remove what was compiled in place."""
    for file in libraries(SOURCE):
        file.unlink()


def compile_in_place() -> None:
    """Compile in a copy, and move the libraries beside their sources."""
    remove()
    with tempfile.TemporaryDirectory() as name:
        for file in compile_copy(Path(name)):
            shutil.move(Path(name) / file, SOURCE / file)


def stale() -> list[Path]:
    """Return the sources that are newer than what was compiled of them in place."""
    built = libraries(SOURCE)
    made_s = min((file.stat().st_mtime for file in built), default=float("inf"))
    return [file for file in sources(SOURCE) if file.stat().st_mtime > made_s]


class CompiledLedger(BuildHookInterface[Any]):
    """Puts the compiled modules into the wheel, beside their source."""

    def dependencies(self) -> list[str]:
        """Return what it needs beside hatchling."""
        return [] if os.environ.get(SETTING) == "0" else ["mypy>=1.13", "setuptools"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile in a copy of the source."""
        if version == "editable":
            return
        self._folder = Path(tempfile.mkdtemp())
        compiled = compile_or_say_why(self._folder)
        for file in compiled or [WHY_PLAIN]:
            build_data["force_include"][str(self._folder / file)] = str(file)
        if compiled:
            build_data["pure_python"], build_data["infer_tag"] = False, True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the copy."""
        del version, build_data, artifact_path
        shutil.rmtree(getattr(self, "_folder", ""), ignore_errors=True)


def main() -> None:
    """Compile in place or in a copy, or remove what was compiled in place."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--remove", action="store_true", help="remove what was compiled in place")
    either.add_argument("--copy", type=Path, help="compile a copy of the package in this folder")
    given = parser.parse_args()
    if given.remove:
        remove()
        return
    if why := no_compiler():
        sys.exit(f"loopgate stays plain: {why}")
    if given.copy is None:
        compile_in_place()
    else:
        shutil.rmtree(given.copy, ignore_errors=True)
        compile_copy(given.copy.resolve())


if __name__ == "__main__":
    main()
