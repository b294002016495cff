"""Events become spans of time: places, ways, refusals, holds, laps, deadlocks."""

import numpy as np
import pandas as pd
import pytest

from loopgate.audit.layout import Layout, LoopLeg, LoopSpan, LoopWay, VehicleBody
from loopgate.gates import Reason
from loopgate.replay.scene import WHY, DrawnLines, Happenings, find_happenings, find_lines
from loopgate.replay.tracks import Tracks
from loopgate.results.columns import EVENT_COLUMNS

STEPS = 21


@pytest.fixture
def layout() -> Layout:
    """Return a way of 100 m with two places of 40 m, each before a crossing of 10 m; they are foes."""
    lanes = {
        "a": ((0.0, 0.0), (50.0, 0.0)),
        "b": ((50.0, 0.0), (0.0, 0.0)),
    }
    legs = (
        LoopLeg("A", 0.0, 40.0, (("a>b", {"b>a": None}),)),
        LoopLeg("B", 50.0, 90.0, (("b>a", {"a>b": (0.0, 1.0)}),)),
    )
    spans = (LoopSpan(0.0, 50.0, ("a",)), LoopSpan(50.0, 100.0, ("b",)))
    body = VehicleBody("ring", 5.0, 1.8, 20.0, 0)
    return Layout(
        step_s=1.0,
        room={"A": 5, "B": 5},
        loops={"ring": LoopWay(100.0, spans, legs)},
        vehicles={"v": body, "w": VehicleBody("ring", 5.0, 1.8, 70.0, 1)},
        movements={},
        shapes=lanes,
    )


def tracks(speed_mps: float = 5.0) -> Tracks:
    """Two vehicles that drive east evenly, from second 1 on."""
    steps = np.arange(STEPS)
    return Tracks(
        vehicles=("v", "w"),
        first_s=1.0,
        step_s=1.0,
        frames=STEPS,
        owner=np.array([0, 1]),
        begin=np.array([0, 0]),
        count=np.array([STEPS, STEPS]),
        x=np.tile(np.rint(10 * speed_mps * steps).astype(np.int64), 2),
        y=np.zeros(2 * STEPS, dtype=np.int64),
        heading=np.zeros(2 * STEPS, dtype=np.int64),
        odometer_m=np.tile(speed_mps * steps, 2),
    )


def events(*rows: tuple[float, str, str, str, str]) -> pd.DataFrame:
    return pd.DataFrame([(*row, "") for row in rows], columns=list(EVENT_COLUMNS))


def read(
    layout: Layout | None, *rows: tuple[float, str, str, str, str], speed_mps: float = 5.0
) -> Happenings:
    ways = find_lines(layout) if layout else DrawnLines({}, {}, (), {}, ())
    return find_happenings(events(*rows), tracks(speed_mps), layout, ways)


def test_from_the_grant_to_the_rear(layout: Layout) -> None:
    """A slot is taken at the grant and free when the rear has left; the way until the rear is behind it."""
    found = read(
        layout,
        (1.0, "v", "start", "A", ""),
        (4.0, "v", "grant", "B", "free"),
        (7.0, "v", "enter", "B", ""),
        (8.0, "v", "leave", "A", ""),
    )
    assert [tuple(span)[:4] for span in found.visits] == [(0, 0, 0, 7), (1, 0, 3, STEPS)]
    assert [tuple(span)[:4] for span in found.passages] == [(0, 0, 3, 7)]  # 5 m at 5 m/s after second 7


def test_a_refusal_lasts_until_the_grant_or_the_next_reason(layout: Layout) -> None:
    """Each reason is a span of its own, on the link that leads from the vehicle's leg."""
    found = read(
        layout,
        (1.0, "w", "start", "B", ""),
        (2.0, "w", "refuse", "A", "occupied"),
        (4.0, "w", "hold", "A", ""),
        (5.0, "w", "refuse", "A", "crossing"),
        (9.0, "w", "grant", "A", "free"),
        (10.0, "w", "go", "A", ""),
    )
    why = list(WHY)
    assert [tuple(span) for span in found.refusals] == [
        (1, 1, 1, 4, why.index("occupied")),
        (1, 1, 4, 8, why.index("crossing")),
    ]
    assert [tuple(span) for span in found.holds] == [(0, 1, 3, 9, 0)]


def test_what_is_under_way_ends_with_the_run(layout: Layout) -> None:
    """Interrupted or over: the spans reach up to the last step."""
    found = read(
        layout,
        (1.0, "v", "start", "A", ""),
        (3.0, "v", "refuse", "B", "reserve"),
        (4.0, "v", "hold", "B", ""),
    )
    assert [span.end for span in (*found.visits, *found.refusals, *found.holds)] == [STEPS] * 3


@pytest.mark.parametrize(("speed_mps", "begin", "end"), [(0.0, 0, STEPS), (5.0, 2, 3)])
def test_a_circle_lasts_from_when_all_stand_until_one_of_it_moves_on(
    layout: Layout, speed_mps: float, begin: int, end: int
) -> None:
    """It closed before it was noticed; whoever has gone 2 m breaks it, else it stays until the end."""
    rows = [(3.0, "v", "deadlock", "B", "w"), (3.0, "w", "deadlock", "A", "v")]
    found = read(layout, *rows, speed_mps=speed_mps)
    assert [(circle.vehicles, circle.begin, circle.end) for circle in found.circles] == [((0, 1), begin, end)]


def test_without_a_gate_places_are_read_off_the_distance_driven(layout: Layout) -> None:
    """V starts at 20 m at 5 m/s: its front is in B after 30 m, its rear out of A after 25 m."""
    found = read(layout, (5.0, "v", "lap", "a", ""))
    mine = [(span.what, span.begin, span.end) for span in found.visits if span.vehicle == 0]
    assert mine == [(0, 0, 5), (0, 16, 21), (1, 6, 15)]
    assert found.laps == [(0, 4)]
    assert not found.passages


def test_without_a_layout_there_are_laps_and_mishaps() -> None:
    """A configuration run as it is has no places."""
    found = read(
        None, (2.0, "v", "collision", "a_0", "w"), (3.0, "w", "lap", "a", ""), (4.0, "v", "refuse", "x", "")
    )
    assert found.mishaps == [(0, 1, "collision")]
    assert found.laps == [(1, 2)]
    assert not found.visits


def test_foes_and_lines_of_links(layout: Layout) -> None:
    """The way behind A excludes that behind B and the other way round; lines lie where the lanes are."""
    ways = find_lines(layout)
    assert ways.foes == ((1,), (0,))
    assert ways.places["A"].tolist() == [[0, 0], [40, 0]]
    assert ways.links[1].line.tolist()[0] == [10, 0]
    assert ways.links[1].line.tolist()[-1] == [0, 0]


def test_every_reason_has_words() -> None:
    """Who is refused can be told why."""
    assert set(WHY) == set(Reason) - {Reason.FREE}
