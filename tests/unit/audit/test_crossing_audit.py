"""The audit of positions: every rule, broken once, on two loops that cross at one junction."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from itertools import accumulate
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from loopgate.audit import (
    Layout,
    PositionAudit,
    audit_positions,
    drawing,
    position_table,
    read_layout,
    write_layout,
)
from loopgate.audit.crossing_audit import bends, overlapping
from loopgate.audit.drawing import Meeting, Side, conflicts_by_loop, find_meetings, lies_above
from loopgate.audit.drawn_bodies import LaneOnWay, draw_bodies, driven
from loopgate.audit.layout import LoopLeg, LoopSpan, LoopWay, SizedStretches, VehicleBody
from loopgate.audit.position_table import Positions
from loopgate.audit.stretches import lay_stretches
from loopgate.cache import Cache
from loopgate.errors import ResultsError
from loopgate.network.bridges import Bridge
from loopgate.results.columns import EVENT_COLUMNS, VEHICLE

Arc = Callable[[float], float]
"""Where a front is on its loop [m] at a time [s]."""

ACROSS, ALONG = "A_0>B_0", "C_0>D_0"
"""The movements that cross in the middle of junction J, 55 m after the beginning of either loop."""

SHARED = (52.8, 57.2)
"""The stretch of either that the abstraction says they share [m]; as drawn it is 54.1 to 55.9 m."""


def loop(first: str, second: str, number: int, foes: dict[str, tuple[float, float] | None]) -> LoopWay:
    """Two lanes of 50 m, joined by 10 m inside junction J and 10 m inside junction K."""
    return LoopWay(
        120.0,
        (
            LoopSpan(0.0, 50.0, (first,)),
            LoopSpan(50.0, 60.0, (f":J_{number}_0",)),
            LoopSpan(60.0, 110.0, (second,)),
            LoopSpan(110.0, 120.0, (f":K_{number}_0",)),
        ),
        (
            LoopLeg(first, 0.0, 49.9, ((f"{first}>{second}", foes),)),
            LoopLeg(second, 60.0, 109.9, ((f"{second}>{first}", {}),)),
        ),
    )


def layout(
    across: dict[str, tuple[float, float] | None] | None = None,
    along: dict[str, tuple[float, float] | None] | None = None,
) -> Layout:
    """Two vehicles on each loop; the movements over J are foes unless told otherwise."""
    return Layout(
        step_s=1.0,
        room={"A_0": 2, "B_0": 1, "C_0": 2, "D_0": 2},
        loops={
            "a": loop("A_0", "B_0", 0, {ALONG: SHARED} if across is None else across),
            "c": loop("C_0", "D_0", 1, {ACROSS: SHARED} if along is None else along),
        },
        vehicles={
            "v1": VehicleBody("a", 5.0, 1.8, 20.0, 0),
            "v2": VehicleBody("c", 5.0, 1.8, 20.0, 0),
            "v3": VehicleBody("a", 5.0, 1.8, 10.0, 0),
        },
        movements={ACROSS: (":J_0_0",), ALONG: (":J_1_0",)},
        shapes={
            "A_0": ((-55.0, 0.0), (-5.0, 0.0)),
            "B_0": ((5.0, 0.0), (55.0, 0.0)),
            "C_0": ((0.0, -55.0), (0.0, -5.0)),
            "D_0": ((0.0, 5.0), (0.0, 55.0)),
            ":J_0_0": ((-5.0, 0.0), (5.0, 0.0)),
            ":J_1_0": ((0.0, -5.0), (0.0, 5.0)),
            ":K_0_0": ((500.0, 0.0), (510.0, 0.0)),
            ":K_1_0": ((0.0, 500.0), (0.0, 510.0)),
        },
    )


def heights(above: float) -> dict[str, float]:
    """Lanes of loop a at 35 m, those of loop c `above`."""
    return dict.fromkeys(("A_0", "B_0", ":J_0_0"), 35.0) | dict.fromkeys(("C_0", "D_0", ":J_1_0"), above)


def drive(begin_m: float, speed: float, *, from_s: float = 1.0, until_m: float = 1e9) -> Arc:
    """Stand until a time, then drive at a constant speed up to a place."""
    return lambda t: min(begin_m + speed * max(0.0, t - from_s), until_m)


def audit(
    folder: Path,
    ways: dict[str, Arc],
    events: list[tuple[float, str, str, str]],
    plan: Layout | None = None,
    *,
    steps: int = 40,
    stray: tuple[float, str, str] | None = None,
) -> PositionAudit:
    """Write the record that SUMO would have written, and audit it."""
    plan = plan or layout()
    rows = []
    for step in range(steps):
        for name, way in ways.items():
            body, time = plan.vehicles[name], step + plan.step_s
            arc, before = way(time), way(time - 1.0)
            where = arc % 120.0
            span = next(s for s in plan.loops[body.loop].spans if s.begin_m <= where <= s.end_m)
            lane = span.lanes[0]
            if stray and stray[:2] == (time, name):
                lane = stray[2]
            x, y, angle = (where - 55.0, 0.0, 90.0) if body.loop == "a" else (0.0, where - 55.0, 0.0)
            speed, odometer = arc - before, arc - way(1.0)
            pos = where - span.begin_m
            rows.append(
                f"{step:.2f};{name};{x:.2f};{y:.2f};{angle:.2f};{speed:.2f};{pos:.2f};{lane};{odometer:.2f}"
            )
    names = ("x", "y", "angle", "speed", "pos", "lane", "odometer")
    head = ";".join(("timestep_time", "vehicle_id", *(f"vehicle_{name}" for name in names)))
    file = folder / "positions.csv"
    file.write_text("\n".join((head, *rows)) + "\n", encoding="utf-8")
    trace = pd.DataFrame([(*event, "", "") for event in events], columns=list(EVENT_COLUMNS))
    kinds = pd.CategoricalDtype(list(plan.vehicles))  # as in the events of a run
    return audit_positions(file, plan, trace.astype({VEHICLE: kinds}))


def rules(found: PositionAudit) -> list[str]:
    """Return the rules broken, in order."""
    return [finding.rule for finding in found.findings]


GRANTED = [(1.0, "v1", "grant", "B_0"), (1.0, "v2", "grant", "D_0"), (1.0, "v3", "grant", "B_0")]


def test_one_after_the_other_is_clean(tmp_path: Path) -> None:
    """v1's rear leaves the stretch when its front is at 62.2 m, v2's front reaches it 1.88 s later."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 4.0, from_s=3.12, until_m=90.0)}
    found = audit(tmp_path, ways, GRANTED)
    assert rules(found) == []
    assert found.figures["rows"] == 80
    assert found.figures["margin_s"]["count"] == 1
    assert found.figures["margin_s"]["least"] == pytest.approx(1.88, abs=0.03)
    # From the rear past 55.9 m to the front at 54.1 m.
    assert found.figures["drawn_margin_s"]["least"] == pytest.approx(1.88 + 1.3 / 5 + 1.3 / 4, abs=0.25)


def test_both_on_the_shared_stretch(tmp_path: Path) -> None:
    """v2 comes 0.24 s before v1 has left the stretch; as drawn, they just miss each other."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 4.0, until_m=90.0)}
    found = audit(tmp_path, ways, GRANTED)
    assert rules(found) == ["crossing"]
    assert found.findings[0].vehicle == "v2"
    assert found.findings[0].at_s == pytest.approx(9.2, abs=0.01)
    assert "v1 leaves 0.2" in found.findings[0].text


def test_who_stays_on_the_stretch_is_in_the_way(tmp_path: Path) -> None:
    """v1 stops with its rear on the stretch and stays: v2 may never come, however late."""
    ways = {"v1": drive(20.0, 5.0, until_m=60.0), "v2": drive(20.0, 5.0, from_s=25.0, until_m=53.5)}
    found = audit(tmp_path, ways, GRANTED)
    assert rules(found) == ["crossing"]
    assert "v1 is still there" in found.findings[0].text
    assert found.figures["stands_in_crossings"] == 2
    assert found.figures["longest_stand"] == {"vehicle": "v1", "lane": ":J_0_0", "at_s": 10.0}


def test_bodies_that_overlap(tmp_path: Path) -> None:
    """Both in the middle at once: said, drawn, and seen on the ground, once."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 5.0, until_m=90.0)}
    found = audit(tmp_path, ways, GRANTED)
    assert set(rules(found)) == {"bodies", "crossing", "drawn"}


def test_bridges_are_no_collisions(tmp_path: Path) -> None:
    """Where the network says how high lanes lie, five metres apart is above; else all is on one level."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 5.0, until_m=90.0)}
    high = dataclasses.replace(layout({}, {}), heights=heights(40.0))
    assert lies_above(high, ":J_0_0", ":J_1_0")
    assert rules(audit(tmp_path, ways, GRANTED, high)) == []
    level = dataclasses.replace(high, heights=heights(36.0))
    assert "bodies" in rules(audit(tmp_path, ways, GRANTED, level))


def test_roads_that_cross_without_a_junction(tmp_path: Path) -> None:
    """On a bridge the two may be at once, ten metres beside it they may not."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 5.0, until_m=90.0)}
    roads = ("A_0", "B_0", ":J_0_0"), ("C_0", "D_0", ":J_1_0")
    apart = dataclasses.replace(layout({}, {}), bridges=(Bridge(0.0, 0.0, *roads),))
    assert rules(audit(tmp_path, ways, GRANTED, apart)) == []
    beside = dataclasses.replace(apart, bridges=(Bridge(14.0, 0.0, *roads),))
    assert "bodies" in rules(audit(tmp_path, ways, GRANTED, beside))


def test_a_foe_forgotten(tmp_path: Path) -> None:
    """The abstraction says nothing of the crossing: the drawing shows it, and the meeting."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 4.27, until_m=90.0)}
    found = audit(tmp_path, ways, GRANTED, layout({}, {}))
    assert {"conflict", "drawn"} <= set(rules(found))
    assert "are no foes" in found.findings[0].text
    found = audit(tmp_path, {"v1": ways["v1"]}, GRANTED, layout({}, {}))
    assert set(rules(found)) == {"conflict"}


@pytest.mark.parametrize(("length_m", "broken"), [(5.0, False), (9.0, True)])
def test_a_stretch_that_only_longer_bodies_are_on(
    length_m: float,
    broken: bool,  # noqa: FBT001  a case
    tmp_path: Path,
) -> None:
    """Its first front is 7.2 m beyond its last rear; v1 comes there while v2 is on its own."""
    longer = layout({ALONG: (57.2, 50.0)})
    longer = dataclasses.replace(
        longer, vehicles={**longer.vehicles, "v1": VehicleBody("a", length_m, 1.8, 20.0, 0)}
    )
    ways = {"v1": drive(20.0, 4.0, until_m=58.0), "v2": drive(20.0, 5.0, until_m=53.5)}
    assert ("crossing" in rules(audit(tmp_path, ways, GRANTED, longer))) == broken


@pytest.mark.parametrize(("length_m", "broken"), [(5.0, []), (9.0, ["crossing"])])
def test_stretches_by_length(length_m: float, broken: list[str], tmp_path: Path) -> None:
    """A long v1 may not pass while v2 stands 1.8 m before the stretch that short vehicles share."""
    plan, wide = layout(), (50.0, 61.0)
    table = SizedStretches((5.0, 9.0), ((SHARED, wide), (wide, wide)))
    loops = {
        name: dataclasses.replace(way, legs=(dataclasses.replace(way.legs[0], sized=sized), way.legs[1]))
        for (name, way), sized in zip(
            plan.loops.items(), ({ACROSS: {ALONG: table}}, {ALONG: {ACROSS: table}}), strict=True
        )
    }
    vehicles = {**plan.vehicles, "v1": VehicleBody("a", length_m, 1.8, 20.0, 0)}
    plan = dataclasses.replace(plan, loops=loops, vehicles=vehicles)
    write_layout(plan, tmp_path / "layout.json")
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 5.0, until_m=51.0)}
    assert rules(audit(tmp_path, ways, GRANTED, read_layout(tmp_path / "layout.json"))) == broken


@pytest.mark.parametrize("first", [0, 1])
def test_a_narrow_street_is_shared_on_its_own_edge_alone(first: int) -> None:
    """Who stands before it, inside the crossing, may have let others over it; other foes have no edge.

    The loop begins at A_0, or on the narrow street itself.
    """
    lanes = [("A_0", 50.0), (":J_0", 10.0), ("B_0", 20.0), (":K_0", 10.0), ("C_0", 50.0), (":L_0", 10.0)]
    lanes = lanes[2 * first :] + lanes[: 2 * first]
    at_m = dict(zip([lane for lane, _ in lanes], [0.0, *accumulate(size for _, size in lanes)], strict=False))
    over = ("A_0>B_0", {"X_0>Y_0": None}), ("B:0>0", {"Y:0>0": None})
    legs = {name: LoopLeg(name, at_m[name], at_m[name] + 49.9, ()) for name in ("A_0", "C_0")}
    legs["A_0"] = dataclasses.replace(legs["A_0"], crossings=over)
    spans = tuple(LoopSpan(at_m[lane], at_m[lane] + size, (lane,)) for lane, size in lanes)
    way = LoopWay(150.0, spans, tuple(sorted(legs.values(), key=lambda leg: leg.begin_m)))
    plan = dataclasses.replace(layout(), room={}, loops={"a": way})
    found = lay_stretches(plan, {"a": []}).loops["a"]
    begins_m, ends_m = found.begin_m - legs["A_0"].begin_m, found.end_m - legs["A_0"].begin_m
    assert begins_m.round(1).tolist() == [49.9, 60.0]
    assert ends_m.round(1).tolist() == [90.0, 80.0]


def test_a_stretch_halved(tmp_path: Path) -> None:
    """The stretch ends in the middle of the crossing: 0.9 m or so are missing as drawn."""
    half = (52.8, 54.6)
    found = audit(tmp_path, {"v1": drive(20.0, 5.0, until_m=90.0)}, GRANTED, layout({ALONG: half}, None))
    assert set(rules(found)) == {"conflict"}
    assert " m beyond the stretch" in found.findings[0].text


def test_a_foe_in_the_way_all_along(tmp_path: Path) -> None:
    """Without a stretch the foe is in the way from the end of one place to the beginning of the next."""
    ways = {"v1": drive(20.0, 5.0, until_m=90.0), "v2": drive(20.0, 3.8, until_m=90.0)}
    assert rules(audit(tmp_path, ways, GRANTED)) == []
    assert rules(audit(tmp_path, ways, GRANTED, layout({ALONG: None}, {ACROSS: None}))) == ["crossing"]


def test_more_bodies_than_a_place_holds(tmp_path: Path) -> None:
    """B_0 holds one: the front of v3 is there before the rear of v1 has left."""
    ways = {"v1": drive(20.0, 5.0, until_m=112.0), "v3": drive(10.0, 5.0, until_m=70.0)}
    found = audit(tmp_path, ways, [*GRANTED, (5.0, "v1", "grant", "A_0")])
    assert rules(found) == ["room"]
    assert found.findings[0].at_s == pytest.approx(11.0, abs=0.01)


def test_a_body_with_a_grant_to_leave_a_queue_takes_no_slot_there(tmp_path: Path) -> None:
    """If B_0 held two, v1 with its grant and v2 and v3 without might be there, but not three without."""
    plan = dataclasses.replace(layout(), room={"A_0": 2, "B_0": 2, "C_0": 2, "D_0": 2})
    plan = dataclasses.replace(plan, vehicles={**plan.vehicles, "v4": VehicleBody("a", 5.0, 1.8, 0.0, 0)})
    ways = {
        "v1": drive(20.0, 5.0, until_m=112.0),
        "v3": drive(10.0, 5.0, until_m=100.0),
        "v4": drive(0.0, 5.0, until_m=90.0),
    }
    granted = [(0.0, name, "grant", "B_0") for name in ways]
    assert rules(audit(tmp_path, ways, [*granted, (5.0, "v1", "grant", "A_0")], plan)) == []
    ways["v1"] = drive(20.0, 5.0, until_m=108.0)
    assert rules(audit(tmp_path, ways, granted, plan)) == ["room"]


def test_who_is_on_the_road_before_it_is_under_the_gate_takes_no_slot(tmp_path: Path) -> None:
    """SUMO inserts v3, the gate takes it out after a step, and lets it depart again later."""
    ways = {"v1": drive(20.0, 5.0, until_m=112.0), "v3": drive(10.0, 5.0, until_m=70.0)}
    granted = [*GRANTED, (5.0, "v1", "grant", "A_0"), (1.0, "v1", "start", "A_0")]
    assert rules(audit(tmp_path, ways, granted)) == []
    assert rules(audit(tmp_path, ways, [*granted, (10.0, "v3", "start", "A_0")])) == ["room"]


def test_a_front_beyond_its_grant(tmp_path: Path) -> None:
    """v1 is granted B_0 after the step in which it came 6.1 m beyond A_0: too late for that step."""
    found = audit(tmp_path, {"v1": drive(20.0, 12.0, until_m=90.0)}, [(4.0, "v1", "grant", "B_0")], steps=20)
    assert rules(found) == ["ahead"]
    assert found.findings[0].at_s == 4.0
    assert "6.1 m beyond" in found.findings[0].text


def test_a_rear_where_it_is_said_to_have_left(tmp_path: Path) -> None:
    """v1's rear leaves A_0 when its front is at 54.9 m, at 7.98 s: at 7 s it had not, at 8 s it has."""
    way = {"v1": drive(20.0, 5.0, until_m=90.0)}
    assert rules(audit(tmp_path, way, [*GRANTED, (7.0, "v1", "leave", "A_0")])) == ["behind"]
    assert rules(audit(tmp_path, way, [*GRANTED, (8.0, "v1", "leave", "A_0")])) == []


def test_a_lane_that_is_not_on_the_loop(tmp_path: Path) -> None:
    """Told once for each such lane."""
    found = audit(tmp_path, {"v1": drive(20.0, 5.0, until_m=45.0)}, [], stray=(4.0, "v1", "Z_0"))
    assert rules(found) == ["lane"]


def test_laps_are_told_apart(tmp_path: Path) -> None:
    """v1 passes three times, v2 once, after the first: one margin for v2 and two for v1."""
    grants = [(1.0, "v1", "grant", place) for place in ("B_0", "A_0", "B_0", "A_0", "B_0", "A_0")]
    ways = {"v1": drive(20.0, 10.0, until_m=330.0), "v2": drive(20.0, 10.0, from_s=6.5, until_m=160.0)}
    found = audit(tmp_path, ways, [*grants, *[(1.0, "v2", "grant", p) for p in ("D_0", "C_0")]])
    assert rules(found) == []
    assert found.figures["margin_s"]["count"] == 3


def test_the_size_of_the_pieces_does_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same record read in pieces of a few rows gives the same findings and figures."""
    ways = {
        "v1": drive(20.0, 5.0, until_m=112.0),
        "v2": drive(20.0, 5.0, until_m=90.0),
        "v3": drive(10.0, 5.0, until_m=70.0),
    }
    whole = audit(tmp_path, ways, GRANTED)
    monkeypatch.setattr(position_table, "_BLOCK_BYTES", 400)
    assert audit(tmp_path, ways, GRANTED) == whole
    assert {"room", "bodies", "crossing", "drawn", "ahead"} == set(rules(whole))


def test_many_findings_of_one_rule_are_counted(tmp_path: Path) -> None:
    """The first two hundred are told."""
    found = audit(tmp_path, {"v1": drive(20.0, 1.0, until_m=90.0)}, [], steps=250)
    assert len(found.findings) == 201
    assert found.findings[-1].text.endswith("more findings of the rule 'ahead'")


def test_a_layout_is_read_back(tmp_path: Path) -> None:
    """What is written is what is read; what is no layout is an error that names the file."""
    plan = layout({ALONG: None}, None)
    write_layout(plan, tmp_path / "layout.json")
    assert read_layout(tmp_path / "layout.json") == plan
    (tmp_path / "layout.json").write_text("{}")
    with pytest.raises(ResultsError, match=r"layout\.json: no layout"):
        read_layout(tmp_path / "layout.json")


def test_a_record_that_cannot_be_read(tmp_path: Path) -> None:
    """An error that names the file."""
    (tmp_path / "p.csv").write_text("a;b\n1;2\n")
    with pytest.raises(ResultsError, match=r"p\.csv: no readable positions"):
        audit_positions(tmp_path / "p.csv", layout(), pd.DataFrame(columns=list(EVENT_COLUMNS)))


def test_without_lanes_inside_junctions_nothing_is_drawn() -> None:
    """Such networks have no geometry; the places are still checked."""
    plan = layout()
    roads = tuple(span for span in plan.loops["a"].spans if not span.internal)
    plan = dataclasses.replace(
        plan,
        loops={"a": dataclasses.replace(plan.loops["a"], spans=roads)},
        vehicles={"v1": plan.vehicles["v1"]},
    )
    assert conflicts_by_loop(plan, find_meetings(plan)) == {"a": []}


def test_bodies_are_drawn_once_for_the_same_roads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where vehicles start makes no difference to it; how long they are does."""
    drawn: list[int] = []

    def counted(plan: Layout, ways: Sequence[LaneOnWay]) -> object:
        drawn.append(1)
        return draw_bodies(plan, ways)

    monkeypatch.setattr(drawing, "draw_bodies", counted)
    monkeypatch.setattr(drawing, "_KEPT", Cache(1))
    plan = layout()
    body = dataclasses.replace(plan.vehicles["v1"], start_m=1.0)
    elsewhere = dataclasses.replace(plan, vehicles={**plan.vehicles, "v1": body})
    longer = dataclasses.replace(body, length_m=body.length_m + 7.25)
    found, again, other = (
        find_meetings(one)
        for one in (plan, elsewhere, dataclasses.replace(plan, vehicles={**plan.vehicles, "v1": longer}))
    )
    assert (len(drawn), again == found, other == found) == (2, True, False)


def test_who_leaves_one_lane_another_way_is_kept_apart_by_right_of_way() -> None:
    """Both leave A, one straight on and one to the left: where nobody has right of way they can touch."""
    plan = layout({}, {})
    plan = dataclasses.replace(
        plan,
        loops={"a": loop("A_0", "B_0", 0, {}), "c": loop("A_0", "D_0", 1, {})},
        shapes={**plan.shapes, ":J_1_0": ((-5.0, 0.0), (-1.0, 1.0), (0.0, 5.0))},
    )
    assert find_meetings(plan) == []
    meetings = find_meetings(dataclasses.replace(plan, unregulated=("A_0",)))
    assert {frozenset((m.one.lane, m.other.lane)) for m in meetings} >= {frozenset((":J_0_0", ":J_1_0"))}


def test_wide_bodies_reach_farther() -> None:
    """A bus of 2.5 m touches at 1.25 m on either side of the middle."""
    plan = layout()
    bus, car = VehicleBody("a", 12.0, 2.5, 20.0, 0), VehicleBody("c", 5.0, 1.8, 20.0, 0)
    plan = dataclasses.replace(plan, vehicles={"b": bus, "c": car})
    on_c = conflicts_by_loop(plan, find_meetings(plan))["c"]
    assert min(c.begin_m for c in on_c) == pytest.approx(53.75, abs=0.5)


def test_a_trailer_bends_where_lanes_meet() -> None:
    """Its recorded angle is that of its first part; the rest lies on the lanes behind."""
    plan = layout()
    shapes = {**plan.shapes, "A_0": ((-5.0, -50.0), (-5.0, 0.0))}  # it comes from the south and turns right
    trailer = VehicleBody("a", 16.5, 2.5, 20.0, 0, jointed=True)
    plan = dataclasses.replace(plan, shapes=shapes, vehicles={"v1": trailer, "v2": plan.vehicles["v2"]})
    one = np.zeros(1)
    rows = Positions(
        time_s=one,
        vehicle=np.zeros(1, dtype=np.int64),
        lane=np.zeros(1, dtype=np.int64),
        lane_name=np.array([":J_0_0"], dtype=object),
        pos_m=one + 9.0,
        speed_mps=one,
        odometer_m=one,
        x_m=one + 4.0,
        y_m=one,
        angle_deg=one + 90.0,
    )
    found = bends(plan, ["v1", "v2"], rows, one + 59.0)
    assert found[0] == pytest.approx(np.array([(4.0, 0.0), (-5.0, 0.0), (-5.0, -7.5)]))
    stiff = dataclasses.replace(trailer, jointed=False)
    assert bends(dataclasses.replace(plan, vehicles={"v1": stiff}), ["v1"], rows, one + 59.0) == {}


@pytest.mark.parametrize(("at", "overlap"), [((-5.0, -6.0), True), ((-9.0, 0.0), False)])
def test_each_part_of_a_trailer_is_a_body(at: tuple[float, float], overlap: bool) -> None:  # noqa: FBT001  cases
    """One stands where its rear lies; another where a stiff one of its length would reach."""
    two = np.zeros(2)
    rows = Positions(
        time_s=two,
        vehicle=np.arange(2),
        lane=np.zeros(2, dtype=np.int64),
        lane_name=np.array([":J_0_0", "x"], dtype=object),
        pos_m=two,
        speed_mps=two,
        odometer_m=two,
        x_m=np.array([4.0, at[0]]),
        y_m=np.array([0.0, at[1]]),
        angle_deg=np.array([90.0, 0.0]),
    )
    parts = {0: np.array([(4.0, 0.0), (-5.0, 0.0), (-5.0, -7.5)])}
    sizes = np.array([16.5, 2.0]), np.array([2.5, 1.5])
    assert bool(len(overlapping(rows, *sizes, parts))) is overlap
    assert len(overlapping(rows, *sizes, {})) == (0 if overlap else 1)


def test_two_lanes_that_meet_at_both_ends_are_kept_apart_there() -> None:
    """As opposite lanes of a street do, where others turn in and out: one at each end is no clash."""
    near = Side("a", "A_0", 0.0, -2.0, 3.0, waits=False, shortest=True)
    far = near._replace(begin_m=45.0, end_m=42.0)
    ends = [near, far]
    meetings = [
        Meeting(mine, theirs._replace(loop="c", lane="C_0"), ({"a": 0.0}, {"c": 0.0}))
        for mine, theirs in zip(ends, reversed(ends), strict=True)
    ]
    found = conflicts_by_loop(layout(), [*meetings, *meetings])
    assert [(c.begin_m, c.zone) for c in found["a"]] == [(0.0, 0), (45.0, 1)]
    assert [(c.begin_m, c.zone) for c in found["c"]] == [(0.0, 1), (45.0, 0)]


def test_a_bus_that_a_car_touches_nearer_than_another_bus_is_told_apart() -> None:
    """The stretch on which two buses touch is none between a bus and a car that turn on the same lane."""
    bus = Side("a", "B_0", 0.0, -7.0, 5.0, waits=False, shortest=True, length_m=12.0)
    car = Side("c", ":J_1_0", 0.0, 4.0, 9.0, waits=False, shortest=True, length_m=5.0)
    meetings = [
        Meeting(bus, car, ({"a": 0.0}, {"c": 0.0})),
        Meeting(bus._replace(end_m=3.0), car._replace(loop="b", length_m=12.0), ({"a": 0.0}, {"b": 0.0})),
    ]
    plan = layout()
    plan = dataclasses.replace(plan, loops={**plan.loops, "b": plan.loops["c"]})
    found = conflicts_by_loop(plan, meetings)
    assert [(c.end_m, c.zone) for c in found["a"]] == [(-7.0, 0), (3.0, 1)]
    assert [c.zone for name in ("c", "b") for c in found[name]] == [0, 1]


def test_lanes_touched_on_different_ways_to_them_are_told_apart() -> None:
    """Who turns round onto a road touches others at its beginning than who comes straight onto it."""
    turned = Side("a", "B_0", 0.0, -2.0, 3.0, waits=False, shortest=True, under=frozenset({1, 2}))
    straight = turned._replace(loop="b", under=frozenset({1, 3}))
    foe = Side("c", ":J_1_0", 0.0, -2.0, 3.0, waits=False, shortest=True)
    meetings = [
        Meeting(turned, foe, ({"a": 0.0}, {"c": 0.0})),
        Meeting(straight, foe._replace(begin_m=1.0), ({"b": 0.0}, {"c": 0.0})),
    ]
    plan = layout()
    plan = dataclasses.replace(plan, loops={**plan.loops, "b": plan.loops["a"]})
    found = conflicts_by_loop(plan, meetings)
    assert [(c.begin_m, c.zone) for c in found["c"]] == [(0.0, 0), (1.0, 1)]
    assert [c.zone for name in ("a", "b") for c in found[name]] == [0, 1]


def test_a_vehicle_changes_lanes_between_its_places() -> None:
    """Before the first of them it is on the one lane, behind the last on the other."""
    span = LoopSpan(10.0, 110.0, ("E_1", "E_0"), entered="E_0")
    places = (LoopLeg("E_0", 30.0, 60.0), LoopLeg("E_1", 80.0, 108.0))
    way = LoopWay(300.0, (span, LoopSpan(110.0, 310.0, ("F_0",))), places)
    assert driven(way, span, way.spans[1]) == [(1e-6, 70.0), (50.0, 100.0)]


@pytest.mark.parametrize(("begins_m", "touch"), [(20.0, False), (0.0, True)])
def test_nobody_is_drawn_before_the_place_where_who_drives_once_departs(
    begins_m: float, *, touch: bool
) -> None:
    """Its road crosses the way of others 6 m behind its beginning; the first place can begin beyond that."""
    plan = layout()
    legs = (LoopLeg("E_0", begins_m, 49.9), LoopLeg("away E_0", 50.0, 1049.9))
    plan = dataclasses.replace(
        plan,
        loops={**plan.loops, "once": LoopWay(1050.0, (LoopSpan(0.0, 50.0, ("E_0",)),), legs)},
        vehicles={**plan.vehicles, "v4": VehicleBody("once", 5.0, 1.8, 30.0, 0)},
        shapes={**plan.shapes, "E_0": ((0.0, -6.0), (0.0, 44.0))},
    )
    lanes = {frozenset((found.one.lane, found.other.lane)) for found in find_meetings(plan)}
    assert (frozenset(("E_0", ":J_0_0")) in lanes) == touch
