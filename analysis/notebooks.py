"""Run the notebooks of the documentation, and store them with their tables and pictures.

    python analysis/notebooks.py

Each runs in an empty folder. `analysis/docs_pages.py` makes a page of the site of each, from what is stored.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import vl_convert

FOLDER = Path(__file__).parents[1] / "docs" / "notebooks"


def shown(value: object) -> dict[str, Any]:
    """Return what a notebook shows of a value: a picture of a chart, a table as HTML, or its text."""
    text = {"text/plain": repr(value).splitlines(keepends=True)}
    if hasattr(value, "to_dict") and hasattr(value, "configure"):  # a chart
        png = vl_convert.vegalite_to_png(json.dumps(value.to_dict()))
        return {"image/png": base64.b64encode(png).decode(), "text/plain": [f"<{type(value).__name__}>"]}
    rich = getattr(value, "_repr_html_", None)
    return {"text/html": rich().splitlines(keepends=True), **text} if rich is not None else text


def run(cells: list[dict[str, Any]], name: str) -> None:
    """Run the code cells in the working directory, and put what they show into their outputs."""
    known: dict[str, object] = {}
    count = 0
    for cell in cells:
        if cell["cell_type"] != "code":
            continue
        count += 1
        body = ast.parse("".join(cell["source"]))
        last = body.body.pop() if isinstance(body.body[-1], ast.Expr) else None
        said = io.StringIO()
        cell["outputs"], cell["execution_count"] = [], count
        with contextlib.redirect_stdout(said):
            exec(compile(body, name, "exec"), known)  # noqa: S102 - that is what a notebook does with it
            value = None
            if isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), name, "eval"), known)  # noqa: S307 - as above
        if said.getvalue():
            lines = said.getvalue().splitlines(keepends=True)
            cell["outputs"].append({"output_type": "stream", "name": "stdout", "text": lines})
        if value is not None:
            result = {"output_type": "execute_result", "execution_count": count, "metadata": {}}
            cell["outputs"].append({**result, "data": shown(value)})


def main() -> None:
    """Run all notebooks."""
    for file in sorted(FOLDER.glob("*.ipynb")):
        notebook = json.loads(file.read_text(encoding="utf-8"))
        before = Path.cwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                run(notebook["cells"], file.name)
            finally:
                os.chdir(before)
        file.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
