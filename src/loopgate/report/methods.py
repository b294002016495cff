"""The methods paragraph of a report, to be pasted into a paper: versions, seeds, settings, definitions."""

import pandas as pd

from loopgate.analysis.columns import SERIES
from loopgate.plots.style import series_order
from loopgate.report.items import Section
from loopgate.results import row_columns as c

_DEFINED = (
    "Throughput is the distance that all vehicles drove, divided by the time measured; mean speed is this "
    "distance divided by the time that vehicles were on the road. A run locks up when vehicles wait for each "
    "other in a circle. Means over runs are given with 95 % intervals by Student's t, shares of runs with "
    "Wilson's."
)
_OF_WATCH = (
    "The idleness of a street is the time since a vehicle last entered it; a promise to see a street again "
    "within a time is kept if its idleness never exceeds that time."
)


def methods(section: Section, failed: int) -> str:
    """Return the paragraph; `failed` runs of the whole report are left out of its figures."""
    runs = section.runs
    on = f" on {_values(runs, c.LOOPS)} loops" if runs[c.LOOPS].gt(0).any() else ""
    seeds = runs[c.SEED].nunique()
    sumo, own = _values(runs, c.SUMO_VERSION), _values(runs, c.LOOPGATE_VERSION)
    made_with = f"Eclipse SUMO {sumo} (Lopez et al. 2018) and loopgate {own}{_code(runs)}"
    of_runs = f"{len(runs)} run{'s' if len(runs) > 1 else ''} with {_values(runs, c.VEHICLES)} vehicles{on}"
    with_seeds = f"the seed{'s' if seeds > 1 else ''} {_values(runs, c.SEED)}"
    time = f"{_values(runs, c.DURATION)} s after a warm-up of {_values(runs, c.WARMUP)} s"
    parts = [
        f"Traffic in the road network {section.network} was simulated with {made_with}.",
        f"{of_runs} and {with_seeds} measured {time}{' each' if len(runs) > 1 else ''}.",
        f"{failed} runs failed and are left out." if failed else "",
        f"Rules: {'; '.join(_rules(runs))}.",
        "Runs of equal seeds have equal loops and starts." if len(runs) > 1 else "",
        _DEFINED if section.watch is None else _OF_WATCH,
    ]
    return " ".join(filter(None, parts))


def _rules(runs: pd.DataFrame) -> list[str]:
    rules = []
    for name in series_order(runs[SERIES]):
        part = runs[runs[SERIES] == name]
        asked = [f"gate {_values(part, c.GATE)}"]
        for column in (c.ABSTRACTION, c.NEGOTIATION, c.LIGHTS):
            gated = column == c.LIGHTS or _values(part, c.GATE) != "open"
            if gated and (value := _values(part, column)):
                asked.append(f"{column} {value}")
        rules.append(f"{name} ({', '.join(asked)})")
    return rules


def _values(runs: pd.DataFrame, column: str) -> str:
    """Return the values of a column, runs of whole numbers as a span."""
    values = [value for value in runs[column].dropna().unique() if value != ""]
    if not all(pd.api.types.is_number(value) for value in values):
        return ", ".join(sorted(map(str, values)))
    numbers = sorted(float(value) for value in values)
    whole = [*map(int, numbers)] == numbers
    if len(numbers) > 2 and whole and numbers[-1] - numbers[0] == len(numbers) - 1:  # noqa: PLR2004
        return f"{numbers[0]:.0f} to {numbers[-1]:.0f}"
    return ", ".join(f"{number:.0f}" if number == int(number) else f"{number:g}" for number in numbers)


def _code(runs: pd.DataFrame) -> str:
    codes = _values(runs, c.LOOPGATE_CODE)
    return f" (code {codes})" if codes else ""
