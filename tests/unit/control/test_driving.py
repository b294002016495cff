"""Vehicles that come in while others drive."""

from __future__ import annotations

import pytest
from fake_traffic import FakeTraffic, FakeVehicle

from loopgate.abstraction.itinerary import DrawnLeg, Track
from loopgate.control.driving import Driving
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.rules import usual
from loopgate.model import StateId
from loopgate.network.loop import LanePosition
from loopgate.traffic.base import Insertion

EDGES = (("a", 50.0), ("b", 50.0))
LEGS = tuple(
    DrawnLeg(StateId(name), 50.0 * k, 50.0 * k + 50.0, line=LanePosition(name, 0, 50.0))
    for k, name in enumerate("ab")
)


class Comers(FakeTraffic):
    """Vehicles that all depart in the step after they were put in."""

    def __init__(self) -> None:
        super().__init__({})
        self.coming: list[str] = []
        self.come: list[str] = []

    def put_in(self, vehicle: str, how: Insertion) -> None:
        """Let a vehicle come."""
        self.fleet[vehicle] = FakeVehicle(EDGES, how.position_m)
        self.coming.append(vehicle)

    def take_out(self, vehicle: str) -> None:
        """Strike a vehicle."""
        del self.fleet[vehicle]

    def departed(self) -> tuple[str, ...]:
        """Return who has come."""
        return tuple(self.come)

    def step(self) -> None:
        """Let come who was put in."""
        super().step()
        self.come, self.coming = self.coming, []


def test_of_two_that_would_close_a_circle_together_one_waits() -> None:
    """With one more vehicle in each of two places of two slots, all would wait."""
    traffic = Comers()
    driving = Driving(traffic, PlaceLayout({"a": 2, "b": 2}, [LEGS]), Ledger(usual()))
    tracks = [
        Track(f"v{k}", "ab", 100.0, 50.0 * (k % 2) + at_m, 10.0, (), ((0.0, "a"), (50.0, "b")), LEGS, k % 2)
        for k, at_m in enumerate((40.0, 40.0, 10.0, 10.0))
    ]
    for track in tracks[:2]:
        traffic.put_in(track.vehicle, Insertion("ab", "car", 0, track.front_m))
    traffic.step()
    driving.take_in(tracks[:2])
    for track in tracks[2:]:
        assert driving.ledger.fits(driving.paths.of(track)[track.position])
        assert driving.arrivals.let_in(track, Insertion("ab", "car", 0, track.front_m))
    driving.step()
    assert list(driving.arrivals.departed_s) == ["v2"]
    assert driving.arrivals.missed == tracks[3:]
    assert set(traffic.fleet) == {"v0", "v1", "v2"}


@pytest.mark.parametrize(("at_m", "held"), [(0.0, False), (35.0, True)])
def test_who_departs_far_from_its_stop_line_is_held_only_once_it_is_refused(
    at_m: float, *, held: bool
) -> None:
    """Two vehicles fill place b. Who departs in place a is told to stop before it can be too late."""
    traffic = Comers()
    driving = Driving(traffic, PlaceLayout({"a": 2, "b": 2}, [LEGS]), Ledger(usual()))
    tracks = [
        Track(f"v{k}", "ab", 100.0, front_m, 10.0, (), ((0.0, "a"), (50.0, "b")), LEGS, int(front_m >= 50.0))
        for k, front_m in enumerate((90.0, 80.0, at_m))
    ]
    for track in tracks[:2]:
        traffic.put_in(track.vehicle, Insertion("ab", "car", 0, track.front_m))
        traffic.fleet[track.vehicle].still = True
    traffic.step()
    driving.take_in(tracks[:2])
    driving.arrivals.let_in(tracks[2], Insertion("ab", "car", 0, at_m))
    assert (traffic.fleet["v2"].hold_m is not None) == held
    for _ in range(30):
        driving.step()
    coming = driving.ledger.vehicles["v2"]
    assert coming.held
    assert coming.reason == "occupied"
    assert coming.front_m <= coming.line_m
