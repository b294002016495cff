"""Every command, file and example of the pages works as printed, in the order of its page."""

from __future__ import annotations

import doctest
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import sumo
from command import loopgate

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
LONG = {
    "audit",
    "recipes",
    "watch",
    *(f"studies/{name}" for name in ("certified-gate", "queues", "theory", "throughput")),
}
PAGES = sorted(str(file.relative_to(DOCS).with_suffix("")) for file in DOCS.rglob("*.md"))
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```', re.MULTILINE | re.DOTALL)

NOT_RUN = {
    "start": ["python3 -m venv", "pip install "],  # what installs it
    "troubleshooting": [  # the reader's own files
        *("loopgate run some.sumocfg --gate open", "sumo -c some.sumocfg"),
        *("loopgate read-fcd fcd.xml.gz some.sumocfg", "loopgate replay out/mine"),
    ],
    "stops": ["pip install rtree", "python gtfs2pt.py", "loopgate "],  # the reader's own feed
    "README": ["network + loops", " "],  # a picture
    "sweeps": [
        *("out/first_sweep/", "  "),  # a list of files
        *("pip install", "dask ", "loopgate sweep grid.toml --executor dask"),  # several machines
    ],
    "your-own": ["[project.entry-points.", "cautious = "],  # of the reader's own package
    "proofs/README": ["make proofs"],  # needs Rocq
    "vehicles": ["make vehicles-alone"],  # a long study
    "proofs/vehicles": [" "],  # a picture of states
}
"""Lines of blocks of plain text: no test can run them."""

NOT_IMPORTED = "from dask_jobqueue"
"""Begins a block of Python for a cluster."""

SHORTER = {
    r"^(loopgate run (?!.*--duration).*)$": r"\1 --duration 60",
    r"^(loopgate run (?!.*watch).* --duration) (?:3|6|36)00": r"\1 60",
    r"^(loopgate run .* --vehicles) (?:300|400)": r"\1 60",
    r"^(loopgate run .* --duration) 900 --incidents": r"\1 180 --incidents",
    r"^from = 100$": "from = 20",
    r'^to = "0:06:40"$': 'to = "0:01:20"',
    r"^from = 500$": "from = 100",
    r"^to = 800\b": "to = 150",
    r"^(loopgate run .* --vehicles) 20 (.*--decide processes)": r"\1 8 \2",
    r"^(loopgate study montecarlo .*) --rounds 10000": r"\1 --rounds 200",
    r"^(loopgate study verify --random) 100": r"\1 10",
    r"^(python analysis/road_systems.py)$": r"\1 --limit 100 --vehicles 3 -o road-systems.csv",
    r"^(python analysis/certified_study.py) --systems 20000": r"\1 --systems 20 -o certified",
    r"^(python analysis/bench_certified.py)$": r"\1 --robots 8 --moves 20",
    r"^(python analysis/counterexamples.py) --systems 20000": r"\1 --systems 6 --out counterexamples",
    r"^(python analysis/throughput.py) --seeds 5 --write": (
        r"\1 --seeds 1 --vehicles 60 --duration 20 --rules oldest --out study"
    ),
    r"^(python analysis/(?:throughput_city|alone).py) --seeds 5 --write": (
        r"\1 --seeds 1 --vehicles 60 150 --duration 20 --rules certified --out study"
    ),
    r"^(python analysis/throughput_lights.py) --seeds 5 --duration 900 --write": (
        r"\1 --seeds 1 --vehicles 50 60 --duration 20 --rules certified --out study"
    ),
    r"^(python analysis/limit.py) --seeds 5 (--step \S+) --write": (
        r"\1 --seeds 1 --vehicles 60 --duration 20 --rules certified \2 --out study"
    ),
    r"^(loopgate sweep .*)$": r"\1 --workers 1",
    r"^duration_s = 300$": "duration_s = 30",
    r"^vehicles = \[10, 40, 80\]$": "vehicles = [10, 40]",
    r"^vehicles = \[100, 300, 500\]$": "vehicles = [100, 300]",
    r"^seed = \{.*$": "seed = [1, 2]",
}
"""What takes minutes or hours as printed is run with a shorter time, fewer vehicles, or fewer systems.

And sweeps in one process besides this one: to start another takes longer than its share of the runs.
"""

OUTCOMES = {0, 3}
"""Exit codes of commands that do what they say; 3 is a run that locks up, as some are meant to."""

NOT_SAFE = (
    "loopgate study verify --gate cautious.py:Cautious --random 20",
    "loopgate study verify --random 100",
)
"""Commands that end with 1, since what they find is what the page says."""


@pytest.fixture(autouse=True)
def _reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand where a reader stands: the repository's files, a configuration of one's own."""
    for name in ("networks", "routes", "src"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "analysis").mkdir()
    for script in (ROOT / "analysis").glob("*.py"):
        (tmp_path / "analysis" / script.name).symlink_to(script)
    game = Path(sumo.SUMO_HOME) / "tools" / "game" / "cross"
    own = f'<net-file value="{game}/cross.net.xml"/><route-files value="{game}/cross.rou.xml"/>'
    (tmp_path / "my.sumocfg").write_text(f"<configuration>{own}</configuration>")  # stands for the reader's
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BROWSER", "true")  # opens nothing
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


def shorter(text: str) -> str:
    """Return lines of a command or a file as they are run here."""
    for printed, run in SHORTER.items():
        text = re.sub(printed, run, text, flags=re.MULTILINE)
    return text


def run_line(line: str) -> None:
    """Run a command as it is printed, or shorter."""
    program, *words = shlex.split(shorter(line))
    assert "--write" not in words, f"{line}: it would renew the page with what it finds in seconds"
    if program == "loopgate":
        done = loopgate(*words)
    else:
        done = subprocess.run([program, *words], check=False, capture_output=True, text=True)
    wanted = {1} if line.startswith(NOT_SAFE) else OUTCOMES
    assert done.returncode in wanted, f"{line}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[pytest.mark.slow] if page in LONG else []) for page in PAGES]
)
def test_the_page_does_what_it_says(page: str) -> None:
    """Commands run, files are written, Python prints what is printed."""
    if page == "env":
        pytest.importorskip("pettingzoo")
    known: dict[str, object] = {}
    for kind, title, text in BLOCK.findall((DOCS / f"{page}.md").read_text(encoding="utf-8")):
        if title:
            Path(title).write_text(shorter(text), encoding="utf-8")
        elif kind == "sh":
            for line in text.replace("\\\n", " ").splitlines():
                run_line(line)
        elif kind == "pycon":
            test = doctest.DocTestParser().get_doctest(text, known, page, None, 0)
            assert doctest.DocTestRunner().run(test, clear_globs=False).failed == 0
            known = test.globs
        elif kind == "python":
            if not text.startswith(NOT_IMPORTED):
                exec(text, known)  # noqa: S102  that is what a reader does with it
        else:
            expected = NOT_RUN.get(page, [])
            assert all(any(line.startswith(start) for start in expected) for line in text.splitlines()), text


@pytest.mark.parametrize("page", PAGES)
def test_every_example_is_a_block_that_can_be_run(page: str) -> None:
    """An indented example would not be found by the test above; a target or script that is named is there."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    outside = BLOCK.sub("", text)
    assert re.findall(r"(?<=\n\n)    .*", outside) == []
    assert "```" not in outside
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"`make ([a-z-]+)", text)) <= targets
    for script in re.findall(r"`python (analysis/\w+\.py)", text):
        assert (ROOT / script).is_file(), script


def test_pages_that_the_site_lists_are_all_there_are() -> None:
    """A page that is added has to be found; one that is gone must not be promised."""
    listed = set(re.findall(r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    made = "reference/", "notebooks/"  # of the code, and of the notebooks
    assert {name for name in listed if not name.startswith(made)} == {f"{page}.md" for page in PAGES}


def test_the_site_is_built_without_a_broken_link(tmp_path: Path) -> None:
    """Links, anchors and the pages made from the code; nothing on it is fetched from elsewhere."""
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True, env=quiet)
    assert (done.returncode, done.stderr) == (0, "")
    pages = list(tmp_path.rglob("*.html"))
    assert len(pages) > 20
    fetched = re.compile(r'<(?:script|link|img)[^>]+(?:src|href)="?(https?:|//)')
    assert [page.name for page in pages if fetched.search(page.read_text(encoding="utf-8"))] == []
    assert "--abstraction" in (tmp_path / "reference" / "commands.html").read_text(encoding="utf-8")
    assert "lap_quantiles_s" in (tmp_path / "reference" / "columns.html").read_text(encoding="utf-8")
