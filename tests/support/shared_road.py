"""Vehicles without SUMO on loops of their own that share one place: what drives them, and the traffic."""

from __future__ import annotations

from collections.abc import Sequence

from fake_traffic import FakeTraffic, FakeVehicle

from loopgate.abstraction.itinerary import DrawnLeg, Round, Track
from loopgate.control.diary import Row
from loopgate.control.driving import Driving
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.rules import usual
from loopgate.model import StateId
from loopgate.network.loop import LanePosition

OWN_M, SHARED_M = 200.0, 60.0
LAP_M = OWN_M + SHARED_M


def vehicle_at(name: str, front_m: float) -> FakeVehicle:
    """Return a vehicle on a loop with an edge for its own place and one for the shared place."""
    return FakeVehicle([(f"{name}p", OWN_M), (f"{name}s", SHARED_M)], front_m)


def track_of(name: str, front_m: float, *, own: str = "") -> Track:
    """Return the path of a vehicle: its `own` place, by default ``p`` and its name, and the place ``s``."""
    legs = (
        DrawnLeg(StateId(own or f"p{name}"), 0.0, 199.0, line=LanePosition(f"{name}p", 0, 199.0)),
        DrawnLeg(StateId("s"), 199.0, 260.0, line=LanePosition(f"{name}s", 0, 59.9)),
    )
    edges = ((0.0, f"{name}p"), (OWN_M, f"{name}s"))
    rounds = Round(f"{name}p", "round", "first"), Round(f"{name}s", "onward", "second")
    return Track(name, name, LAP_M, front_m, 10.0, rounds, edges, legs)


class SharedRoad:
    """Vehicles ``v0``, ``v1`` and so on, with their fronts there [m]; each place holds one."""

    def __init__(self, *starts_m: float) -> None:
        self.tracks = [track_of(f"v{k}", front_m) for k, front_m in enumerate(starts_m)]
        slots: dict[str, int] = {leg.state: 1 for track in self.tracks for leg in track.legs}
        self.traffic = FakeTraffic(
            {track.vehicle: vehicle_at(track.vehicle, track.front_m) for track in self.tracks}
        )
        layout = PlaceLayout(slots, [track.legs for track in self.tracks])
        self.driving = Driving(self.traffic, layout, Ledger(usual()))
        self.driving.take_in(self.tracks)

    @property
    def ledger(self) -> Ledger:
        """The ledger."""
        return self.driving.ledger

    def drive(self, until_s: float) -> None:
        """Drive until a time [s]."""
        while self.traffic.now_s < until_s:
            self.driving.step()

    def drive_to(self, event: str) -> Row:
        """Drive until something has happened; return when, to which vehicle, and where."""
        while not self.rows(event):
            self.driving.step()
            assert self.traffic.now_s < 1000.0
        return self.rows(event)[0]

    def rows(self, *events: str) -> Sequence[Row]:
        """Return what has happened of these kinds."""
        return [row for row in self.driving.rows if row[2] in events]

    def laps(self) -> list[int]:
        """Return how many laps each vehicle has driven."""
        return [diary.laps for diary in self.driving.diary_of.values()]
