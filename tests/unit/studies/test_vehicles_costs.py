"""The figures of what range, loss and delay cost are those of the table; the table is that of the rows."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import vehicles_costs


@pytest.mark.parametrize("name", sorted(vehicles_costs.AXES))
def test_figures_are_those_that_are_drawn_from_the_table(name: str) -> None:
    """`make vehicles-costs` changes nothing."""
    drawn = (vehicles_costs.IMAGES / f"vehicles-{name}.svg").read_text(encoding="utf-8")
    assert drawn == vehicles_costs.drawn(name)
    usual = {key: value for key, value in vehicles_costs.USUAL.items() if key != name}
    table = vehicles_costs.read()
    points = table[(table[list(usual)] == pd.Series(usual)).all(axis="columns")]
    assert len(points) > 4
    assert drawn.count("Z") >= len(points)  # a marker for each


def test_the_table_has_means_of_seeds_and_counts_what_is_wrong(tmp_path: Path) -> None:
    """A row that is in two files counts once."""
    rows = [
        (seed, decide, share, clean)
        for seed, decide, share, clean in (
            (1, "central", 1.0, True),
            (1, "vehicles:loss=0.2", 0.8, True),
            (2, "vehicles:loss=0.2", 0.9, False),
            (2, "vehicles:loss=0.2", 0.9, False),
            (1, "vehicles:delay=1", 0.6, True),
        )
    ]
    runs = pd.DataFrame(rows, columns=["seed", "decide", "of_central", "clean"])
    counts = dict.fromkeys(("collisions", "deadlocks", "unsafe", "given_back"), 0)
    runs = runs.assign(part="costs", vehicles=300, duration_s=600.0, per_move=5.0, **counts)
    runs.to_csv(tmp_path / "rows.csv", index=False)
    text = vehicles_costs.collected([tmp_path / "rows.csv"])
    assert "| 0.2 | 0.1 | 150 | 2 | 0.850 | 0.800 | 0.900 | 5.00 | 0 |" in text
    assert "| 0 | 1 | 150 | 1 | 0.600 | 0.600 | 0.600 | 5.00 | 0 |" in text
    assert "faults in all: 1." in text
