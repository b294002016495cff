"""Every command, file and example of the guide works as printed, in the order of its page."""

from __future__ import annotations

import doctest
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("start", "tutorial", "watch", "which", "your-own", "concepts", "stops", "troubleshooting")
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```', re.MULTILINE | re.DOTALL)

NOT_RUN = {
    "start": ["python3 -m venv", "pip install sumo-loopgate"],  # what installs it
    "troubleshooting": ["loopgate run some.sumocfg --gate open"],  # the reader's own file
}
"""Lines of blocks of plain text: no test can run them."""

OUTCOMES = {0, 3}
"""Exit codes of commands that do what they say; 3 is a run that locks up, as some are meant to."""

NOT_SAFE = ("loopgate verify --gate cautious.py:Cautious --random 20",)
"""Commands that end with 1, since what they find is what the page says."""


@pytest.mark.parametrize("page", PAGES)
def test_the_page_does_what_it_says(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands run, files are written, Python prints what is printed."""
    for name in ("networks", "routes"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    known: dict[str, object] = {}
    for kind, title, text in BLOCK.findall((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")):
        if title:
            Path(title).write_text(text, encoding="utf-8")
        elif kind == "sh":
            for line in text.replace("\\\n", " ").splitlines():
                done = subprocess.run(shlex.split(line), check=False, capture_output=True, text=True)
                wanted = {1} if line in NOT_SAFE else OUTCOMES
                assert done.returncode in wanted, f"{line}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
        elif kind == "pycon":
            test = doctest.DocTestParser().get_doctest(text, known, page, None, 0)
            result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(
                test, clear_globs=False
            )
            known = test.globs
            assert result.failed == 0
        else:
            assert kind == "text", f"{page}: a block of {kind} that no test runs"
            expected = NOT_RUN.get(page, [])
            assert all(any(line.startswith(start) for start in expected) for line in text.splitlines()), text


def test_pages_that_the_site_lists_are_all_there_are() -> None:
    """A page that is added has to be found; one that is gone must not be promised."""
    listed = set(re.findall(r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    there = {str(file.relative_to(ROOT / "docs")) for file in (ROOT / "docs").rglob("*.md")}
    assert {name for name in listed if not name.startswith("reference/")} == there


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
