"""The paragraphs for a paper: how runs were made and measured, and what is assumed."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from loopgate.plots.style import series_order
from loopgate.reading import counted
from loopgate.report.content import Section
from loopgate.results import columns as c
from loopgate.results.columns import SERIES
from loopgate.results.headings import clock

_READ = "loopgate read-fcd "
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
    every = section.runs
    read = every[c.COMMAND].fillna("").str.startswith(_READ) if c.COMMAND in every else every[c.SEED].isna()
    runs = every[~read]
    told = [_of_fcd(section.network, every[read])] if read.any() else []
    if runs.empty:
        return " ".join([*told, _DEFINED if section.watch is None else _OF_WATCH])
    on = f" on {_number_of(runs, c.LOOPS, 'loop')}" if runs[c.LOOPS].gt(0).any() else ""
    seeds = runs[c.SEED].nunique()
    sumo, own = _values(runs, c.SUMO_VERSION), _values(runs, c.LOOPGATE_VERSION)
    made_with = f"Eclipse SUMO {sumo} (Lopez et al. 2018) and loopgate {own}{_code(runs)}"
    of_runs = f"{counted(len(runs), 'run')} with {_number_of(runs, c.VEHICLES, 'vehicle')}{on}"
    with_seeds = f"the seed{'s' if seeds > 1 else ''} {_values(runs, c.SEED)}"
    time = f"{_values(runs, c.DURATION)} s after a warm-up of {_values(runs, c.WARMUP)} s"
    asked = _Asked(runs)
    parts = [
        f"Traffic in the road network {section.network} was simulated with {made_with}.",
        f"{of_runs} and {with_seeds} measured {time}{' each' if len(runs) > 1 else ''}.",
        f"{counted(failed, 'run')} failed and {'is' if failed == 1 else 'are'} left out." if failed else "",
        *asked.demand(),
        f"Rules: {'; '.join(_rules(runs))}.",
        *asked.conduct(),
        *asked.incidents(),
        _incidents(runs),
        "Runs of equal seeds have equal loops and starts." if len(runs) > 1 else "",
        *told,
        _DEFINED if section.watch is None else _OF_WATCH,
    ]
    return " ".join(filter(None, parts))


def _of_fcd(network: str, runs: pd.DataFrame) -> str:
    """Return the sentences about simulations that were read from their FCD output; nobody else knows them."""
    what = "a simulation" if len(runs) == 1 else f"{len(runs)} simulations"
    vehicles, measured = _values(runs, c.VEHICLES), _values(runs, c.DURATION)
    return (
        f"Traffic in the road network {network} is that of {what} by Eclipse SUMO without a gate (Lopez et "
        f"al. 2018), read from FCD output by loopgate {_values(runs, c.LOOPGATE_VERSION)}: {vehicles} "
        f"vehicles in {measured} s. FCD output holds neither lengths, stops, lights nor collisions: vehicles "
        "are taken to be 5 m long, to depart with the rear at the begin of a lane, and to arrive at the end "
        "of one."
    )


def assumed(section: Section) -> str:
    """Return the paragraph on what the results take for granted."""
    runs = section.runs
    asked = _Asked(runs)
    gated = runs[runs[c.GATE] != "open"]
    parts = []
    if len(gated):
        if "vehicles" in asked.values("decide", "central"):
            parts.append("Vehicles decide by messages; each knows its own position and speed, at each step.")
        else:
            parts.append(
                "The gate knows position and speed of all gated vehicles without error, and its decisions "
                "reach them at once, at each step."
            )
        parts.append(
            "Gated vehicles brake for a line as SUMO's vehicle model allows, and do not leave their loops. "
            "That all can go on for ever is promised as long as no vehicle stands for good, and does not say "
            "how soon."
        )
    if len(runs) > len(gated):
        parts.append(f"Runs under {c.SUMO_RULES} have no gate: SUMO's drivers see only who is near.")
    if "machine" in asked.values("drivers", "human"):
        parts.append(
            "Automated drivers all keep one desired speed and never dawdle; people would need longer "
            "headways, and fewer of them would pass."
        )
    else:
        parts.append("Drivers are those of SUMO's car-following model by their vehicle types; nobody errs.")
    if any(asked.values("traffic", "")):
        parts.append("Ordinary vehicles keep SUMO's right of way, and do not know the gate.")
    if any(asked.values("incidents", "")):
        parts.append(
            "A closure is known when it begins, to all vehicles at once; when it ends is known beforehand "
            "only where the file says so."
        )
    return " ".join(parts)


class _Asked:
    """What the scenarios of some runs asked for, in sentences."""

    def __init__(self, runs: pd.DataFrame) -> None:
        self._attached = c.COMMAND in runs and bool((runs[c.COMMAND] == c.OF_AN_OWNER).all())
        texts = runs[c.SCENARIO].dropna().unique() if c.SCENARIO in runs else ()
        self._scenarios: list[dict[str, Any]] = [json.loads(text) for text in texts if text]

    def values(self, key: str, otherwise: Any) -> list[Any]:  # noqa: ANN401 - values of any key
        """Return the values of a key over the runs, each once; `otherwise` where it was not asked for."""
        found = [scenario.get(key, otherwise) for scenario in self._scenarios]
        return [value for at, value in enumerate(found) if value not in found[:at]]

    def _files(self, key: str) -> str:
        return _named(
            [Path(part).name for value in self.values(key, "") if value for part in value.split(",")]
        )

    def demand(self) -> list[str]:
        """Say where loops, departures, stops and ordinary traffic come from, and when the day begins."""
        sentences = []
        if routes := self._files("routes"):
            sentences.append(
                f"Loops, vehicle types, departures and flows are those of {routes}; a vehicle joins when it "
                "departs and a place for it is free."
            )
        elif self._attached:
            sentences.append(
                "A script of its own steps the simulation and says which vehicles come under the gate; the "
                "route of each is its loop. Figures over time count all vehicles on the road."
            )
        else:
            sentences.append("Loops were searched in the network, and vehicles spread over them at random.")
        if stops := self._files("stops"):
            moved = any(self.values("move_stops", otherwise=False))
            where = ", moved to the nearest position that holds up nobody" if moved else ""
            sentences.append(
                f"Vehicles make the stops of their routes, at the places of {stops}{where}, in every round; "
                "headways are between arrivals at a stop, lateness is the time of going on after `until`."
            )
        if traffic := self._files("traffic"):
            sentences.append(f"Ordinary traffic is that of {traffic}.")
        begins = [float(value) for value in self.values("begin_s", None) if value and float(value) > 0.0]
        if begins:
            sentences.append(f"The simulation began at {_named([clock(value) for value in begins])}.")
        return sentences

    def conduct(self) -> list[str]:
        """Say how vehicles drive: the step, the drivers, even spacing, who decides."""
        steps = _named([f"{float(value):g} s" for value in self.values("step_s", 1.0)])
        sentences = [f"A step of the simulation is {steps}."] if steps else []
        drivers = self.values("drivers", "human")
        if "machine" in drivers:
            also = " in some runs" if len(drivers) > 1 else ""
            sentences.append(
                f"Drivers{also} are automated: no dawdling (sigma 0), no spread of speeds (speedDev 0), and "
                "a headway (tau) of 0.5 s, or of a step if that is longer."
            )
        spaced = [value for value in self.values("spacing", "") if value not in {"", "none"}]
        if spaced:
            sentences.append(f"Vehicles of a loop are kept apart evenly (spacing {_named(spaced)}).")
        if "vehicles" in self.values("decide", "central"):
            sentences.append("Vehicles decide for themselves, by messages.")
        return sentences

    def incidents(self) -> list[str]:
        """Say which file closes streets, and what vehicles do then."""
        if not (files := self._files("incidents")):
            return []
        wait = "wait" in self.values("standing", "contain")
        do = "wait before them" if wait else "are led round them where another way closes their loop"
        return [f"Streets are closed, and vehicles break down, as {files} says; vehicles {do}."]


def _named(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1] if names else "")))


def _incidents(runs: pd.DataFrame) -> str:
    """Return the sentence about streets that were closed and vehicles that broke down; empty without any."""
    nouns = {c.CLOSURES: "closed edges", c.BREAKDOWNS: "breakdowns", c.LED_ROUND: "vehicles led round them"}
    counts = {name: runs[name].fillna(0) for name in nouns if name in runs}
    said = [f"{nouns[name]} {_many(some)}" for name, some in counts.items() if some.gt(0).any()]
    return f"Incidents in a run: {', '.join(said)}." if said else ""


def _many(values: pd.Series) -> str:
    """Return the least and the greatest of some counts."""
    least, most = int(values.min()), int(values.max())
    return f"{least}" if least == most else f"{least} to {most}"


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


def _number_of(runs: pd.DataFrame, column: str, what: str) -> str:
    """Return the values of a column, and the noun that they count."""
    values = _values(runs, column)
    return f"{values} {what}" if values == "1" else f"{values} {what}s"


def _code(runs: pd.DataFrame) -> str:
    codes = _values(runs, c.LOOPGATE_CODE)
    return f" (code {codes})" if codes else ""
