"""Whom a standing vehicle waits for, without SUMO."""

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from loopgate.traffic.sumo_waits import RoadWaits

AT_M = {"a": 3.9, "b": 3.9}


def little_road(length_m: float) -> Any:  # noqa: ANN401  the API has no types
    """Return two vehicles on a road of 4 m, each before the junction where the other's rear is.

    Vehicle ``a`` has come over ``:j_0_0`` and wants over ``:k_0_0``; ``b`` over ``:k_1_0``, and wants over
    ``:j_1_0``.
    """
    lane_of, onto = {"a": "in_0", "b": "out_0"}, {"a": ":k_0_0", "b": ":j_1_0"}
    there = {lane: (name,) for name, lane in lane_of.items()}
    behind = {":j_0_0": "in_0", ":k_1_0": "out_0", ":k_0_0": "far_0", ":j_1_0": "away_0"}
    foes = {":k_0_0": (":k_1_0",), ":j_1_0": (":j_0_0",)}
    vehicle = Mock(
        getLeader=lambda *_: None,
        getLaneID=lane_of.get,
        getLanePosition=AT_M.get,
        getNextLinks=lambda name: [("", True, True, True, onto[name], "m", "s", 4.0)],
        getLength=lambda _: length_m,
        getMinGap=lambda _: 2.5,
        getJunctionFoes=lambda *_: (),
    )
    lane = Mock(
        getLength=lambda _: 4.0,
        getLinks=lambda one: [(behind[one], True, True, True, "", "M", "s", 4.0)],
        getInternalFoes=foes.get,
        getLastStepVehicleIDs=lambda one: there.get(one, ()),
    )
    return SimpleNamespace(vehicle=vehicle, lane=lane)


@pytest.mark.parametrize(("length_m", "waits"), [(5.0, True), (3.0, False)])
def test_two_whose_rears_bar_the_way_wait_for_each_other(length_m: float, *, waits: bool) -> None:
    """On a road too short for them, once they have stood for long; not where their rears are off the ways."""
    road = RoadWaits(little_road(length_m))
    assert road.of("a", guess=False) == ()
    assert road.of("a", guess=True) == (("b",) if waits else ())
    assert road.of("b", guess=True) == (("a",) if waits else ())
