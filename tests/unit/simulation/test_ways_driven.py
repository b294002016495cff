"""A vehicle that went on by another way has one way in the layout: the one that it drove."""

from __future__ import annotations

from loopgate.audit.layout import Layout, LoopLeg, LoopSpan, LoopWay, VehicleBody
from loopgate.simulation.ways_driven import as_driven
from loopgate.simulation.ways_round import TurnOff


def way(*edges: str) -> LoopWay:
    """Return a way of edges of 100 m, each of which is a place, with a crossing behind it."""
    spans = tuple(LoopSpan(100.0 * k, 100.0 * k + 100.0, (f"{edge}_0",)) for k, edge in enumerate(edges))
    legs = tuple(
        LoopLeg(
            edge, span.begin_m, span.end_m - 1.0, ((f"{edge}>", {"foe": (span.end_m, span.end_m + 5.0)}),)
        )
        for edge, span in zip(edges, spans, strict=True)
    )
    return LoopWay(100.0 * len(edges), spans, legs)


def test_it_leads_over_the_first_and_then_the_others_in_one_arc_length() -> None:
    """From `b` of the first by the second, and from `d` of that by the third; arc lengths go on."""
    loops = {
        "first": way("a", "b", "c", "z"),
        "second": way("b", "d", "e", "z"),
        "third": way("x", "y", "d", "z"),
    }
    bodies = {name: VehicleBody("first", 5.0, 1.8, 10.0, 0) for name in ("led", "other")}
    layout = Layout(1.0, {}, loops, bodies, {}, {})
    turns = {"led": [TurnOff(1, "second", 0), TurnOff(1, "third", 2)]}
    led = as_driven(layout, turns, {})
    assert set(led.loops) == {"first", led.vehicles["led"].loop}
    assert led.vehicles["other"].loop == "first"
    driven = led.loops[led.vehicles["led"].loop]
    assert [leg.state for leg in driven.legs] == ["a", "b", "d", "z"]
    assert [(span.lanes[0], span.begin_m) for span in driven.spans] == [
        ("a_0", 0.0),
        ("b_0", 100.0),
        ("d_0", 200.0),
        ("z_0", 300.0),
    ]
    assert driven.length_m == 400.0
    assert driven.legs[1].crossings == (("b>", {"foe": (200.0, 205.0)}),)
    assert driven.legs[2].crossings == (("d>", {"foe": (300.0, 305.0)}),)


def test_who_was_not_led_another_way_keeps_its_own() -> None:
    """And ways that nobody drove are left out."""
    loops = {"first": way("a", "b"), "second": way("c", "d")}
    bodies = {"v": VehicleBody("first", 5.0, 1.8, 10.0, 0)}
    layout = Layout(1.0, {}, loops, bodies, {}, {}, unregulated=("a_0", "c_0"))
    driven = as_driven(layout, {}, {})
    assert driven.loops == {"first": loops["first"]}
    assert driven.unregulated == ("a_0",)


def test_on_the_road_where_it_turns_it_comes_on_one_lane_and_leaves_on_another() -> None:
    """As where the other way changes lanes behind the place."""
    first = way("a", "b", "c")
    second = LoopWay(
        200.0, (LoopSpan(0.0, 100.0, ("b_1", "b_0"), "b_0"), *way("b", "d").spans[1:]), way("b", "d").legs
    )
    layout = Layout(
        1.0, {}, {"first": first, "second": second}, {"v": VehicleBody("first", 5.0, 1.8, 10.0, 0)}, {}, {}
    )
    led = as_driven(layout, {"v": [TurnOff(1, "second", 0)]}, {})
    spans = led.loops[led.vehicles["v"].loop].spans
    assert spans[1] == LoopSpan(100.0, 200.0, ("b_1", "b_0"), "b_0")
    assert [span.lanes[0] for span in spans] == ["a_0", "b_1", "d_0"]
