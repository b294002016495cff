"""What a gate over an owner's vehicles asks of what drives them: tables (`Fleet`), or the ledger."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.track import Track
from loopgate.simulation.drives import Answers, Drive, Record, Reports
from loopgate.simulation.leading import Leads, Led
from loopgate.traffic.base import Dynamics


class Member(Led, Protocol):
    """A vehicle under the gate."""

    @property
    def offset_m(self) -> float:
        """How much more that arc length is than what its odometer reads [m]."""

    @property
    def length_m(self) -> float:
        """Its length [m]."""

    @property
    def accel_mps2(self) -> float:
        """Its acceleration [m/s2]."""

    @property
    def decel_mps2(self) -> float:
        """Its deceleration [m/s2]."""

    @property
    def stop_m(self) -> float:
        """Where it stops next by itself [m]; infinity if it does not."""

    @property
    def halted(self) -> bool:
        """Whether it stands at the line at which it is held."""

    def drives_like(self, can: Dynamics, step_s: float) -> None:
        """Take over what it can do; one that is told to drive beyond any limit goes on so."""


class Members(Protocol):
    """The vehicles under a gate, which join and leave."""

    on_leaving: Callable[[Record], None]
    """Called with each vehicle that leaves, while it can still be asked."""

    @property
    def members(self) -> Mapping[str, Member]:
        """The vehicles, by name."""

    @property
    def drive(self) -> Drive:
        """What drives them."""

    @property
    def leads(self) -> Leads:
        """What leads them other ways."""

    @property
    def keeper(self) -> Answers:
        """What answers their requests."""

    @property
    def around(self) -> Reports:
        """What tells of lights and ordinary traffic."""

    @property
    def changes(self) -> int:
        """How often vehicles joined or left."""

    @property
    def settled(self) -> bool:
        """Whether every vehicle holds the place it is in and nothing else."""

    def drive_by(
        self, itineraries: Sequence[Itinerary], ways: Sequence[Track], room: Mapping[str, int]
    ) -> None:
        """Replace the itineraries and tracks of all vehicles, present and later; `room` is by place."""

    def take_in(self, tracks: Sequence[Track], *, beyond: int = 0) -> bool:
        """Take vehicles in together if places and gate allow it; return whether they do. `answer` follows."""

    def let_go(self, vehicles: set[str], reason: str) -> bool:
        """Let vehicles under the gate go; return whether there are any: then `answer` follows."""

    def after_step(self) -> None:
        """Do what is due after a step of the traffic."""

    def answer(self) -> None:
        """Answer the requests since somebody has come or gone."""

    def open_up(self) -> None:
        """Let vehicles into all places again that were shut."""

    def pause(self, *, pauses: bool) -> None:
        """Grant nothing to anybody for now, or grant again."""

    def stops_at(self, vehicle: str, at_m: float, *, anew: bool) -> None:
        """Note where a vehicle stops next by itself [m]; `anew`: it has made a stop, and asks as of now."""

    def mend_order(self) -> int:
        """Put the lines of all places in the order on the road; return how many were not in it."""
