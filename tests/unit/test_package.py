"""What the package says of itself where no file of the repository is beside it."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_the_readme_of_the_package_names_no_file_of_the_repository() -> None:
    """A page elsewhere shows no picture by a relative address, and a link by one leads nowhere."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for change in PROJECT["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]:
        text = re.sub(change["pattern"], change["replacement"], text)
    addresses = re.findall(r"\]\(([^)]*)\)", text)
    assert addresses
    assert all(address.startswith("https://") for address in addresses), addresses


def test_authors_are_those_of_the_citation() -> None:
    """One name in both."""
    (author,) = PROJECT["project"]["authors"]
    assert f"- name: {author['name']}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
