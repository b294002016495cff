"""The pages of the reference, made from the code when the documentation is built (a hook of MkDocs)."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import click

import loopgate
from loopgate import analysis, plots
from loopgate.cli.main import cli
from loopgate.cli.run import HELP_ALL
from loopgate.results import columns
from loopgate.results.figures import FIGURES
from loopgate.simulation import scenario

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

_COMPLETION = """echo 'eval "$(_LOOPGATE_COMPLETE=bash_source loopgate)"' >> ~/.bashrc
echo 'eval "$(_LOOPGATE_COMPLETE=zsh_source loopgate)"' >> ~/.zshrc
_LOOPGATE_COMPLETE=fish_source loopgate > ~/.config/fish/completions/loopgate.fish"""
_EXIT_CODES = """0: done. 2: bad input, one line says what. 3: a run ended in a deadlock. 4: a gated run was
not clean. 5: vehicles starved behind one that stands. 130: interrupted."""
_NOTEBOOKS = Path(__file__).parents[1] / "docs" / "notebooks"
_HEADINGS = "Tables of a run", "A row of a sweep", "Tables of an analysis"
_ELSEWHERE, _HERE = "https://unpkg.com/iframe-worker/shim", "assets/iframe-worker.js"
_SCENARIO = """# Scenario

The keys of a scenario: in TOML, in a sweep's `[base]` and `[grid]`, and of `Scenario` in Python.
"""


def pages() -> dict[str, str]:
    """Return the pages by name."""
    return {
        "reference/commands.md": commands(),
        "reference/scenario.md": scenario_keys(),
        "reference/columns.md": column_names(),
        "reference/summary.md": figures(),
        "reference/python.md": functions(),
        **{f"notebooks/{file.stem}.md": notebook(file) for file in sorted(_NOTEBOOKS.glob("*.ipynb"))},
    }


def notebook(file: Path) -> str:
    """Return a notebook as a page: its words, code, and what is stored of its tables and pictures."""
    cells = json.loads(file.read_text(encoding="utf-8"))["cells"]
    parts = ["".join(cell["source"]) if cell["cell_type"] == "markdown" else _cell(cell) for cell in cells]
    title, *rest = parts
    return "\n\n".join([title, f"As a notebook: [{file.name}]({file.name}).", *rest]) + "\n"


def _cell(cell: Mapping[str, Any]) -> str:
    """Return the code of a cell, and what it shows."""
    parts = ["```python\n" + "".join(cell["source"]) + "\n```"]
    for output in cell["outputs"]:
        data = {kind: "".join(lines) for kind, lines in output.get("data", {}).items()}
        if "image/png" in data:
            parts.append(
                f'<img alt="What the line above draws" src="data:image/png;base64,{data["image/png"]}">'
            )
        elif "text/html" in data:
            table = re.sub(r"<style.*?</style>|^\s+", "", data["text/html"], flags=re.DOTALL | re.MULTILINE)
            parts.append(table.strip())
        else:
            parts.append("```text\n" + (data.get("text/plain") or "".join(output["text"])).rstrip() + "\n```")
    return "\n\n".join(parts)


def commands() -> str:
    """Return every command with its help, as the terminal shows it."""
    context = click.Context(cli, info_name="loopgate", terminal_width=100)
    parts = ["# Commands", "As `--help` shows them.", _block(cli.get_help(context))]
    for name, command, inner in _every(cli, context):
        inner.meta[HELP_ALL] = True
        parts += [f"## {name}", _block(command.get_help(inner))]
    parts += [
        "## Completion",
        "Let the shell complete commands and options, once per shell:",
        _block(_COMPLETION),
        "## Exit codes",
        _EXIT_CODES,
    ]
    return "\n\n".join(parts) + "\n"


def _every(group: click.Group, context: click.Context) -> Iterator[tuple[str, click.Command, click.Context]]:
    """Yield each command with its name and context, those of groups within behind the group."""
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if command is not None:
            inner = click.Context(command, info_name=name, parent=context, terminal_width=100)
            yield inner.command_path.removeprefix("loopgate "), command, inner
            if isinstance(command, click.Group):
                yield from _every(command, inner)


def _block(text: str) -> str:
    return f"```text\n{text}\n```"


def scenario_keys() -> str:
    """Return every key of a scenario with its default and what its docstring says."""
    said = _attributes(inspect.getdoc(scenario.Scenario) or "")
    rows = []
    for key in dataclasses.fields(scenario.Scenario):
        default = "" if key.default is dataclasses.MISSING else f"`{key.default!r}`".replace("'", '"')
        rows.append(f"| `{key.name}` | {default} | {said.get(key.name, '')} |")
    return f"{_SCENARIO}\n| key | default | meaning |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def _attributes(docstring: str) -> dict[str, str]:
    """Return what a docstring in NumPy's style says of each parameter or attribute."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in docstring.splitlines():
        if re.fullmatch(r"\w+(, \w+)*", line):
            names = line.split(", ")
        elif line.startswith("    ") and names:
            for name in names:
                found[name] = f"{found.get(name, '')} {line.strip()}".strip().replace("|", "\\|")
        else:
            names = []
    return found


def column_names() -> str:
    """Return the columns of all tables with what the comment beside each says."""
    parts = [
        "# Columns",
        "Names of columns, and their units; `loopgate.results.columns` has them as constants.",
    ]
    for title, found in itertools.groupby(_constants(columns), lambda one: one[0]):
        rows = [f"| `{name}` | {said} |" for _, name, said in found]
        parts.append(f"## {title}\n\n| column | meaning |\n|---|---|\n" + "\n".join(rows))
    rows = [f"| `{kind}` | {said} |" for kind, said in _kinds()]
    parts.insert(3, "## Events\n\n| event | meaning |\n|---|---|\n" + "\n".join(rows))
    return "\n\n".join(parts) + "\n"


def _kinds() -> Iterator[tuple[str, str]]:
    """Yield each kind of event and the docstring that follows it."""
    [kinds] = [n for n in ast.parse(inspect.getsource(columns.Event)).body if isinstance(n, ast.ClassDef)]
    for kind, said in itertools.pairwise(kinds.body):
        match kind, said:
            case ast.Assign(value=ast.Constant(value=str(name))), ast.Expr(value=ast.Constant(value=text)):
                yield name, " ".join(str(text).split()).replace("|", "\\|")


def _constants(module: ModuleType) -> Iterator[tuple[str, str, str]]:
    """Yield heading, value and comment of each constant text of a module, and of those a mapping holds.

    The headings are comments that begin with one of `_HEADINGS`. A text is yielded once.
    """
    lines = inspect.getsource(module).splitlines()
    seen = set()
    begins = {n: h for n, line in enumerate(lines, 1) for h in _HEADINGS if line.startswith(f"# {h}")}
    for node in ast.parse("\n".join(lines)).body:
        if not isinstance(node, ast.AnnAssign) or not isinstance(node.target, ast.Name):
            continue
        value = getattr(module, node.target.id)
        written = lines[node.lineno - 1 : node.end_lineno]
        said = " ".join(line.partition("  # ")[2] for line in written).strip().replace("|", "\\|")
        for text in value.values() if isinstance(value, dict) else [value]:
            if isinstance(text, str) and text not in seen:
                seen.add(text)
                yield begins[max(n for n in begins if n <= node.lineno)], text, said


def figures() -> str:
    """Return every figure of ``summary.json`` with its words."""
    rows = [
        f"| {', '.join(f'`{key}`' for key in figure.keys.split())} | {figure.means} |"
        for figure in FIGURES
        if figure.means
    ]
    text = re.sub(r"\]\((?!\w+:)", "](../", "\n".join(rows))
    return f"# summary.json\n\n| key | meaning |\n|---|---|\n{text}\n"


def functions() -> str:
    """Return what a notebook can import, by object: mkdocstrings adds signature, parameters and examples."""
    parts = ["# Python", "What a notebook imports. Each example is run by a test."]
    for title, module in (("loopgate", loopgate), ("loopgate.analysis", analysis), ("loopgate.plots", plots)):
        parts.append(f"## {title}")
        for name in sorted(module.__all__):
            made = getattr(module, name)
            parts.append(f"::: {made.__module__}.{name}\n    options:\n      heading_level: 3")
    return "\n\n".join(parts) + "\n"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages to the site."""
    from mkdocs.structure.files import File  # noqa: PLC0415 - not needed to make pages

    for name, text in pages().items():
        files.append(File.generated(config, name, content=text))
    return files


_FOUND_LATER = {"studies": 0.2, "proofs": 0.2, "reference": 0.3, "options.md": 0.3, "attributes.md": 0.5}
_FOUND_LATER |= {"recipes.md": 0.5, "gallery.md": 0.5}
"""Folders and pages that have every word; the search shows them behind the pages that answer."""


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Weigh the page in the search."""
    del config, files
    first = Path(page.file.src_uri).parts[0]
    if first in _FOUND_LATER:
        page.meta["search"] = {"boost": _FOUND_LATER[first]}
    return markdown


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Take what the search needs from the site itself."""
    del config
    return output.replace(_ELSEWHERE, "../" * page.url.count("/") + _HERE)


def on_post_template(output_content: str, template_name: str, config: MkDocsConfig) -> str:
    """Do the same for the page that says that there is no such page."""
    del template_name, config
    return output_content.replace(_ELSEWHERE, _HERE)


if __name__ == "__main__":
    for page, text in pages().items():
        print(Path(page).name, len(text.split()), "words")
