"""The messages by which vehicles decided in a run, as a table."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from loopgate.analysis.frames import table
from loopgate.results import columns as c


def compute_messages(*, summary: Mapping[str, Any]) -> pd.DataFrame:
    """Return the messages of a run by kind, the most frequent kind first.

    One row per kind: `MESSAGE` (the kind), `MESSAGES` (number of transmissions), `PER_MOVE` (transmissions
    for each move of a vehicle to its next place), `BYTES` (total size as JSON). Empty if one program decided.

    Parameters
    ----------
    summary
        The content of ``summary.json``.

    Examples
    --------
    >>> from loopgate.analysis import compute_messages
    >>> found = {"moves": 2, "by_kind": {"ask": 3, "grant": 2}, "bytes_by_kind": {"ask": 240}}
    >>> compute_messages(summary={"by_messages": found})["per_move"].tolist()
    [1.5, 1.0]
    """
    found = summary.get("by_messages") or {"moves": 0, "by_kind": {}}
    kinds = sorted(found["by_kind"].items(), key=lambda one: (-one[1], one[0]))
    sizes, moves = found.get("bytes_by_kind", {}), max(1, found["moves"])
    rows = (
        {c.MESSAGE: kind, c.MESSAGES: many, c.PER_MOVE: many / moves, c.BYTES: sizes.get(kind, 0)}
        for kind, many in kinds
    )
    return table(rows, [c.MESSAGE, c.MESSAGES, c.PER_MOVE, c.BYTES])
