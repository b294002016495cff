"""Break `loopgate.control` and the chain rule in 300 small ways, each alone, and see if a test notices.

    python analysis/mutants.py                   (goes on where it was stopped)
    python analysis/mutants.py --survivors       (tries again those that survive unexplained, after a change)
    python analysis/mutants.py --anew --seed 2   (draws others)

Cosmic Ray lists the mutations: operators, comparisons, numbers, conditions, loops. A place in the code is
drawn first and one of its mutations then, since an operator has ten of them and a condition has one. Each
mutant is tried in a copy of the tree, in a forked process, by the tests that run its line, the quick ones
first, until one fails. A test that takes ten times its processor time has failed. What is found is in
`out/mutants` (`results.jsonl`); `analysis/tables/mutants.toml` says of survivors why they survive.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib
import itertools
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import pytest

ROOT: Final = Path(__file__).resolve().parents[1]
TOOLS: Final = ("cosmic-ray>=8.7,<9", "coverage>=7.6,<8")
EXPLAINED: Final = Path(__file__).parent / "tables" / "mutants.toml"
CONTROL: Final = sorted((ROOT / "src" / "loopgate" / "control").glob("*.py"))
BROKEN: Final = (
    *(file.relative_to(ROOT) for file in CONTROL),
    Path("src/loopgate/gates/certified/chain.py"),
)
TESTS: Final = (
    "tests/unit/control",
    "tests/sumo/test_frozen_runs.py",
    "tests/sumo/test_ledger_drives.py",
    "tests/sumo/test_ledger_sees.py",
    "tests/sumo/test_lights_and_others.py",
    "tests/sumo/test_mixed_lengths.py",
    "tests/sumo/test_stops.py",
    "tests/properties/test_away.py",
    "tests/properties/test_comers.py",
    "tests/properties/test_control.py",
    "tests/properties/test_ledger_chain.py",
    "tests/properties/test_long_and_short.py",
    "tests/properties/test_returns.py",
)
STAGES: Final = ("tests/unit", "tests/sumo/test_frozen_runs.py", "tests")
NEEDED: Final = ("src", "tests", "analysis", "networks", "routes", "docs", "pyproject.toml")
READY: Final = ("hypothesis", "libsumo", "numba", "pandas", "scipy.stats", "shapely", "sumolib", "vl_convert")
"""What takes long to import; none of it imports loopgate."""
SLACK_S: Final = 3.0
BYTES: Final = 6 << 30


@dataclass(frozen=True)
class Mutant:
    """A change of some lines of a file; `lines` stand there from `line` on, `instead` afterwards."""

    file: str
    line: int
    kind: str
    lines: list[str]
    instead: list[str]

    @property
    def key(self) -> str:
        """Return what it is told apart by, also after lines above have come or gone."""
        return json.dumps([self.file, self.lines, self.instead])

    def applied(self, text: str) -> str | None:
        """Return a file's text with the change, at the place nearest to where it was; None if it is gone."""
        all_lines = text.split("\n")
        many = len(self.lines)
        starts = [at for at in range(len(all_lines)) if all_lines[at : at + many] == self.lines]
        if not starts:
            return None
        at = min(starts, key=lambda start: abs(start + 1 - self.line))
        return "\n".join([*all_lines[:at], *self.instead, *all_lines[at + many :]])


def without_annotations(text: str) -> str | None:
    """Return the syntax of a file without its types; None if it is no Python."""
    try:
        tree = ast.parse(text)
    except SyntaxError:
        return None
    for node in ast.walk(tree):
        if isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
        elif isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, ast.FunctionDef):
            node.returns = None
    return ast.dump(tree)


def difference(before: str, after: str) -> tuple[int, list[str], list[str]]:
    """Return the first line that differs, from 1, and the lines that differ."""
    old, new = before.split("\n"), after.split("\n")
    begin = next(at for at, (one, other) in enumerate(zip(old, new, strict=False)) if one != other)
    end = 0
    while old[-1 - end] == new[-1 - end] and min(len(old), len(new)) - end > begin + 1:
        end += 1
    return begin + 1, old[begin : len(old) - end], new[begin : len(new) - end]


def read_results(file: Path) -> dict[str, dict[str, Any]]:
    """Return what has become of mutants, by their keys."""
    if not file.exists():
        return {}
    rows = map(json.loads, file.read_text(encoding="utf-8").splitlines())
    return {row["key"]: row for row in rows}


def draw(number: int, seed: int) -> list[Mutant]:
    """Return random mutants: a place in the code each, and one of the mutations of its kind there."""
    from cosmic_ray.ast import ast_nodes, get_ast  # noqa: PLC0415
    from cosmic_ray.mutating import mutate_code  # noqa: PLC0415
    from cosmic_ray.plugins import get_operator, operator_names  # noqa: PLC0415

    places: dict[tuple[str, str, object], list[tuple[str, int]]] = {}
    texts = {str(file): (ROOT / file).read_text(encoding="utf-8") for file in BROKEN}
    for file, text in texts.items():
        nodes = list(ast_nodes(get_ast(text)))
        for name in sorted(operator_names()):
            kind = name.removeprefix("core/").partition("_")[0]
            if kind == "NoOp" or get_operator(name).arguments():
                continue
            operator = get_operator(name)()
            spots = (spot for node in nodes for spot in operator.mutation_positions(node))
            for occurrence, spot in enumerate(spots):
                places.setdefault((file, kind, spot[0]), []).append((name, occurrence))
    rng = random.Random(seed)
    order = sorted(places, key=str)
    rng.shuffle(order)
    drawn: list[Mutant] = []
    syntax = {file: without_annotations(text) for file, text in texts.items()}
    for place in order:
        file, kind, _ = place
        name, occurrence = rng.choice(places[place])
        text = mutate_code(texts[file], get_operator(name)(), occurrence)
        changed = None if text is None else without_annotations(text)
        if text is None or changed is None or changed == syntax[file]:
            continue
        line, old, new = difference(texts[file], text)
        drawn.append(Mutant(file, line, kind, old, new))
        if len(drawn) == number:
            break
    return drawn


@dataclass(frozen=True)
class Test:
    """A test: its processor time [s], and the lines of each file that it runs."""

    name: str
    cost_s: float
    lines: dict[str, list[int]]


class Measuring:
    """A plug-in of pytest that notes processor time and lines of each test."""

    def __init__(self, coverage: Any) -> None:  # noqa: ANN401  not installed where types are checked
        self._coverage = coverage
        self.cost_s: dict[str, float] = {}
        self.failed: list[str] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Time a test."""
        self._coverage.switch_context(item.nodeid)
        begin = time.process_time()
        result = yield
        self.cost_s[item.nodeid] = time.process_time() - begin
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a failure."""
        if report.failed:
            self.failed.append(report.nodeid)


class Trying:
    """A plug-in of pytest that runs chosen tests in the given order, and writes down the one at hand."""

    def __init__(self, tests: list[Test], note: Path) -> None:
        self._tests = {test.name: (at, test) for at, test in enumerate(tests)}
        self._note = note

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Choose and sort."""
        chosen = [item for item in items if item.nodeid in self._tests]
        items[:] = sorted(chosen, key=lambda item: self._tests[item.nodeid][0])

    def pytest_collection_finish(self) -> None:
        """Note that the code could be imported."""
        self._note.write_text("collected", encoding="utf-8")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Write down the test, and give it a limit on processor time."""
        self._note.write_text(item.nodeid, encoding="utf-8")
        spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        most = resource.getrlimit(resource.RLIMIT_CPU)[1]
        limit = int(spent + 10.0 * self._tests[item.nodeid][1].cost_s + SLACK_S)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, most))
        return (yield)


def run_tests(copy: Path, files: list[str], plugin: object) -> int:
    """Run tests of a copy of the tree in this process; return pytest's exit code."""
    os.chdir(copy)
    sys.path[:0] = [str(copy / "src")]
    options = [
        "-x",
        "-m",
        "not slow",
        "-p",
        "no:cacheprovider",
        "--tb=short",
        "-W",
        "ignore::pytest.PytestAssertRewriteWarning",
    ]
    return int(pytest.main([*options, *files], plugins=[plugin]))


def in_child(copy: Path, work: Callable[[], int]) -> int:
    """Do something in a forked process without output; return its exit code, negative for a signal."""
    child = os.fork()
    if child == 0:
        code = 3
        try:
            quiet = os.open(copy / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            code = work()
        except BaseException:  # noqa: BLE001 - the process ends here, and says why
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def digest(*files: Path) -> str:
    """Return a hash of the contents of files."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]


def measure(copy: Path, into: Path) -> list[Test]:
    """Return what each test costs and which lines it runs; run those of files that have changed since."""
    code = digest(*(ROOT / file for file in BROKEN))
    known = json.loads(into.read_text(encoding="utf-8")) if into.exists() else {}
    if known.get("code") != code:
        known = {"code": code, "files": {}}
    every = sorted(file for name in TESTS for file in (ROOT / name).rglob("test_*.py"))
    every += [ROOT / name for name in TESTS if name.endswith(".py")]
    there = {str(file.relative_to(ROOT)): digest(file) for file in every}
    known["files"] = {
        name: kept for name, kept in known["files"].items() if there.get(name) == kept["digest"]
    }
    fresh = [name for name in there if name not in known["files"]]

    def work() -> int:
        from coverage import Coverage  # noqa: PLC0415

        coverage = Coverage(
            data_file=str(copy / "coverage"), include=[str(copy / file) for file in BROKEN], config_file=False
        )
        coverage.start()
        plugin = Measuring(coverage)
        code = run_tests(copy, fresh, plugin)
        coverage.stop()
        lines: dict[str, dict[str, list[int]]] = {name: {} for name in plugin.cost_s}
        for file in BROKEN:
            for line, names in coverage.get_data().contexts_by_lineno(str(copy / file)).items():
                for name in set(names) & lines.keys():
                    lines[name].setdefault(str(file), []).append(line)
        for at in fresh:
            tests = [Test(name, s, lines[name]) for name, s in plugin.cost_s.items() if _file(name) == at]
            known["files"][at] = {"digest": there[at], "tests": [asdict(test) for test in tests]}
        if code == 0:
            into.write_text(json.dumps(known), encoding="utf-8")
        return code

    if fresh and in_child(copy, work):
        sys.exit(f"a test fails as the code is: {(copy / 'output.txt').read_text(encoding='utf-8')[-2000:]}")
    known = json.loads(into.read_text(encoding="utf-8"))
    return [Test(**one) for kept in known["files"].values() for one in kept["tests"]]


def lines_of(text: str, line: int) -> set[int] | None:
    """Return the lines of the statement at a line, without its body; None where it runs on import."""
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.stmt)]
    over = [node for node in nodes if node.lineno <= line <= (node.end_lineno or 0)]
    inside = any(isinstance(node, ast.FunctionDef) and line >= node.body[0].lineno for node in over)
    if not inside:
        return None
    best = max(over, key=lambda node: node.lineno)
    if isinstance(best, (ast.FunctionDef, ast.ClassDef)):
        return None
    body = getattr(best, "body", None)
    end = body[0].lineno - 1 if body else (best.end_lineno or best.lineno)
    return set(range(best.lineno, max(end, best.lineno) + 1))


def concerned(tests: list[Test], mutant: Mutant, text: str) -> list[Test]:
    """Return the tests that run the line of a mutant, the quick files first."""
    lines = lines_of(text, mutant.line)

    def runs(test: Test) -> bool:
        return lines is None or not lines.isdisjoint(test.lines.get(mutant.file, ()))

    chosen = [test for test in tests if runs(test)]
    cost_s: dict[str, float] = {}
    for test in chosen:
        cost_s[_file(test.name)] = cost_s.get(_file(test.name), 0.0) + test.cost_s

    def rank(test: Test) -> tuple[bool, bool, float, str, float]:
        file = _file(test.name)
        # A line that runs on import concerns tests of its own file before all others.
        return mutant.file not in test.lines, "properties" in file, cost_s[file], file, test.cost_s

    return sorted(chosen, key=rank)


_SECONDS: Final = itertools.count(int(time.time()))


def _stage(name: str) -> str:
    return next(stage for stage in STAGES if name.startswith(stage))


def _file(name: str) -> str:
    return name.partition("::")[0]


def attempt(copy: Path, mutant: Mutant, tests: list[Test], most_s: float) -> dict[str, Any]:
    """Try one mutant by tests of at most `most_s` of processor time; return what became of it."""
    file = copy / mutant.file
    text = file.read_text(encoding="utf-8")
    broken = mutant.applied(text)
    if broken is None:
        return {"end": "gone", "by": "", "tests": 0}
    chosen = concerned(tests, mutant, text)
    while chosen and sum(test.cost_s for test in chosen) > most_s:
        chosen.remove(max(chosen, key=lambda test: test.cost_s))
    if not chosen:
        return {"end": "survived", "by": "", "tests": 0}
    note = copy / "note.txt"
    note.write_text("", encoding="utf-8")

    def work() -> int:
        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (60, 1200))
        # One call each: files of those that cost more are read only where those that cost less pass.
        for stage in STAGES:
            some = [test for test in chosen if _stage(test.name) == stage]
            code = (
                run_tests(copy, sorted({_file(test.name) for test in some}), Trying(some, note))
                if some
                else 0
            )
            if code:
                return code
        return 0

    file.write_text(broken, encoding="utf-8")
    now = next(_SECONDS)
    os.utime(file, (now, now))  # compiled files are known by the second and the size of their source
    try:
        code = in_child(copy, work)
    finally:
        file.write_text(text, encoding="utf-8")
        os.utime(file, (now - 1e6, now - 1e6))
    at = note.read_text(encoding="utf-8")
    end = "survived" if code == 0 else "time" if code == -signal.SIGXCPU else "killed"
    return {"end": end, "by": "" if code == 0 else at or "import", "tests": len(chosen)}


def install(into: Path) -> None:
    """Install the tools beside the project's environment, which needs them for nothing else."""
    if not into.exists():
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "--target", str(into), *TOOLS], check=True)
    sys.path.append(str(into))


def copy_tree(into: Path) -> None:
    """Make the copy in which mutants are tried, and import what none of them changes."""
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir()
    for name in NEEDED:
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy2)(ROOT / name, into / name)
    os.environ["PYTHONPATH"] = str(into / "src")
    for name in READY:
        importlib.import_module(name)


def explained() -> dict[tuple[str, str, str], str]:
    """Return why mutants survive, by what `in_short` says of them."""
    known = tomllib.loads(EXPLAINED.read_text(encoding="utf-8"))["survivors"]
    return {(one["file"], one["line"], one["instead"]): f"{one['kind']}: {one['why']}" for one in known}


def in_short(mutant: Mutant) -> tuple[str, str, str]:
    """Return the file, the line, and what stands there instead."""
    old, new = (" ".join(line.strip() for line in lines) for lines in (mutant.lines, mutant.instead))
    return mutant.file.removeprefix("src/loopgate/"), old, new


def tell(mutants: list[Mutant], results: dict[str, dict[str, Any]]) -> None:
    """Print what was found: by kind, by what noticed it, and each survivor with its explanation."""
    why = explained()
    there = [(mutant, results[mutant.key]) for mutant in mutants if mutant.key in results]
    kinds = Counter((mutant.kind, row["end"]) for mutant, row in there)
    print("\n| mutation | tried | killed | by time | survived |\n|---|---|---|---|---|")
    for kind in sorted({mutant.kind for mutant in mutants}):
        killed, late, left = (kinds[kind, end] for end in ("killed", "time", "survived"))
        print(f"| {kind} | {killed + late + left} | {killed} | {late} | {left} |")
    ends = Counter(row["end"] for _, row in there)
    print(f"| all | {len(there)} | {ends['killed']} | {ends['time']} | {ends['survived']} |")
    print("\n| noticed first by | mutants |\n|---|---|")
    for file, count in Counter(_file(row["by"]) for _, row in there if row["by"]).most_common():
        print(f"| {file} | {count} |")
    print("\n| survivor | instead | why |\n|---|---|---|")
    for mutant, row in there:
        if row["end"] == "survived":
            name, old, new = in_short(mutant)
            print(f"| {name}: `{old}` | `{new}` | {why.get((name, old, new), 'not explained')} |")


def main() -> None:
    """Draw, measure, try, tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--number", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutants")
    parser.add_argument("--anew", action="store_true", help="draw and measure again")
    parser.add_argument("--survivors", action="store_true", help="try again those that survived")
    parser.add_argument("--tests-s", type=float, default=120.0, help="tests of so much time a mutant [s]")
    parser.add_argument("--most-s", type=float, default=7200.0, help="stop after so long; go on later [s]")
    given = parser.parse_args()
    begin, out = time.monotonic(), given.out
    drawn_file, tests_file, results_file = out / "mutants.json", out / "tests.json", out / "results.jsonl"
    out.mkdir(parents=True, exist_ok=True)
    if given.anew:
        for file in (drawn_file, tests_file, results_file):
            file.unlink(missing_ok=True)
    install(out / "tools")
    if not drawn_file.exists():
        drawn = [asdict(mutant) for mutant in draw(given.number, given.seed)]
        drawn_file.write_text(json.dumps(drawn, indent=1), encoding="utf-8")
    mutants = [Mutant(**one) for one in json.loads(drawn_file.read_text(encoding="utf-8"))]
    results = read_results(results_file)
    why = explained()
    known = {
        mutant.key
        for mutant in mutants
        if mutant.key in results
        and (not given.survivors or results[mutant.key]["end"] != "survived" or in_short(mutant) in why)
    }
    copy_tree(out / "copy")
    tests = measure(out / "copy", tests_file)
    print(
        f"{len(tests)} tests, {sum(test.cost_s for test in tests):.0f} s while lines are counted", flush=True
    )
    for number, mutant in enumerate(mutants, 1):
        if mutant.key in known:
            continue
        spent_s = time.monotonic() - begin
        if spent_s > given.most_s:
            print("stopped; run it again to go on")
            break
        row = attempt(out / "copy", mutant, tests, given.tests_s)
        row = results[mutant.key] = {"key": mutant.key, **row}
        with results_file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        where = f"{mutant.file.removeprefix('src/loopgate/')}:{mutant.line}"
        print(f"{number}/{len(mutants)} {spent_s:.0f} s {row['end']} {where} {row['by']}", flush=True)
    tell(mutants, results)


if __name__ == "__main__":
    main()
