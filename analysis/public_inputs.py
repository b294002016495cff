"""Drive public scenarios of SUMO under its own rules and under the gate, and say what becomes of each.

    python analysis/public_inputs.py FOLDER [--draw 30] [--seed 1] [--seconds 300] [--out FILE.csv]

FOLDER holds checkouts of public repositories, a folder each; all their `*.sumocfg` and `*.sumo.cfg` are
candidates. With `--draw`, that many are drawn by the seed, at most three of a repository, among those whose
files are all there and whose network has under 5 MB. Each is driven for that many seconds of simulation, from
its own begin. A line says how SUMO ended and how many vehicles it put in, how `loopgate run` ended, how many
of the vehicles were gated, seconds of processor, collisions of gated vehicles, the audit, and the first
reason why a vehicle is not gated or why the run was refused. Lines already in the file are kept; others are
added.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pandas as pd
import sumo

from loopgate.errors import LoopgateError
from loopgate.network.clock import seconds
from loopgate.network.sumo_config import SumoConfig, read_sumo_config

COLUMNS = [
    "input",
    "sumo",
    "inserted",
    "loopgate",
    "gated",
    "ordinary",
    "processor_s",
    "collisions",
    "audit",
    "why",
]
OF_ONE, LARGEST_BYTES, PATIENCE_S = 3, 5_000_000, 300.0
SUMO = str(Path(sumo.SUMO_HOME) / "bin" / "sumo")


def candidates(folder: Path) -> dict[str, list[Path]]:
    """Return the configurations of each repository whose files are there, and whose network is not large."""
    found: dict[str, list[Path]] = {}
    for file in sorted([*folder.rglob("*.sumocfg"), *folder.rglob("*.sumo.cfg")]):
        try:
            said = read_sumo_config(file)
            files = (said.net_file, *said.route_files, *said.additional_files)
            if all(one.is_file() for one in files) and said.net_file.stat().st_size < LARGEST_BYTES:
                found.setdefault(file.relative_to(folder).parts[0], []).append(file)
        except LoopgateError:
            continue
    return found


def drawn(folder: Path, count: int, seed: int) -> list[Path]:
    """Return so many configurations, or all of them, at most three of a repository."""
    rng = random.Random(seed)
    some = [rng.sample(files, min(OF_ONE, len(files))) for files in candidates(folder).values()]
    all_of_them = [file for files in some for file in files]
    return sorted(rng.sample(all_of_them, min(count or len(all_of_them), len(all_of_them))))


def seconds_of(said: SumoConfig, most_s: float) -> tuple[float, float]:
    """Return when a scenario begins [s], and for how long it is driven [s]."""
    begin_s = seconds(said.options.get("begin", "0"))
    end_s = seconds(said.options.get("end", "-1"))
    return begin_s, min(most_s, end_s - begin_s) if end_s > begin_s else most_s


def drive(file: Path, most_s: float) -> dict[str, object]:
    """Drive a scenario both ways; return its row without the name."""
    begin_s, duration_s = seconds_of(read_sumo_config(file), most_s)
    own, spent = _go([SUMO, "-c", str(file), "--end", f"{begin_s + duration_s:g}", *_QUIET], file.parent)
    inserted = re.search(r"Inserted: (\d+)", own[1] + own[2])
    row: dict[str, object] = {"sumo": own[0], "inserted": int(inserted[1]) if inserted else None}
    command = [sys.executable, "-m", "loopgate", "run", str(file), "--duration", f"{duration_s:g}", "--json"]
    (code, out, err), spent = _go(command, file.parent)
    row |= {
        "loopgate": code,
        "processor_s": round(spent, 1),
        "why": _last_line(err) if code not in (0, 4) else "",
    }
    if out.strip().startswith("{"):
        said = json.loads(out)
        others = said.get("others") or {}
        reasons = [line for line in said.get("warnings", []) if "ordinary traffic" in line]
        row |= {
            "gated": said.get("departed", 0) if said.get("gate") != "open" else 0,
            "ordinary": others.get("vehicles", 0),
            "collisions": said.get("collisions", 0),
            "audit": said["audit"] if isinstance(said["audit"], str) else "findings",
            "why": row["why"] or (_reason(reasons[0]) if reasons else ""),
        }
    return row


_QUIET = ("--no-step-log", "--duration-log.statistics", "--no-warnings")


def _go(command: list[str], folder: Path) -> tuple[tuple[int, str, str], float]:
    before_s = _spent_s()
    said = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE_S, cwd=folder, env=said, check=False
        )
        return (done.returncode, done.stdout, done.stderr), _spent_s() - before_s
    except subprocess.TimeoutExpired:
        return (124, "", f"not ended after {PATIENCE_S:g} s"), _spent_s() - before_s


def _spent_s() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def _reason(line: str) -> str:
    return re.sub(r"^.*?ordinary traffic \(a flow counts once\), .*?: (first \S+: )?", "", line)


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else ""


def _summary(rows: pd.DataFrame) -> str:
    of_sumo = rows[rows["sumo"] == 0]
    ended = of_sumo[of_sumo["loopgate"].isin((0, 3))]
    gated, ordinary = ended["gated"].sum(), ended["ordinary"].sum()
    codes = ", ".join(f"{code}: {count}" for code, count in sorted(Counter(rows["loopgate"]).items()))
    ends = f"SUMO drives {len(of_sumo)}, loopgate {len(ended)} of them (exit codes {codes})"
    shares = (
        f"{gated:.0f} of {gated + ordinary:.0f} vehicles gated, {ended['collisions'].sum():.0f} collisions"
    )
    return f"{len(rows)} inputs; {ends}; {shares}"


def main() -> int:
    """Drive each, print a line, and write the table; exit code 1 if SUMO drives one that loopgate refuses."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    words.add_argument("folder", type=Path)
    words.add_argument("--draw", type=int, default=0, help="number of inputs; all by default")
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--seconds", type=float, default=300.0, help="of simulation, for each")
    words.add_argument("--out", type=Path, default=Path("out/public-inputs.csv"))
    asked = words.parse_args()
    folder = asked.folder.resolve()
    rows = pd.read_csv(asked.out) if asked.out.exists() else pd.DataFrame(columns=COLUMNS)
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    for file in drawn(folder, asked.draw, asked.seed):
        name = str(file.relative_to(folder))
        if name in set(rows["input"]):
            continue
        row = {"input": name, **drive(file, asked.seconds)}
        rows = pd.DataFrame([*rows.to_dict("records"), row], columns=COLUMNS)
        rows.to_csv(asked.out, index=False)
        print("  ".join(str(row.get(column, "")) for column in COLUMNS), flush=True)
    print(_summary(rows))
    of_sumo = rows[rows["sumo"] == 0]
    return 0 if of_sumo["loopgate"].isin((0, 3)).all() else 1


if __name__ == "__main__":
    sys.exit(main())
