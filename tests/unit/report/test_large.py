"""A hundred thousand rows: the report takes no more time for each than for fewer, and little memory."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.runs.results import Results

FEW, MANY, CHUNK, EDGES = 10_000, 100_000, 1000, 80
REPORT = """
import sys, time
from loopgate.runs.results import read_results
from loopgate.report.page import write_report
from loopgate.sweep.task import peak_memory_mb
begin = time.process_time()
write_report(read_results(sys.argv[1]), sys.argv[2])
print(time.process_time() - begin, peak_memory_mb())
"""

Make = Callable[..., Results]


@pytest.mark.slow
def test_a_hundred_thousand_rows(make: Make, tmp_path: Path) -> None:
    """Ten times the rows take less than ten times as long, and 2 GB; each has lists for 80 edges and a key.

    Compared is processor time of the same machine, so that neither its speed nor what else it does counts.
    """
    taken = {}
    for rows in (FEW, MANY):
        folder = tmp_path / str(rows)
        _write_rows(make, folder, rows)
        command = [sys.executable, "-c", REPORT, str(folder), str(tmp_path / "r.html")]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        taken[rows], megabytes = map(float, output.split())
        assert f"{rows} runs, none failed" in (tmp_path / "r.html").read_text(encoding="utf-8")
    assert taken[MANY] < MANY / FEW * taken[FEW]
    assert megabytes < 2000


def _write_rows(make: Make, folder: Path, count: int) -> None:
    """Write rows like those of one small sweep, a thousand times as many, all numbers different."""
    few = make({"vehicles": [10, 20, 40, 60, 80, 120, 160], "gate": ["open", "certified"], "seed": [1]})
    table = pq.read_table(few.folders[0] / "rows", schema=ROW_SCHEMA).to_pylist()
    (folder / "rows").mkdir(parents=True)
    (folder / "edges").mkdir()
    random = np.random.default_rng(1)
    edges = few.edge_sets[table[0]["edge_set"]]
    wide = edges.iloc[np.arange(EDGES) % len(edges)].assign(edge=[f"e{n}" for n in range(EDGES)])
    wide.to_parquet(folder / "edges" / "wide.parquet", index=False)
    for begin in range(0, count, CHUNK):
        rows = []
        for number in range(begin, begin + CHUNK):
            row = dict(table[number % len(table)])
            row |= {"key": f"{number:016x}", "seed": number, "edge_set": "wide"}
            scenario = {**json.loads(row["scenario"]), "seed": number}
            row |= {"scenario": json.dumps(scenario), "km_per_h": row["km_per_h"] * random.uniform(0.9, 1.1)}
            for name in ("edge_visits", "edge_hold_s", "edge_mean_revisit_s", "edge_max_revisit_s"):
                row[name] = random.uniform(1, 100, EDGES).astype(np.float32)
            rows.append(row)
        chunk = pa.Table.from_pylist(rows, schema=ROW_SCHEMA)
        pq.write_table(chunk, folder / "rows" / f"chunk-{begin}.parquet", compression="zstd")
