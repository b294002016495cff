"""Real networks with their own demand, which nobody built the gate on: delays, SUMO's lights beside the gate.

``python analysis/real_networks.py FOLDER`` drives the scenarios of `SCENARIOS` for 20 minutes each, from
checked-out copies of their public repositories: ``FOLDER/OWNER/NAME``, as the table names them. It drives
them under SUMO's rules with the lights as they are, with actuated lights and with lights that max-pressure
switches, and under the gate with lights off and obeyed. A scenario whose repository is not there is left
out and named. Runs that are done are kept in ``out/real-networks``, see ``--out``.

Delays are of all vehicles of a scenario, those that the gate leaves to SUMO's rules too; those under way, or
not departed yet, count with what they have lost so far. ``--write`` keeps a row for each run in
``analysis/tables/real-networks.csv``, beside those of other runs there, and renews the table in
``docs/studies/throughput.md``; without a folder the page is renewed from that file.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import pandas as pd
from any_traffic import RULES, SWITCHING, other_lights
from frame_table import frame_table
from rich.console import Console
from signals import CONTROLLERS, controlled
from throughput_study import in_place_of, markdown, write_section

from loopgate import Scenario
from loopgate.cli.terminal import show_progress
from loopgate.errors import LoopgateError
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "analysis" / "tables" / "real-networks.csv"
SECTION = "real-networks"
GATES = "gate", "gate, lights obeyed"
DRIVEN: Final = ("SUMO, its lights", "SUMO, actuated", "SUMO, max-pressure", *GATES)


@dataclass(frozen=True, slots=True)
class Real:
    """A scenario of a public repository.

    Attributes
    ----------
    place
        Where it is.
    repository
        Owner and name, at ``https://github.com``.
    path
        Of the configuration in it; or of the network, if `routes` are named.
    routes
        Route files beside the network, where there is no configuration that SUMO can read.
    begin_s
        When the run begins; None for the beginning of the configuration.
    positions
        Whether gated runs are audited by positions too: of thousands of routes that takes long.
    """

    place: str
    repository: str
    path: str
    routes: tuple[str, ...] = ()
    begin_s: float | None = None
    positions: bool = True


_RESCO = "sumo_rl/nets/RESCO"
SCENARIOS: Final = (
    Real("Bologna, Acosta", "DLR-TS/sumo-scenarios", "bologna/acosta/run.sumocfg"),
    Real("Bologna, Pasubio", "DLR-TS/sumo-scenarios", "bologna/pasubio/run.sumocfg"),
    Real("Bologna, joined", "DLR-TS/sumo-scenarios", "bologna/joined/run.sumocfg"),
    Real("Hamburg", "DLR-TS/sumo-scenarios", "TAVF-Hamburg/run_simulation.sumocfg"),
    Real("Wildau", "DLR-TS/sumo-scenarios", "Wildau/output_configuration.sumocfg"),
    Real("Cologne, one light", "LucasAlegre/sumo-rl", f"{_RESCO}/cologne1/cologne1.sumocfg"),
    Real("Ingolstadt, one light", "LucasAlegre/sumo-rl", f"{_RESCO}/ingolstadt1/ingolstadt1.sumocfg"),
    Real("Ingolstadt, 21 lights", "LucasAlegre/sumo-rl", f"{_RESCO}/ingolstadt21/ingolstadt21.sumocfg"),
    Real(
        "Lörrach",
        "fabianegi/sumo-rl-loerrach-public",
        "data/sumo_config/loerrach_osm.net.xml",
        ("loerrach_osm_high.rou.xml",),
    ),
    Real("Suwon", "june6723/sumo-rl-suwon", "sumo-rl-suwon/experiments/nets/suwon/osm.sumocfg"),
    Real("Mexico City", "alejandromadrigal1409/Sumo-RL", "single-intersecition-V2/ticoman.sumocfg"),
    Real("Turin", "hassanwaqar00/5t_sumo_simulation", "config.sumocfg"),
    Real("Midtown Manhattan", "sheikh-sa-kib/thesis2.0", "simulation.sumocfg"),
    Real("Concepción", "javreyes71/Control-de-Trafico-con-RL-en-SUMO", "simulation.sumocfg"),
    Real("Butuan", "ivynalam/sumojr", "osm.sumocfg"),
    Real("Motorway near Berlin", "eclipse-sumo/sumo", "tools/game/A10KW.sumocfg"),
    Real("Volgograd", "DaniilShulga/CarTrafic", "osm.sumocfg", positions=False),
)
PLACE, REPOSITORY, RULE, SEED, STATUS = "place", "repository", "rule", "seed", "status"
VEHICLES, ORDINARY, DELAY, DEPART_DELAY, ARRIVED = (
    "vehicles",
    "ordinary",
    "mean_delay_s",
    "mean_depart_delay_s",
    "arrived",
)
COLLISIONS, OTHERS_COLLISIONS, LOCKED, STARVING, FINDINGS, CLEAN = (
    "collisions",
    "collisions_by_others",
    "locked",
    "starving",
    "findings",
    "clean",
)


def configuration(one: Real, given: argparse.Namespace, rule: str) -> Path:
    """Write the SUMO configuration of a run: the scenario's input and nothing else of its options."""
    source = given.folder / one.repository / one.path
    inputs: dict[str, list[Path]] = {"net-file": [source], "route-files": [], "additional-files": []}
    inputs["route-files"] += [source.parent / name for name in one.routes]
    begin_s = one.begin_s
    if not one.routes:
        top = ET.parse(source).getroot()  # noqa: S314  expat refuses entities that grow without bounds
        for name in inputs:
            found = top.find(f"input/{name}")
            words = found.get("value", "").split(",") if found is not None else []
            inputs[name] = [source.parent / word.strip() for word in words if word.strip()]
        begin = top.find("time/begin")
        begin_s = float(begin.get("value", "0")) if begin is not None and begin_s is None else begin_s
    name = f"{one.place} {rule}".replace(" ", "-").replace(",", "")
    if kind := SWITCHING.get(rule):
        inputs["additional-files"].append(
            other_lights(inputs["net-file"][0], kind, given.out / f"{name}.add.xml")
        )
    parts = "".join(
        f'<{what} value="{",".join(str(file.resolve()) for file in files)}"/>'
        for what, files in inputs.items()
        if files
    )
    begin_s = begin_s or 0.0
    file: Path = given.out / f"{name}.sumocfg"
    file.write_text(
        f'<configuration><input>{parts}</input><time><begin value="{begin_s:g}"/>'
        f'<end value="{begin_s + given.duration:g}"/></time></configuration>\n',
        encoding="utf-8",
    )
    return file


def trips(summary: dict[str, Any]) -> dict[str, float]:
    """Return what the vehicles of a run come to, those that the gate leaves to SUMO's rules too.

    Figures of the run itself: SUMO's own time loss has no time at the stops by which the gate holds vehicles,
    and SUMO does not know whom the gate lets depart later.
    """
    parts = [summary, *([summary["others"]] if summary.get("others") else [])]
    count = sum(part["trips"] for part in parts)

    def mean(name: str) -> float:
        return sum(float(part["trips"]) * float(part[name] or 0.0) for part in parts) / max(1.0, float(count))

    arrived = sum(part["arrived"] for part in parts)
    return {VEHICLES: count, ARRIVED: arrived, DELAY: mean(DELAY), DEPART_DELAY: mean(DEPART_DELAY)}


def run(one: Real, rule: str, seed: int, given: argparse.Namespace) -> dict[str, Any]:
    """Drive a scenario, or return what it gave before."""
    key = f"{one.place}-{rule}-{seed}-{given.duration:g}".replace(" ", "_").replace(",", "")
    kept = given.out / f"{key}.json"
    if not kept.exists():
        row = {PLACE: one.place, REPOSITORY: one.repository, RULE: rule, SEED: seed}
        kept.write_text(json.dumps(row | _drive(one, rule, seed, given, given.out / key)), encoding="utf-8")
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    return found


def _drive(one: Real, rule: str, seed: int, given: argparse.Namespace, folder: Path) -> dict[str, Any]:
    name = rule.removeprefix("SUMO, ")
    more: dict[str, Any] = {"seed": seed, "duration_s": given.duration, "on_deadlock": "continue"}
    more |= {} if one.positions else {"positions": False}
    try:
        scenario = Scenario(network=str(configuration(one, given, rule)), **(RULES[rule] | more))
        with controlled(name) if name in CONTROLLERS else nullcontext():
            summary = simulate(scenario, folder, overwrite=True)
    except LoopgateError as error:
        return {STATUS: str(error)}
    audit = summary["audit"]
    return {
        STATUS: "ok",
        **trips(summary),
        ORDINARY: summary["others"]["vehicles"] if rule in GATES and summary.get("others") else 0,
        COLLISIONS: summary["collisions"],
        OTHERS_COLLISIONS: summary.get("collisions_by_others", 0),
        LOCKED: bool(summary["deadlocks"]),
        STARVING: len(summary["starving"]),
        FINDINGS: 0 if isinstance(audit, str) else len(audit),
        CLEAN: summary.get("clean"),
        "wall_s": summary["wall_s"]["total"],
    }


def planned(given: argparse.Namespace) -> Iterator[tuple[Real, str, int]]:
    """Yield the runs, scenario by scenario; name those that are not in the folder."""
    for one in SCENARIOS:
        if given.places and one.place not in given.places:
            continue
        if not (given.folder / one.repository / one.path).is_file():
            sys.stderr.write(
                f"{one.place}: no {one.path}; check out https://github.com/{one.repository} "
                f"as {given.folder / one.repository}\n"
            )
            continue
        for seed in range(1, given.seeds + 1):
            yield from ((one, rule, seed) for rule in given.rules)


def by_place(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each scenario: mean delays by rule, who arrived, and what went wrong."""
    done = runs[runs[STATUS] == "ok"]
    rows = []
    for place, group in done.groupby(PLACE, sort=False):
        of = {str(rule): found for rule, found in group.groupby(RULE)}
        first = next(iter(of.values())).iloc[0]
        row = {
            PLACE: f"[{place}](https://github.com/{first[REPOSITORY]})",
            VEHICLES: f"{group[VEHICLES].max():.0f}",
            ORDINARY: f"{group[ORDINARY].max():.0f}",
        }
        for rule in DRIVEN:
            row[f"{rule} [s]"] = _delay(of.get(rule))
        row["arrived"] = ", ".join(
            f"{of[rule][ARRIVED].mean():.0f}" if rule in of else "-" for rule in DRIVEN
        )
        row["collisions"] = ", ".join(
            f"{of[rule][COLLISIONS].sum() + of[rule][OTHERS_COLLISIONS].sum():.0f}" if rule in of else "-"
            for rule in DRIVEN
        )
        rows.append(row)
    return pd.DataFrame(rows)


def _count(found: pd.DataFrame | None, *names: str) -> str:
    """Return the sum of some counts of the runs under a rule, by run."""
    return "-" if found is None or found.empty else f"{found[list(names)].to_numpy().sum() / len(found):g}"


def _delay(found: pd.DataFrame | None) -> str:
    """Return the mean delay under a rule, marked where a run locked up or broke a promise."""
    if found is None or found.empty:
        return "-"
    marks = " (locked)" * any(found[LOCKED]) + " (not clean)" * any(one is False for one in found[CLEAN])
    return f"{found[DELAY].mean():.1f}{marks}"


def section(runs: pd.DataFrame) -> str:
    """Return the part of the page on throughput."""
    done = runs[runs[STATUS] == "ok"]
    wide = done.pivot_table(index=PLACE, columns=RULE, values=DELAY)
    less = {
        gate: {
            other: int((wide[gate] < wide[other]).sum())
            for other in DRIVEN
            if other in wide and other not in GATES
        }
        for gate in GATES
    }
    counted = "; ".join(
        f"*{gate}*: {', '.join(f'{number} against {other}' for other, number in found.items())}"
        for gate, found in less.items()
    )
    gated = done[done[RULE].isin(GATES)]
    touched = int(gated[COLLISIONS].sum())
    refused = runs[runs[STATUS] != "ok"]
    seeds = ", ".join(sorted(str(seed) for seed in set(done[SEED])))
    said = f"""{len(done)} runs of 20 minutes, {len(wide)} scenarios, seed {seeds}.
Mean delay over all vehicles of a scenario, waits to depart in it. *Ordinary*: vehicles that
the gate leaves to SUMO's rules. *Arrived*, *collisions*: under the five rules in their order.
Less delay under the {counted}. In gated runs {touched} collisions with a gated vehicle, audits with
positions clean in {sum(one is True for one in gated[CLEAN])} of {len(gated)}."""
    words = [" ".join(said.split())]
    words += [f"{one[PLACE]}, {one[RULE]}: refused: {one[STATUS]}" for one in refused.to_dict("records")]
    return "\n\n".join([*words, markdown(by_place(runs))])


def main() -> None:
    """Run what is missing, print, and renew the page if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="checked-out repositories, as OWNER/NAME")
    parser.add_argument("--places", nargs="+", choices=[one.place for one in SCENARIOS])
    parser.add_argument("--rules", nargs="+", default=list(DRIVEN), choices=DRIVEN)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--duration", type=float, default=1200.0, help="simulated time of each run [s]")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "real-networks", help="results folder")
    parser.add_argument("--write", action="store_true", help="keep a row for each run, and renew the page")
    given = parser.parse_args()
    if given.folder is None:
        write_section(section(pd.read_csv(KEPT)), SECTION)
        return
    given.out.mkdir(parents=True, exist_ok=True)
    given.folder = given.folder.resolve()
    runs = list(planned(given))
    rows = []
    with show_progress("runs", total=len(runs)) as report:
        for number, one in enumerate(runs, 1):
            rows.append(run(*one, given))
            report(number)
    table = pd.DataFrame(rows)
    console = Console(highlight=False, width=230)
    shown = by_place(table)
    console.print(frame_table(shown, {name: str(name) for name in shown.columns}, title="20 minutes each"))
    for row in table.to_dict("records"):
        if row[STATUS] != "ok":
            console.print(f"{row[PLACE]}, {row[RULE]}: {row[STATUS]}")
    if given.write:
        every = in_place_of(pd.read_csv(KEPT), table, [PLACE, RULE, SEED]) if KEPT.exists() else table
        every.to_csv(KEPT, index=False)
        write_section(section(every), SECTION)


if __name__ == "__main__":
    main()
