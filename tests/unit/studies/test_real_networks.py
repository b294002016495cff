"""Tables of real networks, and of made roundabouts and ramps, beside SUMO."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import real_networks as study
import streams

ONE = study.SCENARIOS[0]


def row(rule: str, delay_s: float, **changed: object) -> dict[str, object]:
    """Return the row of a run."""
    known = {study.PLACE: ONE.place, study.REPOSITORY: ONE.repository, study.RULE: rule, study.SEED: 1}
    figures = {study.STATUS: "ok", study.DELAY: delay_s, study.ARRIVED: 5, study.VEHICLES: 9}
    judged = {study.COLLISIONS: 0, study.OTHERS_COLLISIONS: 1, study.LOCKED: False, study.ORDINARY: 0}
    return {**known, **figures, **judged, study.CLEAN: True if rule in study.GATES else None} | changed


RUNS = pd.DataFrame(
    [
        row(study.DRIVEN[0], 9.0, locked=True),
        row(study.DRIVEN[1], 7.0),
        row("gate", 8.0, ordinary=2),
        row("gate, lights obeyed", 9.5, clean=False),
    ]
)


def test_each_scenario_has_a_row_with_its_address() -> None:
    """Locked runs and broken promises are marked; a rule that was not driven has a dash."""
    (shown,) = study.by_place(RUNS).to_dict("records")
    assert shown[study.PLACE] == f"[{ONE.place}](https://github.com/{ONE.repository})"
    assert shown["SUMO, its lights [s]"] == "9.0 (locked)"
    assert shown["gate, lights obeyed [s]"] == "9.5 (not clean)"
    assert shown["arrived"] == "5, 5, -, 5, 5"
    assert shown["collisions"] == "1, 1, -, 1, 1"


def test_the_page_says_where_the_gate_is_ahead() -> None:
    """Against each of SUMO's rules, and how many audits are clean."""
    said = study.section(RUNS)
    assert "*gate*: 1 against SUMO, its lights, 0 against SUMO, actuated" in said
    assert "clean in 1 of 2" in said


def test_delays_are_of_gated_and_ordinary_vehicles() -> None:
    """Weighed by how many there are."""
    figures = {"arrived": 4, study.DELAY: 10.0, study.DEPART_DELAY: None}
    others = {"trips": 2, "arrived": 1, study.DELAY: 40.0, study.DEPART_DELAY: 8.0}
    found = study.trips({"trips": 4, **figures, "others": others})
    assert (found[study.VEHICLES], found[study.ARRIVED]) == (6, 5)
    assert (found[study.DELAY], round(found[study.DEPART_DELAY], 2)) == (20.0, 2.67)
    assert study.trips({"trips": 4, **figures})[study.DELAY] == 10.0


def test_roundabouts_lead_from_each_end_to_each_other(tmp_path: Path) -> None:
    """Two in a row have six ends; the ways are edges of the network."""
    kind = streams.roundabout(16.0, 1, 4, count=2)
    network = kind.make(tmp_path / "two.net.xml").read_text(encoding="utf-8")
    assert len(kind.ways) == 30
    assert abs(sum(share for _, _, share in kind.ways) - 1.0) < 1e-9
    assert all(f'<edge id="{edge}"' in network for way in kind.ways for edge in way[:2])


def test_rows_behind_sumo_are_counted() -> None:
    """Fewer arrivals and more delay, by kind and demand."""
    common = {"group": "weaving", "kind": "a", "times": 1.0, "seed": 1, "asked_per_h": 60.0}
    runs = pd.DataFrame(
        [
            {**common, "rule": streams.SUMO, "arrived": 10, "mean_delay_s": 4.0},
            {**common, "rule": streams.GATE, "arrived": 9, "mean_delay_s": 3.0},
        ]
    )
    (found,) = streams.behind(runs).to_dict("records")
    assert (found["rows"], found["fewer arrived"], found["more delay"]) == (1, 1, 0)
