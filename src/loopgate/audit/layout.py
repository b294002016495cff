"""The abstraction's view of the roads, written beside a run for the audit of positions."""

from __future__ import annotations

import hashlib
import json
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loopgate.disk import writing
from loopgate.errors import ResultsError
from loopgate.model.system import LARGEST_CAPACITY
from loopgate.network.bridges import Bridge
from loopgate.reading import of_kind, read_object, refusing, shown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_LARGEST_M = 1e9
_SHORTEST_LOOP_M = 0.1
_LONGEST_LOOP_M = 1e6  # bodies are drawn every half metre
_MOST_LAPS = 10.0
"""Arc lengths may be counted on, beyond the end of a loop; not farther than so many rounds."""
_WIDEST_M = 100.0
_FEWEST_POINTS = 2

Stretch = tuple[float, float]


@dataclass(frozen=True, slots=True)
class LoopSpan:
    """A lane of a loop: arc length [m] at its beginning and end, and the lanes a vehicle may be on there.

    The first of these lanes is the lane on which the vehicle leaves. `entered` is the lane on which it comes,
    if that is another lane.
    """

    begin_m: float
    end_m: float
    lanes: tuple[str, ...]
    entered: str = ""

    @property
    def driven(self) -> tuple[str, ...]:
        """The lanes on which the vehicle comes and leaves: one or two lanes."""
        return (self.entered, self.lanes[0]) if self.entered else self.lanes[:1]

    @property
    def internal(self) -> bool:
        """Whether the lane lies inside a junction."""
        return self.lanes[0].startswith(":")


@dataclass(frozen=True, slots=True)
class SizedStretches:
    """The stretches of a movement that a foe shares, by the lengths of the two vehicles.

    `sizes`: lengths, ascending [m]; a vehicle counts as the next longer one. `among`: by the length on the
    movement, then by that of the foe; None where the two can touch nowhere.
    """

    sizes: tuple[float, ...]
    among: tuple[tuple[Stretch | None, ...], ...]

    def size_of(self, length_m: float) -> int:
        """Return the index of the size as which a vehicle counts."""
        return min(bisect_left(self.sizes, length_m), len(self.sizes) - 1)


@dataclass(frozen=True, slots=True)
class LoopLeg:
    """A state on a loop, and the crossings behind it."""

    state: str
    begin_m: float
    end_m: float
    """`begin_m` and `end_m`: arc lengths on the loop [m] between which the state lies."""
    crossings: tuple[tuple[str, Mapping[str, Stretch | None]], ...] = ()
    """For each movement to the next state its foes, each with the arc lengths [m] on this loop between which
    the two can touch; None if they can touch everywhere."""
    sized: Mapping[str, Mapping[str, SizedStretches]] = field(default_factory=dict)
    """By movement and foe, where the stretch depends on the lengths of the two vehicles."""

    def shared(
        self, movement: str, foe: str, length_m: float, foe_length_m: float
    ) -> Iterator[Stretch | None]:
        """Yield the stretch that vehicles of two lengths share, as in `crossings`; nothing if they do not."""
        foes = dict(self.crossings).get(movement, {})
        sized = self.sized.get(movement, {}).get(foe)
        if sized is None:
            if foe in foes:
                yield foes[foe]
            return
        stretch = sized.among[sized.size_of(length_m)][sized.size_of(foe_length_m)]
        if stretch is not None:
            yield stretch


@dataclass(frozen=True, slots=True)
class LoopWay:
    """A loop: its length [m], its lanes and its states in driving order."""

    length_m: float
    spans: tuple[LoopSpan, ...]
    legs: tuple[LoopLeg, ...]


@dataclass(frozen=True, slots=True)
class VehicleBody:
    """A vehicle: its loop, its size [m], and its start: arc length of its front [m], and its leg.

    One that is `jointed` bends where lanes meet.
    """

    loop: str
    length_m: float
    width_m: float
    start_m: float
    leg: int
    jointed: bool = False
    gap_m: float = 0.0
    """Its gap to the vehicle ahead when it stands [m]."""

    @property
    def needed_m(self) -> float:
        """The length that it takes in a queue [m]."""
        return self.length_m + self.gap_m


@dataclass(frozen=True, slots=True)
class Layout:
    """The states and crossings of a run, and its vehicles, in arc length on the loops."""

    step_s: float
    room: Mapping[str, int]
    """Capacity of each shared state, by its name."""
    loops: Mapping[str, LoopWay]
    vehicles: Mapping[str, VehicleBody]
    movements: Mapping[str, tuple[str, ...]]
    """The internal lanes of each movement that is in a crossing, in driving order, by the movement's name."""
    shapes: Mapping[str, tuple[tuple[float, float], ...]]
    """Centre lines of lanes [m], by lane."""
    heights: Mapping[str, float] = field(default_factory=dict)
    """Mean height of each lane [m]; empty if the network is flat."""
    unregulated: tuple[str, ...] = ()
    """Lanes that lead to a junction without right of way, inside which SUMO does not keep vehicles apart."""
    bridges: tuple[Bridge, ...] = ()
    """Where lanes without heights lie one above the other."""
    metres: Mapping[str, float] = field(default_factory=dict)
    """The length of the states that hold more than their capacity while the vehicles fit with their gaps [m].
    """


def write_layout(layout: Layout, file: Path) -> None:
    """Write a layout as ``layout.json``; raise `ResultsError` if that fails.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate.audit import Layout, read_layout, write_layout
    >>> layout = Layout(step_s=1.0, room={"s": 2}, loops={}, vehicles={}, movements={}, shapes={})
    >>> write_layout(layout, Path("layout.json"))
    >>> read_layout(Path("layout.json")) == layout
    True
    """
    with writing(file):
        file.write_text(json.dumps(layout, default=_by_field) + "\n", encoding="utf-8")


def ground_key(layout: Layout) -> str:
    """Return a hash of the loops, the lanes and the sizes of vehicles, whichever vehicle starts where."""
    sizes = sorted({(v.loop, v.length_m, v.width_m, v.jointed) for v in layout.vehicles.values()})
    content = (layout.loops, sizes, layout.shapes, layout.heights, layout.unregulated, layout.bridges)
    return hashlib.sha256(json.dumps(content, default=_by_field).encode()).hexdigest()


def _by_field(part: DataclassInstance) -> dict[str, Any]:
    """Return a part of a layout as the object that is written; ``asdict`` would copy all that is in it."""
    return {one.name: getattr(part, one.name) for one in fields(part)}


def read_layout(file: Path) -> Layout:
    """Read a layout from a file ``layout.json``.

    Raises `ResultsError` if it cannot be read or is no layout.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate import Scenario, run
    >>> from loopgate.audit import read_layout
    >>> roads = {"network": "networks/ring3.net.xml", "routes": "routes/ring3.rou.xml"}
    >>> made = run(Scenario(**roads, duration_s=60), "out/laid")
    >>> layout = read_layout(Path("out/laid/layout.json"))
    >>> layout.vehicles["v1"].loop, layout.vehicles["v1"].length_m
    ('loop1', 5.0)
    """
    data = read_object(file, "layout of a run", ResultsError)
    with refusing(file, "layout of a run", ResultsError, wrong="no layout of a run"):
        layout = Layout(
            step_s=_number(data["step_s"]),
            room={state: _room(room) for state, room in data["room"].items()},
            loops={_text(name): _loop(loop) for name, loop in data["loops"].items()},
            vehicles={_text(name): _body(body) for name, body in data["vehicles"].items()},
            movements={name: tuple(map(_text, lanes)) for name, lanes in data["movements"].items()},
            shapes={
                lane: tuple((_number(x), _number(y)) for x, y in shape)
                for lane, shape in data["shapes"].items()
            },
            heights={lane: _number(height) for lane, height in data["heights"].items()},
            unregulated=tuple(map(_text, data["unregulated"])),
            bridges=tuple(map(_bridge, data.get("bridges", ()))),
            metres={_text(state): _number(length_m) for state, length_m in data.get("metres", {}).items()},
        )
        _check(layout)
        return layout


def _check(layout: Layout) -> None:
    """Raise ValueError if a part names something missing, or lies far off its loop."""
    if not 0.0 < layout.step_s <= _LARGEST_M:
        msg = f"its step takes {layout.step_s} s"
        raise ValueError(msg)
    for name, body in layout.vehicles.items():
        loop = layout.loops.get(body.loop)
        if loop is None or not 0 <= body.leg < len(loop.legs):
            msg = f"vehicle {name}: there is no leg {body.leg} on a loop {body.loop}"
            raise ValueError(msg)
        far = abs(body.start_m) > _MOST_LAPS * loop.length_m
        if far or not (0.0 < body.length_m <= loop.length_m and 0.0 < body.width_m <= _WIDEST_M):
            msg = f"vehicle {name}: {body.length_m} m by {body.width_m} m, it starts at {body.start_m} m"
            raise ValueError(msg)
    lanes: set[str] = set()
    for name, loop in layout.loops.items():
        if not (loop.spans and _SHORTEST_LOOP_M <= loop.length_m <= _LONGEST_LOOP_M):
            msg = f"loop {name}: it has {len(loop.spans)} lanes and is {loop.length_m:g} m long"
            raise ValueError(msg)
        parts: list[LoopSpan | LoopLeg] = [*loop.spans, *loop.legs]
        ends = [m for part in parts for m in (part.begin_m, part.end_m)]
        if max(map(abs, ends)) > _MOST_LAPS * loop.length_m:
            msg = f"loop {name}: it has parts that do not lie on it"
            raise ValueError(msg)
        driven = [lane for span in loop.spans for lane in span.driven]
        lanes |= set(driven)
        undrawn = [lane for lane in driven if len(layout.shapes.get(lane, ())) < _FEWEST_POINTS]
        if undrawn:
            msg = f"loop {name}: its lane {undrawn[0]} has no shape"
            raise ValueError(msg)
    strange = [lane for lane in layout.unregulated if lane not in lanes]
    if strange:
        msg = f"its lane {shown(strange[0])} is on no loop"
        raise ValueError(msg)


def _loop(data: Mapping[str, Any]) -> LoopWay:
    return LoopWay(
        length_m=_number(data["length_m"]),
        spans=tuple(
            LoopSpan(_number(s["begin_m"]), _number(s["end_m"]), _lanes(s["lanes"]), _text(s["entered"]))
            for s in data["spans"]
        ),
        legs=tuple(
            LoopLeg(
                _text(leg["state"]),
                _number(leg["begin_m"]),
                _number(leg["end_m"]),
                tuple(
                    (
                        _text(movement),
                        {foe: (_number(s[0]), _number(s[1])) if s else None for foe, s in foes.items()},
                    )
                    for movement, foes in leg["crossings"]
                ),
                {
                    _text(movement): {foe: _sized(table) for foe, table in foes.items()}
                    for movement, foes in leg.get("sized", {}).items()
                },
            )
            for leg in data["legs"]
        ),
    )


def _sized(data: Mapping[str, Any]) -> SizedStretches:
    sizes = tuple(map(_number, data["sizes"]))
    among = tuple(tuple((_number(s[0]), _number(s[1])) if s else None for s in row) for row in data["among"])
    if not sizes or {len(among), *map(len, among)} != {len(sizes)}:
        msg = f"stretches by length: {len(among)} rows for {len(sizes)} lengths"
        raise ValueError(msg)
    return SizedStretches(sizes, among)


def _body(data: Mapping[str, Any]) -> VehicleBody:
    return VehicleBody(
        loop=_text(data["loop"]),
        length_m=_number(data["length_m"]),
        width_m=_number(data["width_m"]),
        start_m=_number(data["start_m"]),
        leg=of_kind(int, data["leg"], "a leg", ValueError),
        jointed=of_kind(bool, data["jointed"], "jointed", ValueError),
        gap_m=_number(data.get("gap_m", 0.0)),
    )


def _bridge(data: Mapping[str, Any]) -> Bridge:
    return Bridge(_number(data["x_m"]), _number(data["y_m"]), _lanes(data["one"]), _lanes(data["other"]))


def _lanes(data: Iterable[object]) -> tuple[str, ...]:
    lanes = tuple(map(_text, data))
    if not lanes:
        msg = "a span or a bridge has no lane"
        raise ValueError(msg)
    return lanes


def _number(value: object) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _LARGEST_M:
        return value
    msg = f"{shown(value)} stands where a finite number is expected"
    raise ValueError(msg)


def _room(value: object) -> int:
    room = of_kind(int, value, "a capacity", ValueError)
    if 1 <= room <= LARGEST_CAPACITY:
        return room
    msg = f"a capacity is {shown(room)}; expected 1 to {LARGEST_CAPACITY}"
    raise ValueError(msg)


def _text(value: object) -> str:
    return of_kind(str, value, "a name", ValueError)
