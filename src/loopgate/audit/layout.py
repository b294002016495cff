"""What the abstraction says about the roads, written beside a run for the audit of positions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from loopgate.disk import writing
from loopgate.errors import ResultsError

__all__ = ["Layout", "Leg", "LoopWay", "Span", "VehicleBody", "read_layout", "write_layout"]

Stretch = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Span:
    """A lane of a loop: arc length [m] at its beginning and end, and the lanes a vehicle may be on there.

    The first of these is the one on which it leaves; `entered` names the one on which it comes, if that is
    another.
    """

    begin_m: float
    end_m: float
    lanes: tuple[str, ...]
    entered: str = ""

    @property
    def driven(self) -> tuple[str, ...]:
        """The lanes on which it comes and leaves, one or two."""
        return (self.entered, self.lanes[0]) if self.entered else self.lanes[:1]

    @property
    def internal(self) -> bool:
        """Whether it lies inside a junction."""
        return self.lanes[0].startswith(":")


@dataclass(frozen=True, slots=True)
class Leg:
    """A state on a loop, and the crossings behind it.

    Attributes
    ----------
    state
        Its name.
    begin_m, end_m
        Arc length on the loop [m].
    crossings
        For each movement from this state to the next, its foes, each with the arc lengths [m] on this loop
        between which the two can touch; None where a foe is in the way all along.
    """

    state: str
    begin_m: float
    end_m: float
    crossings: tuple[tuple[str, Mapping[str, Stretch | None]], ...] = ()


@dataclass(frozen=True, slots=True)
class LoopWay:
    """A loop: its length [m], its lanes and its states in driving order."""

    length_m: float
    spans: tuple[Span, ...]
    legs: tuple[Leg, ...]


@dataclass(frozen=True, slots=True)
class VehicleBody:
    """A vehicle: its loop, its size [m], and where it starts: arc length of its front, its leg."""

    loop: str
    length_m: float
    width_m: float
    start_m: float
    leg: int


@dataclass(frozen=True, slots=True)
class Layout:
    """States, crossings and vehicles of a run, in arc length on the loops.

    Attributes
    ----------
    step_s
        Length of a simulation step [s].
    room
        How many vehicles a shared state holds, by its name.
    loops, vehicles
        By name.
    movements
        The lanes inside the junction that each movement named in a crossing uses, in driving order.
    shapes
        Centre lines of lanes [m], by lane.
    heights
        How high lanes lie in the middle [m]; none where the network is flat.
    """

    step_s: float
    room: Mapping[str, int]
    loops: Mapping[str, LoopWay]
    vehicles: Mapping[str, VehicleBody]
    movements: Mapping[str, tuple[str, ...]]
    shapes: Mapping[str, tuple[tuple[float, float], ...]]
    heights: Mapping[str, float] = field(default_factory=dict)


def write_layout(layout: Layout, file: Path) -> None:
    """Write ``layout.json``; raise `ResultsError` if it cannot be written."""
    with writing(file):
        file.write_text(json.dumps(asdict(layout)) + "\n", encoding="utf-8")


def read_layout(file: Path) -> Layout:
    """Read ``layout.json``.

    Raises
    ------
    ResultsError
        If it cannot be read or is no layout.
    """
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        return Layout(
            step_s=data["step_s"],
            room=data["room"],
            loops={name: _loop(loop) for name, loop in data["loops"].items()},
            vehicles={name: VehicleBody(**body) for name, body in data["vehicles"].items()},
            movements={name: tuple(lanes) for name, lanes in data["movements"].items()},
            shapes={lane: tuple((x, y) for x, y in shape) for lane, shape in data["shapes"].items()},
            heights=data["heights"],
        )
    except OSError as error:
        msg = f"{file}: cannot read the layout ({error.strerror or error})"
        raise ResultsError(msg) from error
    except (ValueError, KeyError, TypeError) as error:
        msg = f"{file}: no layout of a run ({type(error).__name__}: {error})"
        raise ResultsError(msg) from error


def _loop(data: Mapping[str, Any]) -> LoopWay:
    return LoopWay(
        length_m=data["length_m"],
        spans=tuple(Span(s["begin_m"], s["end_m"], tuple(s["lanes"]), s["entered"]) for s in data["spans"]),
        legs=tuple(
            Leg(
                leg["state"],
                leg["begin_m"],
                leg["end_m"],
                tuple(
                    (movement, {foe: (s[0], s[1]) if s else None for foe, s in foes.items()})
                    for movement, foes in leg["crossings"]
                ),
            )
            for leg in data["legs"]
        ),
    )
