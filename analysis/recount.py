"""The figures of a run counted again from SUMO's own files, beside what the run says of itself.

``make recount`` drives six runs with ``fcd`` and ``tripinfo``: loops under a gate, the same past closures and
a breakdown, loops under none that lock up and end there, trips under a gate, and the same trips under none,
measured from the beginning and later. It counts distance, speed, standing, hold time, waits by reason, laps,
time to deadlock and delay from ``fcd.xml.gz``,
``tripinfo.xml``, ``events.parquet`` and the route file alone, and compares them with ``summary.json``,
``vehicles.parquet``, ``flow.parquet`` and the row of the run in a table. It shares no code with what it
judges, and ends with exit code 1 where two figures differ.
"""

from __future__ import annotations

import argparse
import gzip
import json
import sys
import tomllib
from math import isnan, nan
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import pandas as pd
from rich.console import Console
from rich.table import Table

from loopgate import Scenario
from loopgate.analysis.rows import read_run_row
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parents[1]
GRID = str(ROOT / "networks" / "grid5-priority.net.xml")
STANDING_MPS = 0.1
PARTS_OF_A_STEP_M = 25.0
"""Nobody drives further in a step of a second [m]."""


class Figure(NamedTuple):
    """A figure: what it is, what the run says, what was counted, and how far these may differ."""

    name: str
    said: float
    counted: float
    within: float

    @property
    def agrees(self) -> bool:
        """Whether they do not differ by more; both may be missing."""
        return abs(self.said - self.counted) <= self.within or (isnan(self.said) and isnan(self.counted))


def read_fcd(folder: Path) -> pd.DataFrame:
    """Return a row per vehicle and step: ``time_s`` (the end of the step), ``vehicle``, ``speed``."""
    rows = list[tuple[float, str, float]]()
    time_s = 0.0
    with gzip.open(folder / "fcd.xml.gz") as file:
        for event, element in ET.iterparse(file, ("start", "end")):  # noqa: S314  SUMO wrote it
            if event == "start" and element.tag == "timestep":
                time_s = float(element.attrib["time"])
            elif event == "end" and element.tag == "vehicle":
                rows.append((time_s, element.attrib["id"], float(element.attrib["speed"])))
            elif event == "end":
                element.clear()
    return pd.DataFrame(rows, columns=["time_s", "vehicle", "speed"])


def _root(file: Path | str) -> ET.Element:
    return ET.parse(file).getroot()  # noqa: S314  SUMO or this script wrote it


def read_tripinfo(folder: Path) -> pd.DataFrame:
    """Return the attributes of each trip that are numbers."""
    if not (folder / "tripinfo.xml").exists():
        return pd.DataFrame()
    rows = [element.attrib for element in _root(folder / "tripinfo.xml").iter("tripinfo")]
    frame = pd.DataFrame(rows).drop_duplicates("id", keep="last").set_index("id")
    wanted = [
        "depart",
        "departDelay",
        "arrival",
        "duration",
        "routeLength",
        "waitingTime",
        "stopTime",
        "timeLoss",
    ]
    return frame[wanted].astype(float)


class Run:
    """The files of a run folder.

    Parameters
    ----------
    folder
        Run with ``fcd``, and with ``tripinfo`` where vehicles drive once.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
        self.scenario = tomllib.loads((folder / "scenario.toml").read_text())
        self.vehicles = pd.read_parquet(folder / "vehicles.parquet").set_index("vehicle")
        self.events = pd.read_parquet(folder / "events.parquet")
        self.flow = pd.read_parquet(folder / "flow.parquet")
        self.step_s = float(self.scenario.get("step_s", 1.0))
        # SUMO writes the time at which a step begins; all else here has that at which it ends.
        self.fcd = read_fcd(folder)
        self.fcd["time_s"] += self.step_s
        self.fcd = self.fcd[self.fcd["vehicle"].isin(self.vehicles.index)]
        self.trips = read_tripinfo(folder)
        self.trips = self.trips[self.trips.index.isin(self.vehicles.index)]
        self.begin_s = (
            float(self.summary["begins_s"]) + self.step_s + float(self.scenario.get("warmup_s", 0.0))
        )
        self.end_s = self.begin_s + float(self.summary["duration_s"])
        first_s = self.fcd.groupby("vehicle")["time_s"].transform("min")
        self.moves = self.fcd[self.fcd["time_s"] > first_s]
        """In the step in which it departs nobody moves."""
        self.once = bool(self.summary.get("trips"))

    def of_vehicles(self) -> pd.DataFrame:
        """Count of each vehicle distance [m], time on the road [s] and standing [s] in the measured time."""
        within = self.moves[
            self.moves["time_s"].gt(self.begin_s + 1e-6) & self.moves["time_s"].le(self.end_s + 1e-6)
        ]
        by = within.assign(stood=within["speed"] < STANDING_MPS).groupby("vehicle")
        found = pd.DataFrame(index=self.vehicles.index)
        found["distance_m"] = by["speed"].sum() * self.step_s
        found["time_s"] = by.size() * self.step_s
        found["stood_s"] = by["stood"].sum() * self.step_s
        found = found.fillna(0.0)
        if self.once:
            all_m = self.moves.groupby("vehicle")["speed"].sum() * self.step_s
            last_m = (self.trips["routeLength"] - all_m).reindex(found.index)
            arrival_s = self.trips["arrival"].reindex(found.index) + self.step_s
            there = (
                last_m.between(0.0, PARTS_OF_A_STEP_M)
                & arrival_s.gt(self.begin_s)
                & arrival_s.gt(self.step_s)
            )
            found.loc[there, "distance_m"] += last_m[there]
            found.loc[there, "time_s"] += self.step_s
        return found

    def laps(self) -> int:
        """Count laps: whole lengths of the loop behind a vehicle, less those before measuring began."""
        length_m = self.vehicles["loop_length_m"]
        until = {name: self.moves[self.moves["time_s"] <= at_s + 1e-6] for name, at_s in self.ends().items()}
        behind = {
            name: (moves.groupby("vehicle")["speed"].sum() * self.step_s).reindex(length_m.index).fillna(0.0)
            // length_m
            for name, moves in until.items()
        }
        return int((behind["end"] - behind["begin"]).sum())

    def ends(self) -> dict[str, float]:
        """Return when measuring began and ended [s]."""
        return {"begin": self.begin_s, "end": self.end_s}

    def delays(self) -> dict[str, float]:
        """Count the means of what ``tripinfo`` and the route file say of trips [s]."""
        gated = self.summary["gate"] != "open"
        trips, own_s = self.trips, self.vehicles["stopped_s"].reindex(self.trips.index)
        held_s = (trips["stopTime"] - own_s).clip(lower=0.0) if gated else 0.0
        loss_s, waiting_s = trips["timeLoss"].clip(lower=0.0) + held_s, trips["waitingTime"] + held_s
        wanted_s = pd.Series(
            {e.get("id"): float(e.get("depart", "0")) for e in _root(self.scenario["routes"]).iter("trip")}
        )
        went_s = self.trips["depart"].where(self.trips["depart"] >= 0.0).reindex(self.vehicles.index)
        delay_s = (went_s.fillna(self.end_s) - wanted_s.reindex(self.vehicles.index)).clip(lower=0.0)
        loss_s, waiting_s = (some.reindex(self.vehicles.index).fillna(0.0) for some in (loss_s, waiting_s))
        arrived = trips["arrival"] >= 0.0
        return {
            "mean_time_loss_s": loss_s.mean(),
            "mean_depart_delay_s": delay_s.mean(),
            "mean_delay_s": (loss_s + delay_s).mean(),
            "worst_delay_s": (loss_s + delay_s).max(),
            "mean_waiting_s": waiting_s.mean(),
            "mean_trip_s": trips.loc[arrived, "duration"].mean(),
            "arrived": float(arrived.sum()),
        }

    def held_s(self) -> float:
        """Count the time that vehicles stand, by SUMO's speeds, from being held until they are let go [s]."""
        told = self.events.loc[
            self.events["event"].isin(("hold", "go")), ["time_s", "vehicle", "event"]
        ].astype({"vehicle": str, "event": str})
        standing = self.moves[
            self.moves["speed"].lt(STANDING_MPS)
            & self.moves["time_s"].gt(self.begin_s + 1e-6)
            & self.moves["time_s"].le(self.end_s + 1e-6)
        ]
        last = pd.merge_asof(
            standing.sort_values("time_s").astype({"vehicle": str}),
            told.sort_values("time_s", kind="stable"),
            on="time_s",
            by="vehicle",
            allow_exact_matches=False,
        )
        return float((last["event"] == "hold").sum() * self.step_s)

    def untimely(self) -> int:
        """Count the refusals for a closed or blocked street at times without closure or breakdown."""
        file = self.scenario.get("incidents")
        known = tomllib.loads(Path(file).read_text()) if file else {}
        told = self.events[self.events["event"] == "refuse"]
        count = 0
        for reason, key in (("closed", "closures"), ("blocked", "breakdowns")):
            at_s = told.loc[told["reason"] == reason, "time_s"]
            spans = [at_s.between(one["from"], one["to"] + self.step_s) for one in known.get(key, ())]
            count += int((~pd.concat(spans, axis=1).any(axis=1)).sum()) if spans else len(at_s)
        return count

    def longest_waits(self) -> dict[str, float]:
        """Count by reason how long one wait was for it at most [s], step by step along the events."""
        told = self.events[self.events["event"].isin(("refuse", "grant"))]
        longest: dict[str, float] = {}
        for _, rows in told.sort_values("time_s", kind="stable").groupby("vehicle", observed=True):
            at, now_s, reason = 0, self.begin_s, ""
            wait: dict[str, float] = {}
            times, events, reasons = (rows[name].tolist() for name in ("time_s", "event", "reason"))
            while now_s < self.end_s - 1e-6:
                while at < len(times) and times[at] <= now_s + 1e-6:
                    if events[at] == "grant":
                        wait, reason = {}, ""
                    else:
                        reason = str(reasons[at])
                    at += 1
                now_s += self.step_s
                if reason:
                    wait[reason] = wait.get(reason, 0.0) + self.step_s
                    longest[reason] = max(longest.get(reason, 0.0), wait[reason])
        return longest

    def deadlock(self) -> dict[str, float]:
        """Count when the first circle closed: when its last vehicle had come to rest."""
        locks = self.summary["deadlocks"]
        if not locks:
            return {}
        among = self.moves[self.moves["vehicle"].isin(locks[0]["vehicles"])]
        among = among[among["time_s"] <= locks[0]["noticed_at_s"] + 1e-6]
        return {"closed_at_s": among.loc[among["speed"] >= STANDING_MPS, "time_s"].max()}


def recount(folder: Path) -> list[Figure]:
    """Return the figures of a run beside those that are counted from SUMO's files."""
    run = Run(folder)
    said, counted, vehicles = run.summary, run.of_vehicles(), run.vehicles
    metres, time_s, hours = counted["distance_m"].sum(), counted["time_s"].sum(), said["duration_s"] / 3600.0
    speed = (counted["distance_m"] / counted["time_s"].where(counted["time_s"] > 0.0)).fillna(0.0)
    flow = run.flow[run.flow["time_s"] > run.begin_s]
    last_s = float(flow["time_s"].max()) if len(flow) else run.begin_s
    driven = run.moves[run.moves["time_s"].gt(run.begin_s + 1e-6) & run.moves["time_s"].le(last_s + 1e-6)]
    measured = run.moves[run.moves["time_s"].gt(run.begin_s + 1e-6)]
    last_steps_m = metres - measured["speed"].sum() * run.step_s  # of those who arrive: FCD has none of them
    row = read_run_row(folder).row
    own_s = vehicles["stopped_s"] if run.once and said["gate"] == "open" else pd.Series(dtype=float)
    found = [
        Figure("distance (km)", said["distance_km"], metres / 1000.0, 1e-3 + 1e-4 * metres / 1000.0),
        Figure("mean speed (m/s)", said["mean_speed_mps"], metres / time_s if time_s else 0.0, 2e-3),
        Figure("throughput (km/h)", said["km_per_h"], metres / 1000.0 / hours if hours else 0.0, 0.2),
        Figure(
            "mean speed in a table (m/s)", row["mean_speed_mps"], metres / time_s if time_s else 0.0, 2e-3
        ),
        Figure("stood (s)", said["stood_s"], counted["stood_s"].sum(), run.step_s),
        Figure(
            "share of time standing", said["stood_share"], counted["stood_s"].sum() / max(time_s, 1.0), 1e-4
        ),
        Figure("throughput in a table, measured (km/h)", row["km_per_h_measured"], said["km_per_h"], 1e-6),
        Figure("stood in a table (s)", row["stood_s"], counted["stood_s"].sum(), run.step_s),
        *(
            Figure(
                f"largest difference of any vehicle, {name}", float((one - other).abs().max()), 0.0, within
            )
            for name, one, other, within in (
                ("distance_m", vehicles["distance_m"], counted["distance_m"], 0.5),
                ("mean_speed_mps", vehicles["mean_speed_mps"], speed, 0.02),
                ("stood_s", vehicles["stood_s"], counted["stood_s"], run.step_s),
                *(
                    (mine, vehicles.get(mine, own_s), run.trips.get(its, own_s), 0.01)
                    for mine, its in (("trip_s", "duration"), ("stopped_s", "stopTime"))
                    if len(own_s)
                ),
            )
        ),
        Figure(
            "flow, driven [km]",
            flow["distance_m"].sum() / 1e3,
            (driven["speed"].sum() * run.step_s + last_steps_m) / 1e3,
            0.02,
        ),
        Figure(
            "flow, standing [vehicle-s]",
            float((flow["standing"] * 10.0).sum()),
            float((driven["speed"] < STANDING_MPS).sum() * run.step_s),
            2.0 * run.step_s,
        ),
    ]
    if run.once:
        found += [
            Figure(name, nan if said[name] is None else said[name], value, 0.01)
            for name, value in run.delays().items()
        ]
    else:
        if not run.scenario.get("incidents"):  # whoever is led round a street drives laps of another length
            found.append(Figure("laps", said["laps"], run.laps(), 0.0))
        noted = run.events[run.events["event"].eq("lap") & run.events["time_s"].gt(run.begin_s)]
        found.append(Figure("laps in the trace", said["laps"], len(noted), 0.0))
    if said["gate"] != "open":
        found.append(Figure("hold time (s)", said["hold_s"], run.held_s(), run.step_s))
        waits = run.longest_waits()
        found.append(
            Figure("refusals for what stands or is closed, out of its time", 0.0, run.untimely(), 0.0)
        )
        found += [
            Figure(
                f"longest wait for {reason} (s)",
                said["longest_waits_s"].get(reason, 0.0),
                waits.get(reason, 0.0),
                run.step_s,
            )
            for reason in sorted(waits.keys() | said["longest_waits_s"])
        ]
    for name, value in run.deadlock().items():
        found.append(Figure(f"deadlock, {name}", said["deadlocks"][0][name], value, 10.0))
    return found


def trips(file: Path, count: int, every_s: float) -> Path:
    """Write trips from corner to corner of the grid, one every so many seconds."""
    ends = ("A0A1", "E4D4"), ("E0D0", "A4A3"), ("A4B4", "E0E1"), ("E4E3", "A0B0")
    rows = [
        f'<trip id="t{k}" depart="{k * every_s:g}" from="{ends[k % 4][0]}" to="{ends[k % 4][1]}"/>'
        for k in range(count)
    ]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    return file


def incidents(file: Path, duration_s: float) -> Path:
    """Write two closures and a breakdown in the middle of a run."""
    begin_s, end_s = duration_s / 6.0, duration_s / 2.0
    closed = [f'[[closures]]\nedge = "{edge}"\nfrom = {begin_s}\nto = {end_s}\n' for edge in ("C2C3", "B1C1")]
    broken = f'[[breakdowns]]\nvehicle = "v5"\nfrom = {begin_s}\nto = {end_s}\n'
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("".join([*closed, broken]), encoding="utf-8")
    return file


def cases(folder: Path, *, duration_s: float = 900.0) -> dict[str, dict[str, Any]]:
    """Return what is run, by name."""
    given = {
        "network": GRID,
        "outputs": "fcd,tripinfo",
        "sumo": "--precision 6",
        "duration_s": duration_s,
    }
    some = str(trips(folder / "trips.rou.xml", 160, 2.0))
    loops = {"loops": 30, "vehicles": 120}
    return {
        "loops, gated": given | loops | {"gate": "certified", "warmup_s": 60.0},
        "loops, gated, incidents": given
        | loops
        | {"gate": "certified", "incidents": str(incidents(folder / "incidents.toml", duration_s))},
        "loops, truncated": given
        | {"loops": 60, "vehicles": 300, "gate": "open", "duration_s": 2.0 * duration_s},
        "trips, gated": given | {"routes": some, "gate": "certified", "duration_s": duration_s / 3.0},
        "trips, open": given | {"routes": some, "gate": "open", "duration_s": duration_s / 3.0},
        "trips, open, measured late": given
        | {"routes": some, "gate": "open", "warmup_s": 100.0, "duration_s": 150.0},
    }


def main() -> None:
    """Run, count again, and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path, help="run folders with fcd; none drives the six")
    parser.add_argument("--duration", type=float, default=900.0, help="seconds of each run")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "recount", help="folder of the runs")
    options = parser.parse_args()
    console, wrong, folders = Console(width=110), 0, dict.fromkeys(options.folders, "")
    if not folders:
        for name, given in cases(options.out, duration_s=options.duration).items():
            folder = options.out / name.replace(", ", "-").replace(" ", "-")
            simulate(Scenario.from_dict(given), folder, overwrite=True)
            folders[folder] = name
    for folder, name in folders.items():
        table = Table("figure", "said", "counted", "", title=name or str(folder))
        for one in recount(folder):
            table.add_row(one.name, f"{one.said:.4f}", f"{one.counted:.4f}", "" if one.agrees else "differs")
            wrong += not one.agrees
        console.print(table)
    console.print(f"{wrong} figures differ")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
