"""Facts about a sweep: its settings, its progress, its failures, and the commands that repeat it."""

from typing import Any

import pandas as pd

from loopgate.report.items import TableItem
from loopgate.results import row_columns as c
from loopgate.runs.results import Results

_MOST_VALUES = 12
_MOST_COMMANDS = 60


def progress(results: Results) -> str:
    """Return one sentence on the progress of the sweep."""
    runs = results.runs
    planned = int(results.manifest.get("runs", len(runs)))
    failed = int((runs[c.STATUS] == c.STATUS_FAILED).sum())
    if runs.empty:
        return f"There are no runs yet, of {planned} planned." if planned else "There are no runs."
    there = f"{len(runs)} run{'s' if len(runs) != 1 else ''}"
    text = f"{there} of {planned} planned are there" if planned > len(runs) else f"{there}"
    if failed == len(runs):
        return f"{text}; all failed, so there is nothing to compare. The reasons are below."
    codes = len(runs[c.LOOPGATE_CODE].dropna().unique())
    mixed = f" They were made by {codes} different codes of loopgate: compare with care." if codes > 1 else ""
    return f"{text}{f'; {failed} failed' if failed else ', none failed'}.{mixed}"


def facts(results: Results) -> list[tuple[str, str]]:
    """Return the settings of the runs, as names and values."""
    runs = results.runs
    rows = [("Results", ", ".join(map(str, results.folders))), *(("Note", note) for note in results.notes)]
    for name, column in (
        ("Networks", c.NETWORK),
        ("Gates", c.GATE),
        ("Abstraction", c.ABSTRACTION),
        ("Negotiation", c.NEGOTIATION),
        ("Lights", c.LIGHTS),
        ("Vehicles", c.VEHICLES),
        ("Loops", c.LOOPS),
        ("Seeds", c.SEED),
        ("Simulated time [s]", c.DURATION),
        ("Warm-up [s]", c.WARMUP),
        ("loopgate", c.LOOPGATE_VERSION),
        ("loopgate, its code", c.LOOPGATE_CODE),
        ("SUMO", c.SUMO_VERSION),
        ("Python", c.PYTHON_VERSION),
    ):
        values = [v for v in runs[column].dropna().unique() if v != ""]
        if values:
            rows.append((name, _listed(values)))
    if runs[c.TOOK].notna().any():
        rows += [
            ("Computing time", f"{runs[c.TOOK].sum() / 3600:.2f} h in {runs[c.WORKER].nunique()} processes"),
            ("Peak memory of a process", f"{runs[c.PEAK_MEMORY].max():.0f} MiB"),
        ]
    finished = runs[c.FINISHED].dropna()
    if len(finished):
        rows.append(("Made", f"{finished.min():%Y-%m-%d %H:%M} to {finished.max():%Y-%m-%d %H:%M} UTC"))
    return rows


def failures(results: Results) -> TableItem | None:
    """Return the failed runs by reason, or None if none failed."""
    failed = results.runs[results.runs[c.STATUS] == c.STATUS_FAILED]
    if failed.empty:
        return None
    table = (
        failed.groupby(c.ERROR, dropna=False)
        .agg(runs=(c.KEY, "size"), example=(c.KEY, "first"), scenario=(c.SCENARIO, "first"))
        .reset_index()
        .sort_values("runs", ascending=False, kind="stable")
    )
    return TableItem("failures", "Runs that failed", table)


def commands(results: Results) -> dict[str, Any]:
    """Return the command of a sweep, and for each setting the command of its first run."""
    runs = results.runs
    known = runs[runs[c.COMMAND].notna()].sort_values([c.NETWORK, c.GATE, c.VEHICLES, c.SEED], kind="stable")
    first = known.drop_duplicates([c.NETWORK, c.GATE, c.VEHICLES])
    return {
        "sweep": results.manifest.get("command"),
        "runs": list(first[c.COMMAND].head(_MOST_COMMANDS)),
        "more": len(known) - min(len(first), _MOST_COMMANDS),
    }


def _listed(values: list[Any]) -> str:
    numbers = all(pd.api.types.is_number(value) for value in values)
    ordered = sorted(values) if numbers else sorted(map(str, values))
    texts = [f"{value:g}" if numbers else str(value) for value in ordered]
    if len(texts) <= _MOST_VALUES:
        return ", ".join(texts)
    return (
        f"{texts[0]} to {texts[-1]} ({len(texts)} values)"
        if numbers
        else f"{', '.join(texts[:5])}, ... ({len(texts)})"
    )
