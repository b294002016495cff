"""The paragraphs for a paper say what was asked for, and what is taken for granted."""

from __future__ import annotations

import json
from typing import Any

import pandas as pd
import pytest

from loopgate.report.content import Section
from loopgate.report.headline import with_interval
from loopgate.report.methods import assumed, methods

RUN: dict[str, Any] = {
    "gate": "certified",
    "abstraction": "queues",
    "negotiation": "pressure",
    "lights": "off",
    "vehicles": 6,
    "loops": 1,
    "seed": 1,
    "duration_s": 600.0,
    "warmup_s": 0.0,
    "series": "loopgate",
    "sumo_version": "1.28.0",
    "loopgate_version": "0.1",
    "loopgate_code": None,
    "closures": 1,
}


def section(**scenario: object) -> Section:
    """Return a section of one run with a scenario."""
    runs = pd.DataFrame([RUN | {"scenario": json.dumps(scenario)}])
    return Section("town", runs, 6, [], [], ["loopgate"], [], "")


def test_methods_name_stops_flows_drivers_and_closures() -> None:
    """Each in a sentence, with its file; a run without them does not speak of them."""
    asked = {"routes": "in/bus.rou.xml", "stops": "a.add.xml,b.add.xml", "drivers": "machine"}
    text = methods(section(**asked, incidents="shut.toml", begin_s=36000.0, step_s=0.5), 0)
    for said in (
        "departures and flows are those of bus.rou.xml",
        "at the places of a.add.xml and b.add.xml, in every round",
        "Drivers are automated: no dawdling (sigma 0)",
        "as shut.toml says; vehicles are led round them",
        "began at 10:00:00",
        "A step of the simulation is 0.5 s.",
    ):
        assert said in text
    plain = methods(section(), 0)
    assert "Loops were searched in the network" in plain
    assert "automated" not in plain
    assert "stops of their routes" not in plain
    assert "says;" not in plain


def test_methods_of_fcd_output_claim_nothing_about_its_simulation() -> None:
    """Neither loops, seed, version nor rules: loopgate saw only the output."""
    runs = pd.DataFrame([RUN | {"gate": "open", "command": "loopgate read-fcd a.xml town.net.xml -o out"}])
    text = methods(Section("town", runs, 6, [], [], ["SUMO's rules"], [], ""), 0)
    assert "read from FCD output by loopgate 0.1: 6 vehicles in 600 s" in text
    assert not [said for said in ("searched", "seed", "1.28.0", "Rules:", "step") if said in text]


def test_what_is_assumed_follows_the_rules() -> None:
    """A promise of the gate under a gate only; ordinary traffic only where there is any."""
    text = assumed(section(drivers="machine", traffic="t.rou.xml", incidents="shut.toml"))
    assert "as long as no vehicle stands for good" in text
    assert "Automated drivers" in text
    assert "Ordinary vehicles keep SUMO's right of way" in text
    assert "A closure is known when it begins" in text
    free = section()
    free.runs["gate"] = "open"
    assert "promised" not in assumed(free)
    assert "have no gate" in assumed(free)


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        ((4.1234, 3.81, 4.44), "4.1 \u00b1 0.3"),
        ((1079.4, 1027.6, 1131.2), "1\u00a0079 \u00b1 52"),
        ((0.00841, 0.00799, 0.00883), "0.0084 \u00b1 0.0004"),
        ((2.0, 0.0, 7.5), "2 (0 to 7.5)"),
        ((3.0, 3.0, 3.0), "3 \u00b1 0"),
    ],
)
def test_intervals_are_written_as_papers_do(estimate: tuple[float, float, float], text: str) -> None:
    """One digit of half the interval, two if it begins with 1 or 2; uneven ones have their ends."""
    assert with_interval(*estimate) == text
