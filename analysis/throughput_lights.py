"""Vehicle-km among lights: SUMO's own drivers beside the certified gate, under the same lights.

The five-by-five grid with lights that follow the traffic and south-east Berlin on random loops, with the
lights obeyed:

    python analysis/throughput_lights.py --seeds 5 --duration 900 --write

Other networks by their files, with lights off and obeyed, each beside SUMO with the same lights, on up to
sixty loops that turn round where streets end, at any numbers of vehicles:

    python analysis/throughput_lights.py NET ... --vehicles 40 100 200 --seeds 2 --duration 900 --write

``--write`` renews the tables in ``docs/studies/throughput.md``; of files it keeps the runs in
``analysis/tables/lights-files.csv``, in place of those of the same network and number of vehicles. Runs
that are done are kept, see ``--help``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import pandas as pd
from throughput_study import ROOT, RULE, Rule, Study, conduct, markdown, parser, ratios, safety, write_section

from loopgate.abstraction.queue_layout import why_not
from loopgate.network import Loop, RoadNetwork, find_loops
from loopgate.results import columns as c

GRID = str(ROOT / "networks" / "grid5-actuated.net.xml")
OBEYED, OFF = "certified, lights obeyed", "certified, lights off"
SUMO_ON, SUMO_OFF = "SUMO, lights on", "SUMO, lights off"
KEPT, SECTION = ROOT / "analysis" / "tables" / "lights-files.csv", "lights-files"
NETWORK: Final = "network"
FIGURES = (
    *(NETWORK, RULE, c.VEHICLES, c.SEED, c.STATUS, c.KM_PER_H, c.DEADLOCKS, c.COLLISIONS, c.TELEPORTS),
    *(c.AUDIT, c.DURATION, c.LOOPGATE_CODE),
)
"""What is kept of each run."""


def study(
    name: str,
    title: str,
    network: str,
    loops: int,
    longest_m: float,
    vehicles: tuple[int, ...],
    *,
    u_turns: bool = False,
) -> Study:
    """Return the study of a network: SUMO under its lights, and the gate that obeys them."""

    def make(seed: int) -> Sequence[Loop]:
        roads = RoadNetwork.open(network)
        length_m = (400.0, longest_m)
        found = find_loops(
            roads,
            loops,
            length_m=length_m,
            seed=seed,
            u_turns=u_turns,
            admits=lambda loop: not why_not(roads, loop),
        )
        if found.shortfall:
            sys.stderr.write(f"{name}: {found.shortfall}\n")
        return found.loops

    common = {"network": network}
    rules = (
        Rule(SUMO_ON, {**common, "gate": "open", "lights": "keep"}, yardstick=True),
        Rule(OBEYED, {**common, "gate": "certified", "lights": "obey"}, beside=SUMO_ON),
    )
    return Study(name, title, rules, vehicles, make)


def of_file(file: Path, vehicles: tuple[int, ...]) -> Study:
    """Return the study of a network by its file, with lights off too."""
    found = study(
        file.name.partition(".")[0], file.name, str(file.resolve()), 60, 3000.0, vehicles, u_turns=True
    )
    dark = {NETWORK: str(file.resolve()), "lights": "off"}
    more = (
        Rule(SUMO_OFF, {**dark, "gate": "open"}, yardstick=True),
        Rule(OFF, {**dark, "gate": "certified"}, beside=SUMO_OFF),
    )
    return replace(found, rules=(*found.rules, *more))


def by_network(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each network and number of vehicles: ratios of distances, locks and collisions."""
    rules = of_file(Path("any"), ()).rules
    rows = []
    for (name, count), group in runs.groupby([NETWORK, c.VEHICLES], sort=False):
        row = {NETWORK: f"`{name}`", "vehicles": f"{count}", "seeds": f"{group[c.SEED].nunique()}"}
        table = ratios(group, Study("", "", rules, (), lambda _: ()))
        for found in table.to_dict("records"):
            row[str(found[RULE]).removeprefix("certified, ")] = str(found[str(count)])
        for rule in (SUMO_ON, SUMO_OFF):
            of = group[group[RULE] == rule]
            row[f"{rule}: locked"] = f"{(of[c.DEADLOCKS] > 0).sum()} of {len(of)}"
        rows.append(row)
    return pd.DataFrame(rows).fillna("")


def section(runs: pd.DataFrame) -> str:
    """Return the part of the page on networks by file."""
    minutes = sorted({f"{seconds / 60:g}" for seconds in runs[c.DURATION]})
    said = f"""{len(runs)} runs of {" or ".join(minutes)} minutes after 300 s of warm-up, on up to sixty loops
that turn round where streets end. Distance under the gate over that under SUMO's rules with the same
lights, obeyed and off, seed by seed. {safety(runs)}"""
    return "\n\n".join(
        ["## Lights obeyed and off, networks by file", " ".join(said.split()), markdown(by_network(runs))]
    )


def keep(runs: pd.DataFrame) -> pd.DataFrame:
    """Put runs in place of older ones of the same network and number; return all that are kept."""
    runs = runs[[name for name in FIGURES if name in runs]]
    if KEPT.exists():
        old = pd.read_csv(KEPT)
        new = set(zip(runs[NETWORK], runs[c.VEHICLES], strict=True))
        again = [pair in new for pair in zip(old[NETWORK], old[c.VEHICLES], strict=True)]
        runs = pd.concat([old[~pd.Series(again)], runs])
    runs = runs.sort_values([NETWORK, c.VEHICLES, c.SEED], kind="stable")
    runs.to_csv(KEPT, index=False)
    return runs


def drive_files(given: argparse.Namespace) -> None:
    """Drive networks by their files."""
    kept = []
    write, given.write = given.write, False
    for file in given.networks:
        one = of_file(file, tuple(given.vehicles or (40, 100, 200)))
        kept.append(conduct(one, given).assign(**{NETWORK: one.name}))
    runs = pd.concat(kept)
    print(section(runs))
    if write:
        write_section(section(keep(runs)), SECTION)


def main() -> None:
    """Drive what is missing, print, and renew the page if asked to."""
    words = parser(__doc__)
    words.add_argument("networks", nargs="*", type=Path, help="networks with lights, instead of those two")
    given = words.parse_args()
    if given.networks:
        drive_files(given)
        return
    for one in (
        study("lights-grid", "Lights obeyed, five-by-five grid", GRID, 40, 2000.0, (60, 140, 180, 240, 300)),
        study(
            "lights-berlin", "Lights obeyed, south-east Berlin", "sumo:DRT", 60, 3000.0, (50, 150, 300, 400)
        ),
    ):
        conduct(one, given)


if __name__ == "__main__":
    main()
