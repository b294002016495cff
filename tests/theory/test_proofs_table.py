"""The table that maps lemmas to the program names what is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROOFS = ROOT / "docs" / "proofs"
ROWS = [
    [cell.strip() for cell in line.strip().strip("|").split("|")]
    for line in (PROOFS / "README.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| `")
]


def quoted(cell: str) -> list[str]:
    """Return what stands in backquotes."""
    return re.findall(r"`([^`]+)`", cell)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: "-".join(quoted(" ".join(row[:2]))))
def test_what_a_row_names_is_there(row: list[str]) -> None:
    """The theorem in its file, the functions in the files that stand before them, the tests."""
    file, theorems, _, program, compared = row
    script = (PROOFS / quoted(file)[0]).read_text(encoding="utf-8")
    for name in quoted(theorems):
        assert re.search(rf"^(Theorem|Lemma) {name}\b", script, re.MULTILINE), name
    source = ""
    for name in quoted(program):
        if name.endswith(".py"):
            source = (ROOT / "src" / "loopgate" / name).read_text(encoding="utf-8")
        else:
            for part in name.split("."):
                assert re.search(rf"^\s*(def|class) {part}\b", source, re.MULTILINE), name
    tests = "".join(p.read_text(encoding="utf-8") for p in (ROOT / "tests").rglob("test_*.py"))
    for name in quoted(compared):
        if name.endswith(".py"):
            assert any(ROOT.glob(name)) or any((ROOT / "tests").rglob(name)), name
        else:
            assert f"def {name}(" in tests, name


def test_the_target_checks_every_file() -> None:
    """`make proofs` knows all files."""
    made = (ROOT / "Makefile").read_text(encoding="utf-8")
    names = re.search(r"for name in ([\w ]+); do", made.split("\nproofs:")[1])
    assert names is not None
    assert set(names.group(1).split()) == {p.stem for p in PROOFS.glob("*.v")}


def test_each_file_prints_what_it_assumes() -> None:
    """Of all that the table names."""
    printed = "".join(p.read_text(encoding="utf-8") for p in PROOFS.glob("*.v"))
    for row in ROWS:
        for name in quoted(row[1]):
            assert f"Print Assumptions {name}." in printed, name
