"""Figures of vehicles that drive once: what they are sums and means of."""

from __future__ import annotations

from math import isnan
from pathlib import Path

import pytest

from loopgate.simulation.watching.trips import Trip, gated_trips, read_trips, trip_figures

THERE = Trip(
    "there",
    arrived=True,
    departed=True,
    depart_delay_s=1.0,
    duration_s=60.0,
    time_loss_s=8.0,
    waiting_s=4.0,
    arrival_s=71.0,
)
UNDER_WAY = Trip(
    "under way",
    arrived=False,
    departed=True,
    depart_delay_s=3.0,
    duration_s=30.0,
    time_loss_s=5.0,
    waiting_s=2.0,
)
OUTSIDE = Trip("outside", arrived=False, departed=False, depart_delay_s=26.0)

TRIPINFO = """<tripinfos>
<tripinfo id="there" depart="11.00" departDelay="1.00" arrival="71.00" duration="60.00" routeLength="500.00"
 waitingTime="4.00" stopTime="20.00" timeLoss="8.00" vaporized=""/>
<tripinfo id="under way" depart="13.00" departDelay="3.00" arrival="-1.00" duration="30.00" routeLength="200"
 waitingTime="2.00" stopTime="0.00" timeLoss="5.00" vaporized="end"/>
<tripinfo id="outside" depart="-1" departDelay="26.00" arrival="-1.00" duration="0.00" routeLength="4.60"
 waitingTime="0.00" stopTime="0.00" timeLoss="0.00" vaporized="end"/>
<tripinfo id="taken out" depart="40.00" departDelay="0.00" arrival="41.00" duration="1.00" routeLength="4.60"
 waitingTime="1.00" stopTime="1.00" timeLoss="1.00" vaporized="traci"/>
</tripinfos>"""


@pytest.fixture
def tripinfo(tmp_path: Path) -> Path:
    """One that has arrived, one under way, one that has not departed, and one that was taken out again."""
    file = tmp_path / "tripinfo.xml"
    file.write_text(TRIPINFO, encoding="utf-8")
    return file


def test_means_are_over_all_that_were_due_and_their_sum_holds() -> None:
    """One that has not departed has lost nothing on the way, but waits; a trip's time is of those there."""
    figures = trip_figures([THERE, UNDER_WAY, OUTSIDE])
    assert (figures["trips"], figures["arrived"], figures["unfinished"]) == (3, 1, 2)
    assert figures["mean_time_loss_s"] == pytest.approx(13.0 / 3, abs=0.001)
    assert figures["mean_depart_delay_s"] == 10.0
    assert figures["mean_delay_s"] == pytest.approx(43.0 / 3, abs=0.001)
    assert figures["mean_waiting_s"] == 2.0
    assert figures["mean_trip_s"] == 60.0
    assert (figures["worst_delay_s"], figures["worst_trip"]) == (26.0, "outside")


def test_without_arrivals_there_is_no_mean_time_of_a_trip() -> None:
    """None, not zero; without trips there are no figures at all."""
    assert trip_figures([UNDER_WAY, OUTSIDE])["mean_trip_s"] is None
    assert trip_figures([]) == {}


def test_arrivals_are_those_that_sumo_tells(tripinfo: Path) -> None:
    """Whoever was taken out has not arrived, and has no time of arrival."""
    trips = read_trips(tripinfo)
    assert trips["there"].arrival_s == 71.0
    for name in ("under way", "outside", "taken out"):
        assert not trips[name].arrived
        assert isnan(trips[name].arrival_s)


def test_stops_of_a_gate_are_waits_and_own_stops_are_not(tripinfo: Path) -> None:
    """Of 20 s at stops 15 s were its own."""
    delays_s = {"there": 1.0, "under way": 3.0}
    trips = gated_trips(read_trips(tripinfo, held=True), delays_s, {"there": 15.0}, {"there"})
    assert (trips["there"].waiting_s, trips["there"].time_loss_s) == (9.0, 13.0)
    assert (trips["there"].arrival_s, trips["there"].duration_s) == (71.0, 60.0)
    assert not trips["under way"].arrived


def test_one_that_the_gate_took_out_again_has_lost_nothing_on_the_way(tripinfo: Path) -> None:
    """SUMO has a row for each second in which it was there; it still waits to depart."""
    trips = gated_trips(read_trips(tripinfo, held=True), {"taken out": 12.0}, {}, {}, {"taken out"})
    trip = trips["taken out"]
    assert (trip.departed, trip.depart_delay_s, trip.delay_s, trip.waiting_s) == (False, 12.0, 12.0, 0.0)


def test_one_that_something_else_took_out_has_not_arrived(tripinfo: Path) -> None:
    """SUMO's calibrators do; SUMO counts it as arrived in the step in which it is gone."""
    trips = gated_trips(read_trips(tripinfo, held=True), {"taken out": 0.0}, {}, {"taken out"})
    assert not trips["taken out"].arrived
    assert isnan(trips["taken out"].arrival_s)
