"""Small roads with capacity, every configuration: what the gates do, and what the chain rule is worth."""

from __future__ import annotations

import csv
import sys
from functools import partial
from pathlib import Path

import pytest
import road_systems
from small_roads import (
    Roads,
    commuters,
    figure_eight,
    one_way_grid,
    ring,
    road_system,
    roundabout,
    two_rings,
    two_way_grid,
)

from loopgate.errors import SystemModelError
from loopgate.gates import make_gate
from loopgate.gates.certified.chain_rule import ChainRule
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.search import Budget
from loopgate.research.state_space import StateSpace, Verification, verify_space
from loopgate.research.theory.instances import instance

WIDE = [
    (ring(5), 3, 12, 0),
    (two_rings(3), 2, 8, 0),
    (commuters(2), 2, 7, 6),
    (commuters(3), 2, 8, 0),
    (figure_eight(3), 2, 8, 0),
    (figure_eight(3), 3, 10, 0),
    (one_way_grid(), 2, 6, None),
    (two_way_grid(), 2, 6, None),
    (roundabout(3), 2, 4, None),
]
NARROW = [
    (two_rings(4), 5, None),
    (figure_eight(3), 3, None),
    (one_way_grid(), 6, None),
    (two_way_grid(), 7, 0),
    (roundabout(3), 5, None),
    (roundabout(4), 4, None),
]


def check(space: StateSpace, gate: str) -> Verification:
    """Ask a gate about every move in every configuration that it lets come about."""
    return verify_space(space, partial(make_gate, gate))


@pytest.mark.parametrize(("roads", "capacity", "vehicles", "seed"), WIDE)
def test_the_chain_rule_is_exact(roads: Roads, capacity: int, vehicles: int, seed: int | None) -> None:
    """Where places hold two, no circular wait is as good as somebody moving for ever, and the rule sees it.

    Of every configuration that can be reached at all it says whether it keeps the promise, and from the
    start on it admits every move that does and no other.
    """
    system = road_system(roads, vehicles, capacity, seed=seed)
    space = StateSpace(system)
    somebody = space.somebody
    assert (somebody == ~space.locked).all()
    flow = ChainRule(system, Budget(2_000))
    for number in range(space.count):
        here = space.configuration(number)
        assert flow.begin(here, Occupancy.of(flow.layout, here)) == somebody[number]
    found = check(space, "certified:promise=somebody")
    assert found.holds
    assert (found.permissiveness, found.coverage, found.deadlocks) == (1.0, 1.0, 0)


@pytest.mark.parametrize(("roads", "vehicles", "seed"), NARROW)
def test_the_exact_stage_is_exact_where_places_hold_one(
    roads: Roads, vehicles: int, seed: int | None
) -> None:
    """Everyone can go on, nothing safe is refused."""
    space = StateSpace(road_system(roads, vehicles, 1, seed=seed))
    found = check(space, "certified:promise=everyone")
    assert found.holds
    assert (found.permissiveness, found.coverage) == (1.0, 1.0)
    assert (found.deadlocks, found.starving, found.budget_stops) == (0, 0, 0)


def test_the_exact_stage_joins_in_where_some_places_hold_one() -> None:
    """The middle of a figure eight holds one, the others two: safe, with little refused needlessly."""
    roads = figure_eight(3)
    space = StateSpace(road_system(roads, 5, lambda place: 1 if place in roads.narrow else 2))
    assert space.locked.any()
    found = check(space, "certified:promise=somebody")
    assert found.holds
    assert found.deadlocks == 0
    assert found.permissiveness is not None
    assert 0.5 < found.permissiveness < 1.0
    assert check(space, "certified:promise=everyone").permissiveness == 1.0


def test_somebody_is_less_than_everyone() -> None:
    """Seven of eight slots taken on two rings: who wants to change over waits for ever, the rings turn."""
    space = StateSpace(instance("roads_commuters_n7"))
    assert not space.live.any()
    found = check(space, "certified:promise=somebody")
    assert found.holds
    assert found.starving == found.configurations == 10
    assert check(space, "certified:promise=everyone").starts_refused == 1


def test_algorithm_2_fails_on_streets_whose_places_hold_one() -> None:
    """Four vehicles, and an unsafe move is admitted; six, and nobody is; `certified` does neither."""
    unsound, blocked = StateSpace(instance("roads_unsound_n4")), StateSpace(instance("roads_blocked_n6"))
    found = check(unsound, "algorithm2")
    assert (found.unsafe_admitted, found.stuck, found.starving) == (15, 2, 5)
    assert found.counterexample is not None
    assert found.counterexample.moves == ("v1", "v1", "v3", "v3", "v2", "v4")
    assert (check(blocked, "algorithm2").configurations, check(blocked, "algorithm2").stuck) == (1, 1)
    for space in (unsound, blocked):
        assert space.live[0]
        assert check(space, "certified").permissiveness == 1.0


@pytest.mark.parametrize(("roads", "capacity", "vehicles", "seed"), WIDE[:6])
def test_algorithm_2_is_the_chain_rule_where_places_hold_two(
    roads: Roads, capacity: int, vehicles: int, seed: int | None
) -> None:
    """It lets the same configurations come about, by the same moves."""
    space = StateSpace(road_system(roads, vehicles, capacity, seed=seed))
    found = verify_space(space, partial(make_gate, "algorithm2"), promise="somebody")
    assert found.holds
    assert (found.permissiveness, found.coverage) == (1.0, 1.0)


def test_banker_never_moves_without_places_of_ones_own() -> None:
    """Two vehicles per loop: no way leads to a private place."""
    assert check(StateSpace(road_system(ring(5), 4, 2)), "banker").stuck == 1


def test_too_many_vehicles_are_told_so() -> None:
    """Three places that hold two, a slot free in each."""
    with pytest.raises(SystemModelError, match="vehicle 4 of 5 finds no place on loop ring"):
        road_system(ring(3), 5, 2)


def test_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ends well, says what it found, and does not do again what it has done."""
    file = tmp_path / "rows.csv"
    monkeypatch.setattr(sys, "argv", ["", "--limit", "60", "--vehicles", "4", "-o", str(file)])
    with pytest.raises(SystemExit, match=r"^0$"):
        road_systems.main()
    said, written = capsys.readouterr().out, file.read_bytes()
    assert "whatever is not a circular wait lets somebody move for ever" in said
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    certified = [row for row in rows if row["gate"].startswith("certified")]
    assert len(certified) > 100
    assert all(row["unsafe_admitted"] == row["stuck"] == row["deadlocks"] == "0" for row in certified)
    assert any(int(row["deadlocks"]) for row in rows if row["gate"] == "collision")
    with pytest.raises(SystemExit, match=r"^0$"):
        road_systems.main()
    assert (capsys.readouterr().out, file.read_bytes()) == (said, written)
