"""The lock file covers what pyproject.toml asks for, and nothing of the machine it was made on."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")


def test_every_dependency_is_locked_at_a_version_that_fits() -> None:
    """Also those for development; forgetting ``make lock`` breaks every fresh clone."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    locked: dict[str, list[str]] = {}
    for name, version in re.findall(r"^([A-Za-z0-9._-]+)==([^ ]+)", LOCK, re.MULTILINE):
        locked.setdefault(canonicalize_name(name), []).append(version)
    for line in project["dependencies"] + project["optional-dependencies"]["dev"]:
        wanted = Requirement(line)
        found = locked.get(canonicalize_name(wanted.name), [])
        assert found, f"{line}: not in requirements.lock; run 'make lock'"
        assert all(wanted.specifier.contains(v, prereleases=True) for v in found), (
            f"{line}: locked at {found}"
        )


def test_no_place_is_named() -> None:
    """Versions and hashes only: wherever packages come from is the user's choice."""
    assert not re.search(r"https?:|file:|--index-url|--find-links|--extra-index-url", LOCK)


def test_every_package_has_hashes() -> None:
    """The installer refuses anything else."""
    entries = re.split(r"^(?=[A-Za-z0-9])", LOCK, flags=re.MULTILINE)[1:]
    assert all("--hash=sha256:" in entry for entry in entries)
