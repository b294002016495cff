"""Measure the house by its ways: which files of the package execute from an input to its effect.

    python analysis/house.py              (the figures)
    python analysis/house.py --files      (and the files of each way, in order)

Four ways of one run on the grid: from the command to the first vehicle in the ledger; one step with a grant,
the shortest; from the last step to the summary; from a run folder to its report. A file counts if one of its
functions is called; bodies of modules and comprehensions do not count. Besides: circles of imports, names of
classes that are defined twice, files, and lines of each room.
"""

from __future__ import annotations

import argparse
import ast
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from types import FrameType

import networkx as nx

import loopgate
from loopgate.cli.main import main as run_command

ROOT = Path(loopgate.__file__).parent
PROJECT = Path(__file__).resolve().parents[1]
NETWORK = PROJECT / "networks" / "grid5-priority.net.xml"
ROUTES = PROJECT / "routes" / "grid5.rou.xml"
OPTIMIZED = 1
"""The flag of a code object that is the body of a function."""
FIRST_VEHICLE = "control/holdings.py", "take_in"
LAST_STEP = "run_to_end"
"""The function that returns after the last step."""
A_STEP = "control/driving.py", "after_step"
A_GRANT = "grant"


class Ways:
    """Notes the files whose functions are called, way by way."""

    def __init__(self) -> None:
        self.way = "first vehicle"
        self.files: dict[str, dict[str, None]] = {"first vehicle": {}, "summary": {}, "report": {}}
        self.steps: list[dict[str, None]] = []
        self._step: dict[str, None] | None = None
        self._grants = False

    def note(self, frame: FrameType, event: str, _argument: object) -> None:
        """Take a call or a return, as `sys.setprofile` gives it."""
        code = frame.f_code
        if not code.co_filename.startswith(f"{ROOT}/"):
            return
        file, name = code.co_filename[len(f"{ROOT}/") :], code.co_name
        if event == "return" and name == LAST_STEP:
            self.way = "summary"
        if event == "return" and (file, name) == A_STEP:
            if self._step is not None and self._grants:
                self.steps.append(self._step)
            self._step, self._grants = None, False
        if event != "call" or not code.co_flags & OPTIMIZED or name.startswith("<"):
            return
        if self.way in self.files:
            self.files[self.way][file] = None
        if (file, name) == FIRST_VEHICLE and self.way == "first vehicle":
            self.way = "drive"
        elif (file, name) == A_STEP:
            self._step = {}
        if self._step is not None:
            self._step[file] = None
            self._grants = self._grants or name == A_GRANT


def call(*words: str) -> None:
    """Run a command of the package."""
    sys.argv = ["loopgate", *words]
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        try:
            run_command()
        except SystemExit as ended:
            if ended.code:
                raise


def find_ways() -> dict[str, list[str]]:
    """Return the files of each way."""
    os.chdir(tempfile.mkdtemp())
    found = Ways()
    call("run", str(NETWORK), "--routes", str(ROUTES), "--vehicles", "12", "--duration", "30", "-o", "warm")
    sys.setprofile(found.note)
    call("run", str(NETWORK), "--routes", str(ROUTES), "--vehicles", "60", "--duration", "120", "-o", "out")
    found.way = "report"
    call("report", "out", "-o", "report.html")
    sys.setprofile(None)
    return {
        "from the command to the first vehicle": list(found.files["first vehicle"]),
        "a step with a grant": min(map(list, found.steps), key=len),
        "from the last step to the summary": list(found.files["summary"]),
        "from a run folder to its report": list(found.files["report"]),
    }


def sources() -> dict[str, ast.Module]:
    """Return the parsed modules of the package by name."""
    return {
        ".".join(["loopgate", *file.relative_to(ROOT).with_suffix("").parts]).removesuffix(
            ".__init__"
        ): ast.parse(file.read_text(encoding="utf-8"))
        for file in sorted(ROOT.rglob("*.py"))
    }


def imports(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield what a module imports when it is loaded: the module, and a name in it."""
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from ((node.module, one.name) for one in node.names)
        elif isinstance(node, ast.Import):
            yield from ((one.name, "") for one in node.names)


def circles(modules: dict[str, ast.Module]) -> list[list[str]]:
    """Return the circles of imports."""
    graph: nx.DiGraph[str] = nx.DiGraph()
    for name, tree in modules.items():
        for module, one in imports(tree):
            target = f"{module}.{one}" if f"{module}.{one}" in modules else module
            if target in modules:
                graph.add_edge(name, target)
    return [sorted(some) for some in nx.strongly_connected_components(graph) if len(some) > 1]


def main() -> None:
    """Print the figures."""
    words = argparse.ArgumentParser(description="Measure the house by its ways.")
    words.add_argument("--files", action="store_true", help="print the files of each way")
    asked = words.parse_args()
    for way, files in find_ways().items():
        print(f"{way}: {len(files)} files")
        if asked.files:
            print(*(f"    {file}" for file in files), sep="\n")
    modules = sources()
    print(f"circles of imports: {len(circles(modules))}")
    classes = Counter(
        node.name for tree in modules.values() for node in tree.body if isinstance(node, ast.ClassDef)
    )
    twice = sorted(name for name, count in classes.items() if count > 1 and not name.startswith("_"))
    print(f"public classes defined twice: {len(twice)} ({', '.join(twice)})")
    print(f"files: {len(modules)}")
    rooms: Counter[str] = Counter()
    for file in ROOT.rglob("*.py"):
        rooms[file.relative_to(ROOT).parts[0]] += file.read_text(encoding="utf-8").count("\n")
    print(f"lines: {rooms.total()}; " + ", ".join(f"{room} {lines}" for room, lines in rooms.most_common()))


if __name__ == "__main__":
    main()
