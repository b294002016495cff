"""The notebooks of the documentation run from the first cell to the last."""

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


def test_there_are_notebooks_without_output() -> None:
    """Three; output would be of another version, and is large."""
    assert len(NOTEBOOKS) == 3
    for notebook in NOTEBOOKS:
        found = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") for cell in found)
