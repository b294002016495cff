"""Build the wheels, and try them in empty environments outside of the repository.

    python analysis/wheel.py [--only 3.12 oldest plain]

For each Python from 3.11 on this machine there is a compiled wheel and an environment with the newest
dependencies, and for the oldest Python one more with the oldest ones: for each dependency the version that
``pyproject.toml`` names as the least. *Plain* is an installation from the source where no C compiler is. In
each environment ``loopgate --version`` must name the ledger that should be there. Then the commands of the
start page are followed in an empty folder, and Python makes a run. The table says what was there, and how
long it took; the first thing that fails ends with exit code 1.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

from compiled_wheel import SETTING

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "wheel"
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
SHORTER = ((r"--vehicles \d+ --duration \d+", "--vehicles 60 --duration 60"),)
"""Grid and commands are those of the page; a minute shows whether all parts work."""

IN_PYTHON = """
from importlib.metadata import version
from loopgate import Scenario, run
made = run(Scenario(network="networks/grid5-priority.net.xml", loops=3, vehicles=6, duration_s=30))
assert made.summary["outcome"] == "done", made.summary
names = "numpy", "pandas", "pyarrow", "scipy", "shapely"
print(" ".join(f"{name} {version(name)}" for name in names))
"""


def pythons() -> dict[str, str]:
    """Return the interpreters of the machine that have venv, by version."""
    own = sorted(Path.home().glob(".pyenv/versions/*/bin/python3"))
    found: dict[str, str] = {}
    for place in (*(shutil.which(f"python{version}") for version in VERSIONS), *map(str, own)):
        if place is None:
            continue
        code = "import ensurepip, sys; print('.'.join(map(str, sys.version_info[:2])))"
        said = subprocess.run([place, "-c", code], check=False, capture_output=True, text=True)
        if said.returncode == 0 and said.stdout.strip() in VERSIONS:
            found.setdefault(said.stdout.strip(), place)
    return dict(sorted(found.items()))


def build(python: str) -> Path:
    """Build the compiled wheel for a Python into ``out/wheel``, by the way of a user; return it."""
    there = set(OUT.glob("*.whl"))
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([python, "-m", "venv", name], check=True)
        words = ("pip", "--disable-pip-version-check", "wheel", "--quiet", "--no-deps", "-w", str(OUT))
        inside = Path(name) / "bin" / "python"
        subprocess.run([inside, "-m", *words, ROOT], check=True, env={**os.environ, SETTING: "1"})
    (wheel,) = set(OUT.glob("*.whl")) - there
    return wheel


def oldest() -> str:
    """Return pip's constraints for the least version of each dependency."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pairs = (re.match(r"([\w.-]+)>=([\w.]+)", line) for line in project["dependencies"])
    return "".join(f"{pair[1]}=={pair[2]}\n" for pair in pairs if pair)


def commands() -> list[str]:
    """Return the commands of the start page, each on one line."""
    page = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```sh\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    text = "".join(blocks).replace("\\\n", " ")
    for pattern, shorter in SHORTER:
        text = re.sub(pattern, shorter, text)
    return text.splitlines()


def attempt(python: str, wheel: Path, constraints: str) -> str:
    """Install the wheel in an empty environment and follow the page; return what was installed.

    Instead of a wheel it takes the source, and installs it where no C compiler is on the path.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "constraints.txt").write_text(constraints)
        inside = folder / "venv" / "bin"
        here = folder / "here"
        here.mkdir()
        kept = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        environment = {**kept, "PATH": f"{inside}:/usr/bin:/bin", "XDG_CACHE_HOME": str(folder / "cache")}
        environment["BROWSER"] = "true"  # opens nothing

        def call(*words: str, **more: str) -> str:
            env = {**environment, **more}
            done = subprocess.run(words, cwd=here, env=env, check=False, capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"{' '.join(words)}\n{done.stdout[-2000:]}{done.stderr[-4000:]}")
            return done.stdout

        call(python, "-m", "venv", str(folder / "venv"))
        pip = (str(inside / "python"), "-m", "pip", "--disable-pip-version-check")
        cache = ("--cache-dir", str(Path.home() / ".cache" / "pip"))
        path = {} if wheel.is_file() else {"PATH": str(inside)}
        call(*pip, "install", "--quiet", *cache, "-c", str(folder / "constraints.txt"), str(wheel), **path)
        call(*pip, "check")
        told, kind = call("loopgate", "--version").strip(), "compiled" if wheel.is_file() else "plain"
        if f", {kind} ledger" not in told:
            sys.exit(f"{told}: the ledger should be {kind}")
        for line in commands():
            call("sh", "-c", line)
        for page in ("grid.html", "replay.html"):
            if (here / page).stat().st_size < 10_000:  # noqa: PLR2004  bytes; the empty template alone has more
                sys.exit(f"{page}: too small to hold anything")
        return call(str(inside / "python"), "-c", IN_PYTHON).strip()


def main(words: Sequence[str] | None = None) -> None:
    """Try the wheel wherever it may be tried."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="*", help="versions of Python, or: oldest")
    only = parser.parse_args(words).only
    found = pythons()
    first = next(iter(found.values()))
    tries = {version: (place, "") for version, place in found.items()}
    tries |= {"oldest": (first, oldest()), "plain": (first, "")}
    shutil.rmtree(OUT, ignore_errors=True)
    wheels: dict[str, Path] = {}
    for name, (place, constraints) in tries.items():
        if only and name not in only:
            continue
        if name != "plain" and place not in wheels:
            began = time.monotonic()
            wheel = wheels[place] = build(place)
            size_mb, took_s = wheel.stat().st_size / 1e6, time.monotonic() - began
            print(f"{wheel.name}, {size_mb:.1f} MB, built in {took_s:.0f} s", flush=True)
        began = time.monotonic()
        what = attempt(place, ROOT if name == "plain" else wheels[place], constraints)
        print(f"{name:8} {time.monotonic() - began:4.0f} s  {what}", flush=True)
    missing = [version for version in VERSIONS if version not in found]
    if missing:
        print(f"not on this machine: Python {', '.join(missing)}")


if __name__ == "__main__":
    main()
