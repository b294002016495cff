"""Positions as SUMO records them, audited; and abstractions with a fault, which the audit must find."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from loopgate.abstraction import queue_layout
from loopgate.abstraction.movements import Conflicts, find_conflicts
from loopgate.cache import Cache
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

NETWORKS = Path(__file__).parents[2] / "networks"
GRID = Scenario(
    network=str(NETWORKS / "grid5-priority.net.xml"), loops=40, vehicles=140, duration_s=240.0, positions=True
)


def rules(summary: Mapping[str, Any]) -> Counter[str]:
    """Count the findings by what tells them apart."""
    words = {
        "are no foes": "foe",
        "beyond the stretch": "stretch",
        "bodies overlap": "bodies",
        "on the stretch that": "meeting",
    }
    findings = [] if summary["audit"] == "clean" else summary["audit"]
    return Counter(next((name for word, name in words.items() if word in f), f) for f in findings)


def break_conflicts(monkeypatch: pytest.MonkeyPatch, change: Callable[[Conflicts], Conflicts]) -> None:
    """Let the queues abstraction see other conflicts than there are."""
    monkeypatch.setattr(queue_layout, "find_conflicts", lambda *a, **k: change(find_conflicts(*a, **k)))
    monkeypatch.setattr(queue_layout, "_KEPT", Cache(1))  # neither layout is kept, sound or broken


def test_a_run_is_clean_from_its_positions(tmp_path: Path) -> None:
    """Hundreds of meetings at crossings, each with time between rear and front; nobody stands in one."""
    summary = simulate(GRID, tmp_path / "run")
    assert summary["audit"] == "clean"
    assert {"crossings", "bodies"} < set(summary["audited"])
    figures = summary["positions"]
    assert figures["rows"] == 140 * 241
    assert figures["margin_s"]["count"] > 1000
    assert figures["margin_s"]["least"] > 0.0
    assert figures["longest_stand_s"] == 0.0
    assert "--positions" in summary["command"]


def test_without_positions_the_summary_says_so() -> None:
    """Crossings are then not among what was audited, and there are no figures of positions."""
    summary = simulate(dataclasses.replace(GRID, positions=False, duration_s=30.0))
    assert "crossings" not in summary["audited"]
    assert "positions" not in summary


def test_segments_are_audited_too(tmp_path: Path) -> None:
    """Zones are states that hold one body: the positions show that."""
    scenario = Scenario(
        network=str(NETWORKS / "order2.net.xml"),
        routes=str(NETWORKS.parent / "routes" / "order2.rou.xml"),
        abstraction="segments",
        duration_s=600.0,
        positions=True,
    )
    summary = simulate(scenario, tmp_path / "run")
    assert summary["audit"] == "clean"
    assert summary["positions"]["rows"] == 5 * 601


def test_one_forgotten_foe_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mutation: two movements that cross are no foes; the drawing tells, even if nobody meets there soon."""
    one, other = "B2C2_0>C2D2_0", "C1C2_0>C2C3_0"

    def forget(c: Conflicts) -> Conflicts:
        foes = dict(c.foes)
        assert other in foes[one]
        foes[one], foes[other] = foes[one] - {other}, foes[other] - {one}
        return dataclasses.replace(c, foes=foes)

    break_conflicts(monkeypatch, forget)
    found = rules(simulate(dataclasses.replace(GRID, duration_s=30.0)))
    assert found["foe"] >= 1


def test_one_stretch_cut_short_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mutation: of two movements that cross, one is let go too early, after a quarter of what they share."""
    one, other = "B2C2_0>C2D2_0", "C1C2_0>C2C3_0"

    def cut(c: Conflicts) -> Conflicts:
        overlaps = {name: dict(shared) for name, shared in c.overlaps.items()}
        begin, end = overlaps[one][other]
        overlaps[one][other] = (begin, begin + (end - begin) / 4)
        return dataclasses.replace(c, overlaps=overlaps)

    break_conflicts(monkeypatch, cut)
    found = rules(simulate(GRID))
    assert found["stretch"] >= 1


def test_crossings_without_exclusion_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mutation: no conflicts at all; SUMO's respect for who is inside does not keep them apart."""
    break_conflicts(
        monkeypatch, lambda c: dataclasses.replace(c, foes={name: frozenset() for name in c.foes})
    )
    found = rules(simulate(GRID))
    assert found["meeting"] > 10
    assert found["bodies"] > 5
