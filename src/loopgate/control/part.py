"""What the drive tells each of its parts: which vehicles come, change to another path, and leave."""

from __future__ import annotations

from loopgate.abstraction.itinerary import Track
from loopgate.control.places import Vehicle


class Part:
    """A part of the drive, which may keep something of each vehicle; `Driving.parts` lists all."""

    def take_in(self, vehicle: Vehicle, track: Track) -> None:
        """Note a vehicle that has come, with its path."""

    def turned_off(self, vehicle: Vehicle, track: Track) -> None:
        """Note that a vehicle has changed to another path."""

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
