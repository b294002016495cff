"""A vehicle at its start: what its file says of it, with its path, lane and time."""

from __future__ import annotations

import re
from dataclasses import dataclass
from zlib import crc32

from loopgate.abstraction.itinerary import Track, rounds_from
from loopgate.network import Loop, VehicleDemand, VehicleType
from loopgate.traffic.base import Insertion

_ROUNDING_M = 1e-6

_NO_NAME = re.compile(r"[^\w.#]")
"""What no name in SUMO may hold, and a colour may: commas and blanks."""

_OF_DEVICES = ("has.", "device.")
_OF_MODELS = ("carFollowModel.", "junctionModel.", "laneChangeModel.")
"""How names of parameters begin. While it runs, SUMO takes none of devices; those of models, plain text in
a file, are settings then."""


@dataclass(frozen=True, slots=True)
class VehicleStart:
    """A vehicle at its start.

    Attributes
    ----------
    demand
        The vehicle as its file has it.
    track
        Its path, from where it starts; without states if no gate drives it.
    lane
        Index of its lane; None for the lane of its loop.
    depart_s
        When it departs [s]; None for the beginning of the simulation.
    """

    demand: VehicleDemand
    track: Track
    lane: int | None = None
    depart_s: float | None = None

    @property
    def vehicle(self) -> str:
        """The name of the vehicle."""
        return self.demand.id

    @property
    def loop(self) -> Loop:
        """The loop or route that the vehicle drives."""
        return self.demand.loop

    @property
    def type(self) -> VehicleType:
        """The type of the vehicle."""
        return self.demand.type

    @property
    def place(self) -> str:
        """The state in which the vehicle starts, if a gate drives it."""
        return str(self.track.legs[self.track.position].state)

    @property
    def edge(self) -> int:
        """The index on the loop of the edge on which the vehicle starts."""
        at_m = self.track.start_m % self.loop.lap_m + _ROUNDING_M
        return max(
            number for number, span in enumerate(self.loop.roads) if not number or span.begin_m <= at_m
        )

    @property
    def position_m(self) -> float:
        """The position of the front on its lane [m]."""
        return self.loop.locate(self.track.start_m).position_m

    @property
    def lane_index(self) -> int:
        """The index of the lane on which the vehicle starts."""
        return self.loop.locate(self.track.start_m).lane if self.lane is None else self.lane

    @property
    def kind(self) -> str:
        """The name of the vehicle's type in SUMO."""
        loop = self.loop.id if self.loop.closed else ""
        name = f"{self.type.id}@{loop}" + (f"@{_NO_NAME.sub('_', self.colour)}" if self.colour else "")
        return f"{name}@{crc32(repr(self.devices).encode()):08x}" if self.devices else name

    @property
    def colour(self) -> str:
        """The colour that the vehicle's type has in SUMO, as the file says it; empty for the type's own."""
        return "" if self.depart_s is None else self.demand.attributes.get("color", "")

    @property
    def devices(self) -> dict[str, str]:
        """The parameters of devices that the vehicle's type has in SUMO, for it is put in while SUMO runs."""
        if self.depart_s is None:
            return {}
        said = self.demand.parameters
        return {name: value for name, value in sorted(said.items()) if name.startswith(_OF_DEVICES)}

    @property
    def route(self) -> str:
        """The name of the route on which the vehicle departs."""
        return f"from{self.edge}@{self.loop.id}"

    @property
    def insertion(self) -> Insertion:
        """The insertion of the vehicle as SUMO gets it."""
        said, known = self.demand.attributes, (*_OF_DEVICES, *_OF_MODELS)
        return Insertion(
            self.route,
            self.kind,
            self.lane_index,
            self.position_m,
            said,
            {name: value for name, value in self.demand.parameters.items() if not name.startswith(known)},
            rolling=not self.loop.closed and said.get("departSpeed", "max") != "0",
        )

    @property
    def edges(self) -> tuple[str, ...]:
        """The edges of the vehicle's first route in SUMO: more than one round of a loop, or an open route."""
        return rounds_from(self.loop, self.edge) if self.loop.closed else self.loop.edges[self.edge :]
