"""The notebooks of the documentation run from first to last cell, and are stored with their pictures."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import matplotlib as mpl
import pytest

pytestmark = pytest.mark.sumo

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "docs" / "notebooks").glob("*.ipynb"))


def cells(notebook: Path) -> list[str]:
    """Return the code of a notebook, cell by cell."""
    found = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == "code"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebook_runs(
    notebook: Path, undrawn: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In an empty folder; what ends a cell is shown, as a notebook shows it."""
    del undrawn
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    known: dict[str, object] = {}
    for code in cells(notebook):
        body = ast.parse(code)
        last = body.body.pop() if isinstance(body.body[-1], ast.Expr) else None
        exec(compile(body, notebook.name, "exec"), known)  # noqa: S102  that is what a reader does with it
        if isinstance(last, ast.Expr):
            shown = eval(compile(ast.Expression(last.value), notebook.name, "eval"), known)  # noqa: S307  as above
            rich = getattr(shown, "_repr_html_", None)
            assert repr(shown) if rich is None else rich()


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_stored_with_what_it_shows(notebook: Path) -> None:
    """`analysis/notebooks.py` stores each last line with its value; one at least is a picture."""
    found = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    coded = [cell for cell in found if cell["cell_type"] == "code"]
    for cell in coded:
        ends = isinstance(ast.parse("".join(cell["source"])).body[-1], ast.Expr)
        assert bool(cell["outputs"]) == ends
        assert cell["execution_count"]
    pictures = [o for cell in coded for o in cell["outputs"] if "image/png" in o.get("data", {})]
    assert pictures
    assert notebook.stat().st_size < 500_000
