"""The tables of throughput, by hand."""

import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import throughput_lights
from throughput_study import (
    LONGEST_WAIT,
    NOT_ON_PAGE,
    PAGE,
    ROOT,
    TABLES,
    Rule,
    Study,
    details,
    kilometres,
    left_to_tables,
    markdown,
    ratios,
    safety,
    shown,
    waits,
    write_section,
)

STUDY = Study(
    name="grid",
    title="Grid",
    rules=(Rule("SUMO, a", {}, yardstick=True), Rule("SUMO, b", {}, yardstick=True), Rule("certified", {})),
    vehicles=(60,),
    loops=lambda _: (),
)


def row(rule: str, seed: int, km: float, **other: object) -> dict[str, object]:
    """Return a row of the results as the tables read it."""
    figures = {
        "status": "ok",
        "error": "",
        "rule": rule,
        "vehicles": 60,
        "seed": seed,
        "km_per_h": km,
        "laps": 10,
        "lapless_vehicles": 0,
        "deadlocks": 0,
        "longest_wait_s": 7.0,
        "collisions": 0,
        "teleports": 0,
        "audit": "clean" if rule == "certified" else "not gated",
    }
    return figures | other


RUNS = pd.DataFrame(
    [
        row("SUMO, a", 1, 100.0, deadlocks=2, lapless_vehicles=3),
        row("SUMO, a", 2, 120.0),
        row("SUMO, b", 1, 150.0),
        row("SUMO, b", 2, 50.0),
        row("certified", 1, 150.0),
        row("certified", 2, 144.0, longest_wait_s=9.0),
    ]
)


def test_the_ratio_is_to_the_rule_with_the_best_mean_seed_by_seed() -> None:
    """Rule a (110) beats b (100); 150/100 and 144/120 are 1.35 +- t(1) * 0.15 = 12.706 * 0.15."""
    (only,) = ratios(RUNS, STUDY).to_dict("records")
    assert only == {"rule": "certified", "60": "1.35 ± 1.91"}


def test_a_rule_that_names_its_yardstick_is_measured_by_that() -> None:
    """Not by rule a, which is better: 150/150 and 144/50."""
    rules = (*STUDY.rules[:2], Rule("certified", {}, beside="SUMO, b"))
    (only,) = ratios(RUNS, replace(STUDY, rules=rules)).to_dict("records")
    assert only["60"].startswith("1.94")


def test_networks_by_file_have_a_row_for_each_number_of_vehicles() -> None:
    """With lights on and off, each beside SUMO with the same lights."""
    figures = {
        throughput_lights.SUMO_ON: 100.0,
        throughput_lights.OBEYED: 90.0,
        throughput_lights.SUMO_OFF: 50.0,
        throughput_lights.OFF: 75.0,
    }
    runs = pd.DataFrame([row(rule, 1, km, deadlocks=int(km == 50.0)) for rule, km in figures.items()])
    (only,) = throughput_lights.by_network(runs.assign(network="town")).to_dict("records")
    assert [*only.values()] == ["`town`", "60", "1", "0.90", "1.50", "0 of 1", "1 of 1"]


def test_kilometres_say_which_rules_locked_up() -> None:
    """One of rule a's two runs did, whatever the number of circles in it."""
    table = kilometres(RUNS[RUNS["seed"] == 1], STUDY).set_index("rule")["60"]
    assert table.to_dict() == {"SUMO, a": "100 (1 of 1 locked)", "SUMO, b": "150", "certified": "150"}


def test_details_keep_the_worst_wait_and_the_mean_of_the_lapless() -> None:
    """In the order of the rules; what only a gate has is empty without one."""
    first, _, last = details(RUNS, STUDY).to_dict("records")
    assert (first["rule"], first["without a lap at the end"], first["locked"]) == ("SUMO, a", "1.5", "1 of 2")
    assert (first["longest wait [s]"], first["clean audits"]) == ("", "")
    assert (last["longest wait [s]"], last["clean audits"]) == ("9", "2 of 2")


def test_waits_and_safety_are_told_rule_by_rule() -> None:
    """The longest of any run; of SUMO's rules only who made no lap; collisions by name."""
    table = waits(RUNS, STUDY).set_index("rule")["60"]
    assert table.to_dict() == {"SUMO, a": "(1.5)", "SUMO, b": "", "certified": "9 s"}
    hit = pd.DataFrame([row("SUMO, a", 1, 1.0, collisions=3), row("certified", 1, 1.0)])
    said = "Collisions: SUMO, a 3; under the others none. Clean audits of gated runs: 1 of 1. Teleports: 0."
    assert safety(hit) == said


def test_a_refused_run_is_said_to_be_refused() -> None:
    """With its reason, and no figure is made up for it."""
    refused = pd.DataFrame([row("certified", 1, float("nan"), status="failed", error="too many vehicles")])
    (only,) = details(refused, STUDY).to_dict("records")
    assert only["km"] == "refused: too many vehicles"
    assert kilometres(refused, STUDY)["60"].tolist() == ["refused"]


def test_a_section_of_the_page_is_renewed_and_the_rest_stays(tmp_path: Path) -> None:
    """The marks stay too, so that it can be renewed again."""
    page = tmp_path / "page.md"
    page.write_text("top\n<!-- grid: begin -->\nold\n<!-- grid: end -->\nbottom\n", encoding="utf-8")
    for _ in range(2):
        write_section(markdown(pd.DataFrame({"a": [1]})), "grid", page)
    text = page.read_text(encoding="utf-8")
    assert text == "top\n<!-- grid: begin -->\n| a |\n|---|\n| 1 |\n<!-- grid: end -->\nbottom\n"
    with pytest.raises(ValueError, match="there is no <!-- city: begin -->"):
        write_section("x", "city", page)


def test_the_page_shows_the_tables_that_the_file_of_tables_holds() -> None:
    """All but the waits, and the distances of the study of the limit."""
    tables = TABLES.read_text(encoding="utf-8")
    found = re.findall(r"<!-- (\S+): begin -->\n(.*?)\n<!-- \1: end -->", tables, re.DOTALL)
    assert len(found) >= 7
    page = PAGE.read_text(encoding="utf-8")
    for name, text in found:
        part = shown(text, *left_to_tables(name))
        there = f"<!-- {name}: begin -->\n{part}\n<!-- {name}: end -->" in page
        assert there == (name not in NOT_ON_PAGE), name
        assert LONGEST_WAIT in text
        assert LONGEST_WAIT not in part


def test_a_network_with_few_loops_gives_the_loops_that_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    """The study asks for 500 loops of a small network; it goes on with fewer, and says so."""
    few = throughput_lights.study(
        "small", "Small", str(ROOT / "networks" / "ring3.net.xml"), 500, 900.0, (10,)
    )
    assert 0 < len(few.loops(1)) < 500
    assert "of 500 loops" in capsys.readouterr().err
