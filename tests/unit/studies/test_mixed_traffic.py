"""Tables of the public benchmark of junctions."""

from __future__ import annotations

from typing import Any

import mixed_traffic as study
import pandas as pd

from loopgate.results import columns as c


def one(name: str, rule: str, delay_s: float, **changed: object) -> dict[str, Any]:
    """Return the row of a run."""
    row = {study.KIND: "roundabout", study.DEMAND: "easy", study.NAME: name, study.RULE: rule}
    figures = {c.STATUS: "ok", c.MEAN_DELAY: delay_s, c.ARRIVED: 10, c.COLLISIONS: 0, c.DEADLOCKS: 0}
    known = {c.KEPT: True, c.SEED: 1, c.VEHICLES: 20, study.ORDINARY: 0}
    return row | figures | known | changed


GATE, OBEYED = "gate", "gate, lights obeyed"
RUNS = pd.DataFrame(
    [
        *(one("a", study.SUMO, 30.0, **{c.DEADLOCKS: 1}), one("a", GATE, 10.0), one("a", OBEYED, 40.0)),
        *(one("b", study.SUMO, 10.0), one("b", GATE, 10.0, **{study.ORDINARY: 5}), one("b", OBEYED, 5.0)),
        *(one("c", study.SUMO, 90.0), one("c", GATE, 0.0, **{c.STATUS: "failed"}), one("c", OBEYED, 1.0)),
    ]
)


def test_only_scenarios_that_all_rules_drove_count() -> None:
    """In *c* the gate failed; an equal delay is not less."""
    table = study.by_class(RUNS)
    assert [*table["scenarios"]] == [2] * 6
    assert [*table["delay [s]"]] == ["20", "10", "22"] * 2
    assert [*table["less delay"]] == ["", "1", "1"] * 2
    assert [*table["locked"]] == ["1", "0", "0"] * 2


def test_a_rule_that_drove_nothing_leaves_nothing_to_compare() -> None:
    """Its runs failed, all of them."""
    failed = RUNS.assign(**{c.STATUS: RUNS[c.STATUS].where(RUNS[study.RULE] != GATE, "failed")})
    assert study.by_class(failed).empty


def test_the_readme_has_a_row_for_each_class() -> None:
    """And one for all."""
    short = study.in_short(RUNS)
    assert [*short["junctions"]] == ["2 roundabouts", "all 2"]
    assert [*short["gate: less delay"]] == ["1 of 2"] * 2


def test_a_warning_tells_how_many_vehicles_are_not_gated() -> None:
    """Each reason has a warning of its own."""
    assert (
        study._ordinary('["3 vehicles in ordinary traffic, first a", "1 vehicle in ordinary traffic"]') == 4
    )
    assert "take 5 of 60 vehicles, in 1 of 3 scenarios" in study.section(RUNS)


def test_shares_are_beside_sumo_with_the_same_lights() -> None:
    """Figures are of all vehicles; of *b* no share was driven, so it counts nowhere."""

    def of(name: str, share: int, rule: str, delay_s: float) -> dict[str, Any]:
        some = {study.SHARE: share, study.GATED_DELAY: 50.0 if share else None, study.ERRED: 0}
        return one(name, rule, delay_s, **some)

    runs = pd.DataFrame(
        [
            *(of("a", 0, study.SUMO, 30.0), of("a", 0, study.DARK, 20.0), of("a", 5, GATE, 25.0)),
            *(of("a", 5, OBEYED, 25.0), of("b", 0, study.SUMO, 9.0), of("b", 0, study.DARK, 9.0)),
        ]
    )
    table = study.by_share(runs).set_index(study.RULE).loc[[GATE, OBEYED]]
    assert [*table["scenarios"]] == ["1"] * 4
    assert [*table["no more than SUMO, same lights"]] == ["0", "0", "1", "1"]
    assert [*table["no more than SUMO, its lights"]] == ["1", "1", "1", "1"]
    assert "6 runs" in study.shares_section(runs)


def test_the_gate_stands_beside_sumo_with_the_lights_off_too() -> None:
    """By scenario; those that only one of the two has driven do not count."""
    names = ["kind", "demand", "scenario", "rule", "mean_delay_s"]
    gate = pd.DataFrame(
        [("ring", "400", name, "gate", delay_s) for name, delay_s in (("a", 10.0), ("b", 30.0), ("c", 99.0))],
        columns=names,
    )
    dark = pd.DataFrame(
        [("ring", "400", name, "SUMO, lights off", 20.0) for name in ("a", "b")], columns=names
    )
    assert "at rings 20 s, the gate 20 s (less in 1 of 2)" in study.beside_unlit(gate, dark)
