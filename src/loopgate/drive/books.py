"""The holders of states and crossings, by name: they outlive the tables when vehicles come and go.

Tables are made for the vehicles that there are. When some join or leave they are made anew, and what the
others hold, ask for and have done goes from the old ones into the new.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from loopgate.drive.driver import Driver
from loopgate.drive.tables import Tables, VehicleRow

__all__ = ["Books", "carry_over", "read_books", "write_books"]

_BY_TRACK: Final = frozenset(
    {"name", "loop", "lap_m", "road_at", "roads", "pivot", "leg_at", "legs", "number_at", "numbers"}
)
"""The columns that follow from a vehicle's track, and from where things are in the tables."""

_CARRIED: Final = tuple(name for name in VehicleRow.__annotations__ if name not in _BY_TRACK)

_OF_RUN: Final = (
    *("now_s", "version", "grants", "turn", "decided_s", "overruns", "trespasses", "decisions"),
    *("steps", "standing", "ended", "driven_m", "counts_from_s"),
    *("let_go", "stood", "stood_s", "on_red", "red_s", "red_since_s", "red_at", "looked_s"),
)


@dataclass(slots=True)
class Books:
    """Vehicles by name, in order.

    Attributes
    ----------
    holders
        By state, those that hold it, in the order in which they took it.
    lines
        By state, those whose last granted leg is in it, head first.
    passing
        By movement, those that are under way on it.
    aside
        Those that park and hold nothing.
    """

    holders: dict[str, list[str]]
    lines: dict[str, list[str]]
    passing: dict[str, list[str]]
    aside: list[str] = field(default_factory=list)

    @property
    def everybody(self) -> list[str]:
        """All vehicles, those of one state head first: in this order robots begin as the books say."""
        return [*(vehicle for line in self.lines.values() for vehicle in line), *self.aside]

    def strike(self, vehicles: Iterable[str]) -> None:
        """Take vehicles out: they hold nothing any longer."""
        gone = set(vehicles)
        for lists in (self.holders, self.lines, self.passing):
            for name, line in lists.items():
                lists[name] = [vehicle for vehicle in line if vehicle not in gone]
        self.aside = [vehicle for vehicle in self.aside if vehicle not in gone]

    def enter(self, vehicle: str, state: str, left_m: float, left: Callable[[str], float]) -> None:
        """Let a vehicle in, as far from the end of a state as it is [m]; `left` tells that of others."""
        for lists in (self.holders, self.lines):
            line = lists.setdefault(state, [])
            behind = [n for n, other in enumerate(line) if left(other) > left_m]
            line.insert(behind[0] if behind else len(line), vehicle)


def read_books(
    tables: Tables, drivers: Sequence[Driver], states: Sequence[str], movements: Sequence[str]
) -> Books:
    """Return what the tables say of these states and movements."""
    names = [driver.id for driver in drivers]

    def of(row: Any, begin: str, length: str) -> list[str]:  # noqa: ANN401  a row
        return [names[robot] for robot in tables.lists[row[begin] :][: row[length]].tolist()]

    lines = {s: of(row, "line", "queue") for s, row in zip(states, tables.states, strict=True)}
    standing = {vehicle for line in lines.values() for vehicle in line}
    return Books(
        {s: of(row, "holders", "held_by") for s, row in zip(states, tables.states, strict=True)},
        lines,
        {m: of(row, "passing", "under_way") for m, row in zip(movements, tables.moves, strict=True)},
        [name for name in names if name not in standing],
    )


def write_books(
    books: Books, tables: Tables, drivers: Sequence[Driver], states: Sequence[str], movements: Sequence[str]
) -> None:
    """Let the tables say it; they are for these drivers, states and movements."""
    robots = {driver.id: driver.robot for driver in drivers}

    def to(row: Any, begin: str, length: str, line: Sequence[str]) -> None:  # noqa: ANN401  a row
        row[length] = len(line)
        tables.lists[row[begin] : row[begin] + len(line)] = [robots[vehicle] for vehicle in line]

    for state, row in zip(states, tables.states, strict=True):
        to(row, "holders", "held_by", books.holders.get(state, ()))
        to(row, "line", "queue", books.lines.get(state, ()))
    for movement, move in zip(movements, tables.moves, strict=True):
        to(move, "passing", "under_way", books.passing.get(movement, ()))


def carry_over(old: Tables, new: Tables, robots: Mapping[int, int]) -> None:
    """Let vehicles be in the new tables as they were in the old ones, on the same legs.

    Parameters
    ----------
    old, new
        The tables.
    robots
        Number in the new ones by number in the old ones.
    """
    for name in _OF_RUN:
        _row(new.run)[name] = _row(old.run)[name]
    _row(new.run)["version"] += 1
    _column(new.reasons)["refused"] = _column(old.reasons)["refused"]
    before, now = list(robots), list(robots.values())
    was, one = _column(old.vehicles), _column(new.vehicles)
    for name in _CARRIED:
        one[name][now] = was[name][before]
    names = ("crossed", "granted", "numbers", "number_at")
    columns = *(was[name][before] for name in names), one["numbers"][now], one["number_at"][now]
    for crossed, granted, most, begin, room, to in zip(*(c.tolist() for c in columns), strict=True):
        for leg in range(crossed, granted + 1 if room else crossed):  # none without a gate
            new.lists[to + leg % room] = old.lists[begin + leg % most]
    waiting = _column(old.entries)["waiting"][: _row(old.run)["waiting"]].tolist()
    still = [robots[robot] for robot in waiting if robot in robots]
    _column(new.entries)["waiting"][: len(still)] = still
    _row(new.run)["waiting"] = len(still)


def _row(table: Any) -> Any:  # noqa: ANN401  the one row of a table
    return table[0]


def _column(table: Any) -> Any:  # noqa: ANN401  a table, by column
    return table
