"""CITATION.cff names the version that is here, and has what its format asks for."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_citation_is_of_this_version() -> None:
    """Version and license as in pyproject.toml; the keys that CFF 1.2.0 requires."""
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    cited = dict(re.findall(r"^([a-z-]+):[ \n]+(.*)$", text, re.MULTILINE))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert cited["version"] == project["version"]
    assert cited["license"] == project["license"]
    assert {"cff-version", "message", "title", "authors"} <= set(cited)
    assert f"## [{project['version']}] - {cited['date-released']}" in (ROOT / "CHANGELOG.md").read_text(
        encoding="utf-8"
    )
