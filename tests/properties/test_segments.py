"""Segments on random loops: who shares a zone and who must, by dense sampling and the model's rules."""

from __future__ import annotations

import itertools
import math
import time

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from roads import polygon
from scipy.spatial import cKDTree

from loopgate.abstraction.itinerary import CLEARANCE_M, Itinerary
from loopgate.abstraction.segments import lay_out_segments
from loopgate.abstraction.sharing import SharingBound
from loopgate.abstraction.survey import survey
from loopgate.network import Loop, RoadNetwork, generate_loops
from loopgate.network.contacts import lane_contacts

_STEP_M = 0.5
_NEED_M = 5.0 + 2.5 + CLEARANCE_M

Corner = tuple[float, float]
corners = st.tuples(st.integers(-60, 60), st.integers(-60, 60)).map(lambda c: (float(c[0]), float(c[1])))


@st.composite
def loops(draw: st.DrawFn) -> list[Loop]:
    """Two to five polygons with three to six corners, lanes longer or shorter than drawn."""
    found = []
    for number in range(draw(st.integers(2, 5))):
        points = draw(st.lists(corners, min_size=3, max_size=6, unique=True))
        stretch = draw(st.sampled_from([0.8, 1.0, 1.3]))
        loop = polygon(f"l{number}", points, stretch=stretch)
        assume(loop.length_m > 2.0 * _NEED_M)
        assume(all(span.length_m > 1.0 for span in loop.spans))
        found.append(loop)
    return found


def samples(loop: Loop, itinerary: Itinerary) -> tuple[np.ndarray, list[str]]:
    """Return points along all lanes the vehicle may be on, and the state of each."""
    points, states = [], []
    ends = [leg.end_m for leg in itinerary.legs]
    for span in loop.spans:
        count = max(2, int(span.length_m / _STEP_M))
        for shape in span.shapes:
            line = np.asarray(shape)
            along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))))
            for fraction in np.linspace(0.0, 1.0, count):
                arc = (span.begin_m + fraction * span.length_m) % loop.length_m
                if not itinerary.legs[0].begin_m <= arc < ends[-1]:
                    arc -= loop.length_m
                at = fraction * along[-1]
                points.append((np.interp(at, along, line[:, 0]), np.interp(at, along, line[:, 1])))
                states.append(itinerary.legs[min(np.searchsorted(ends, arc + 1e-9), len(ends) - 1)].state)
    return np.asarray(points), states


def check_exclusion(loops: list[Loop], itineraries: tuple[Itinerary, ...], rho_m: float) -> int:
    """Check that points of two paths within 2 rho lie in one state; return how many pairs there were."""
    sampled = [samples(loop, itinerary) for loop, itinerary in zip(loops, itineraries, strict=True)]
    trees = [cKDTree(points) for points, _ in sampled]
    pairs = 0
    for i, j in itertools.combinations(range(len(loops)), 2):
        near = trees[i].query_ball_tree(trees[j], 2.0 * rho_m - 1e-6)
        for k, others in enumerate(near):
            for m in others:
                pairs += 1
                assert sampled[i][1][k] == sampled[j][1][m], (loops[i].id, loops[j].id, sampled[i][0][k])
    return pairs


def check_legs(loops: list[Loop], itineraries: tuple[Itinerary, ...]) -> None:
    """Check that legs partition each loop, fit the vehicle, end where it can be held, and never repeat."""
    for loop, itinerary in zip(loops, itineraries, strict=True):
        legs = itinerary.legs
        assert legs[-1].end_m == pytest.approx(legs[0].begin_m + loop.length_m, abs=1e-5)
        assert legs[0].end_m > 0.0
        assert legs[-1].end_m <= loop.length_m + 1e-9
        for here, following in itertools.pairwise(legs):
            assert here.end_m == pytest.approx(following.begin_m, abs=1e-5)
        for leg in legs:
            assert leg.end_m - leg.begin_m >= _NEED_M - 1e-5
            assert loop.hold_before(leg.end_m) == pytest.approx(leg.end_m, abs=1e-5)
        if len(legs) > 1:
            states = [leg.state for leg in legs]
            assert all(a != b for a, b in zip(states, states[1:] + states[:1], strict=True))


def check_proposition_1(itineraries: tuple[Itinerary, ...]) -> None:
    """Check that no two shared states follow each other on two paths."""
    colours: dict[frozenset[str], set[str]] = {}
    for itinerary in itineraries:
        states = [leg.state for leg in itinerary.legs]
        for pair in zip(states, states[1:] + states[:1], strict=True):
            if len(set(pair)) == 2:
                colours.setdefault(frozenset(pair), set()).add(itinerary.loop.id)
    assert [users for users in colours.values() if len(users) > 1] == []


@given(loops(), st.sampled_from([0.5, 1.25, 4.0]))
def test_near_points_share_a_state(loops: list[Loop], rho_m: float) -> None:
    """Mutual exclusion by geometry: wherever two paths come within 2 rho, both are in one state."""
    itineraries = lay_out_segments(loops, rho_m=rho_m, piece_m=20.0).itineraries
    check_exclusion(loops, itineraries, rho_m)
    check_legs(loops, itineraries)
    check_proposition_1(itineraries)


@given(loops())
def test_zones_are_not_larger_than_asked_for(loops: list[Loop]) -> None:
    """Every visit to a zone comes near another path somewhere: nothing is shared in vain."""
    layout = lay_out_segments(loops, piece_m=20.0)
    points = [loop.curve() for loop in loops]
    for i, itinerary in enumerate(layout.itineraries):
        others = [k for k in range(len(loops)) if k != i]
        shared = {leg.state for k in others for leg in layout.itineraries[k].legs}
        for leg in itinerary.legs:
            if leg.state not in shared:
                continue
            near = math.inf
            for arc in np.arange(leg.begin_m, leg.end_m, _STEP_M):
                x = np.interp(arc % loops[i].length_m, points[i][1], points[i][0][:, 0])
                y = np.interp(arc % loops[i].length_m, points[i][1], points[i][0][:, 1])
                near = min(near, *(_distance((x, y), loops[k]) for k in others))
            assert near <= 2.5 + _STEP_M


def _distance(point: tuple[float, float], loop: Loop) -> float:
    best = math.inf
    for span in loop.spans:
        (ax, ay), (bx, by) = span.shapes[0]
        dx, dy = bx - ax, by - ay
        t = min(1.0, max(0.0, ((point[0] - ax) * dx + (point[1] - ay) * dy) / (dx * dx + dy * dy)))
        best = min(best, math.hypot(point[0] - ax - t * dx, point[1] - ay - t * dy))
    return best


segments = st.tuples(corners, corners).filter(lambda s: s[0] != s[1])


@given(segments, segments, st.sampled_from([0.5, 2.5, 20.0]))
def test_contacts_are_exact(one: tuple[Corner, Corner], other: tuple[Corner, Corner], reach: float) -> None:
    """The stretch of a straight lane near another is what sampling says, up to the sampling step."""
    found = lane_contacts({"one": one, "other": other}, reach)
    rows = [k for k in range(len(found.one)) if found.one[k] != found.other[k]]
    t = np.linspace(0.0, 1.0, 401)[:, None]
    points = np.asarray(one[0]) * (1 - t) + np.asarray(one[1]) * t
    track = polygon("other", [other[0], other[1]])
    near = t[[_distance((x, y), track) <= reach for x, y in points], 0]
    if not len(near):
        assert all(found.one_end[k] - found.one_begin[k] <= 1 / 400 for k in rows)
        return
    assert len(rows) == 1
    assert found.one_begin[rows[0]] == pytest.approx(near[0], abs=1 / 399)
    assert found.one_end[rows[0]] == pytest.approx(near[-1], abs=1 / 399)


@pytest.mark.parametrize(("network", "count", "seed"), [("sumo:bs3d", 6, 1), ("sumo:DRT", 12, 2)])
def test_near_points_share_a_state_in_real_networks(network: str, count: int, seed: int) -> None:
    """The same on roads with junctions, several lanes and lane changes."""
    found = list(generate_loops(RoadNetwork.open(network), count, seed=seed))
    itineraries = lay_out_segments(found).itineraries
    assert check_exclusion(found, itineraries, 1.25) > 1000
    check_legs(found, itineraries)
    check_proposition_1(itineraries)


@pytest.mark.parametrize("bound", [0.15, 0.4])
def test_bounded_sharing_is_bounded(bound: float) -> None:
    """No loop shares more than asked for, by the final zones."""
    network = RoadNetwork.open("sumo:DRT")
    found = generate_loops(network, 10, seed=4, admits=SharingBound(network, bound).admits)
    numbers = survey(lay_out_segments(found).itineraries)
    assert 0.0 < max(loop.shared for loop in numbers.loops) <= bound


def test_two_hundred_loops_take_seconds() -> None:
    """200 loops of 2 km in south-east Berlin melt into one zone, found without looking at all pairs."""
    found = generate_loops(RoadNetwork.open("sumo:DRT"), 200, length_m=(1500, 2500), seed=1)
    began = time.process_time()
    layout = lay_out_segments(found)
    assert time.process_time() - began < 10.0
    assert survey(layout.itineraries).shared > 0.95
    assert any("is shared by 200 of 200 loops" in line for line in layout.warnings)
