"""The options of `loopgate inspect` that both abstractions share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["Wanted"]


@dataclass(frozen=True, slots=True)
class Wanted:
    """Options of the command `loopgate inspect`.

    Attributes
    ----------
    vehicle_length_m
        Instead of the file's [m].
    seed
        Of the starting places.
    picture, additional, out
        Files to write, if any: the map, the shapes for SUMO's own tools, the system.
    every
        Whether long tables are printed in full.
    as_json
        Whether JSON is printed instead of tables.
    """

    vehicle_length_m: float | None
    seed: int
    picture: Path | None
    additional: Path | None
    out: Path | None
    every: bool
    as_json: bool
