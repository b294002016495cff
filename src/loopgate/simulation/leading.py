"""What leads vehicles other ways asks of what drives them: tables (`loopgate.drive`), or the ledger."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Protocol

from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Track


class Led(Protocol):
    """A vehicle that may be led another way. Its legs are numbered along its endless way."""

    @property
    def id(self) -> str:
        """Its name."""

    @property
    def track(self) -> Track:
        """Its way."""

    @property
    def granted(self) -> int:
        """The last leg granted to it."""

    @property
    def held(self) -> range:
        """The legs whose places it holds."""

    @property
    def crossed(self) -> range:
        """The legs behind whose lines its rear is not yet over the junction."""

    @property
    def settled(self) -> bool:
        """Whether it is in one place, and holds nothing else."""

    @property
    def speed_mps(self) -> float:
        """Its speed in the last step [m/s]."""

    @property
    def front_m(self) -> float:
        """Where its front was after the last step, in arc length that grows from lap to lap [m]."""

    @property
    def line_m(self) -> float:
        """Where the last granted leg ends [m]."""

    @property
    def stops_here(self) -> bool:
        """Whether it is to stop before it gets to the end of its last grant, or does."""

    def leg(self, number: int) -> Leg:
        """Return a leg of its way."""

    def left_m(self, state: str) -> float:
        """Return how far it is to the end of a place that it holds [m]."""


class Leads(Protocol):
    """What leads vehicles other ways: by the name of a vehicle, or of a place."""

    @property
    def driver_of(self) -> Mapping[str, Led]:
        """The vehicles."""

    @property
    def beside(self) -> Container[str]:
        """Those that hold no slot: they park, or are not back on the road yet."""

    @property
    def arrived(self) -> Container[str]:
        """Those that have arrived in the last step and are still known."""

    @property
    def changes(self) -> int:
        """How often vehicles have got other numbers, or others have come."""

    def knows(self, track: Track) -> bool:
        """Return whether a way is laid, so that vehicles can be led by it."""

    def line(self, place: str) -> Sequence[Led]:
        """Return the vehicles whose last grant is a place, first in line first."""

    def slots(self, place: str) -> int:
        """Return how many vehicles a place holds."""

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that one waits for: the first in its line, else those that block it."""

    def shut(self, place: str) -> None:
        """Let nobody into a place in the next step."""

    def withhold(self, vehicles: AbstractSet[str]) -> None:
        """Grant nothing to these from now on, and again to those that were named in the call before."""

    def turn_off(self, vehicle: str, track: Track, position: int) -> bool:
        """Lead a vehicle on by another way from its place on; return whether that can be done now.

        It can where it holds that place and nothing else, and where no circle of full places closes by it.
        `position`: of its place on that way.
        """

    @property
    def sets_aside(self) -> bool:
        """Whether vehicles can give up their slots while they stand beside the road."""

    def wait_for_nothing(self, vehicle: str) -> None:
        """Let a vehicle stand where it is and ask for nothing, held by nobody, until `wait_again`."""

    def wait_again(self, vehicle: str) -> None:
        """Let a vehicle ask in its turn again."""

    def step_aside(self, vehicle: str, why: str = "") -> bool:
        """Let a vehicle that parks give up its slot; return whether it does."""

    def call_back(self, vehicle: str) -> None:
        """Let a vehicle that waits for nothing drive on as soon as it is back on the road."""
