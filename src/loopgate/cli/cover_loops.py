"""`loopgate loops --cover`: loops that cover streets, and their figures."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from loopgate.abstraction.covering import Cover, cover_streets
from loopgate.abstraction.queue_layout import lay_out_queues
from loopgate.cli.loops import LoopsWish
from loopgate.cli.terminal import show_progress
from loopgate.errors import RouteError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType
from loopgate.network.cover.design import CoverTask
from loopgate.network.cover.parts import MOST_BYTES, MOST_STREETS, parts, search_bytes
from loopgate.network.cover.watch import Patrol, allot, even_starts_m, laps_s, patrol, vehicles_needed
from loopgate.network.cover.wishes import read_districts, read_streets, read_weights
from loopgate.network.road import both_ways
from loopgate.network.routes_text import routes_text
from loopgate.network.vehicle_type import type_of_class
from loopgate.reading import counted, listed


def read_driven(network: RoadNetwork, given: str, vclass: str) -> frozenset[str]:
    """Return the edges that were driven: visited in a run, or named as for ``--cover``.

    Raises `RouteError` if no edge was driven, or an edge is not in the network; `ResultsError` if the folder
    is no run folder.
    """
    if not Path(given).is_dir():
        return frozenset(read_streets(network, given, vclass, option="--driven"))
    from loopgate.results import columns
    from loopgate.runs.run import read_run

    run = read_run(given)
    table = run.edges if run.streets is None else run.streets
    seen = frozenset(map(str, table.loc[table[columns.VISITS] > 0, columns.EDGE]))
    missing = next((edge for edge in sorted(seen) if edge not in network.edges), None)
    if missing is not None:
        msg = f"--driven {given}: edge {missing} is not in {network.name}; the run was on another network"
        raise RouteError(msg)
    if not seen:
        msg = f"--driven {given}: the run visited no street; leave --driven out"
        raise RouteError(msg)
    return seen


def streets_left(
    network: RoadNetwork,
    wanted: Sequence[str],
    driven: frozenset[str],
    *,
    either_way: bool,
    both_sides: Sequence[str] = (),
) -> list[str]:
    """Return the wanted edges that were not driven.

    With `either_way` an edge counts as driven if its opposite was, except on streets of `both_sides`.

    Raises `RouteError` if no street is left.
    """
    done = set(driven)
    if either_way:
        every = tuple(dict.fromkeys((*wanted, *sorted(driven))))
        for street in both_ways(network, every, both_sides):
            if driven & set(street):
                done.update(street)
    left = [edge for edge in wanted if edge not in done]
    if wanted and not left:
        msg = f"{network.name}: every street to be covered was driven already; no street is left"
        raise RouteError(msg)
    return left


_EXAMPLES, _ROUNDING = 3, 1e-6


@dataclass(frozen=True, slots=True)
class _Group:
    """Streets that get loops of their own."""

    edges: tuple[str, ...]
    weight: float
    district: str
    """Name of the district; empty without districts."""
    depots: tuple[str, ...]
    around: frozenset[str] | None = None
    """Edges that the loops may use; all edges if None."""

    def named(self, *, by_weight: bool) -> str:
        """Return the beginning of the names of loops."""
        words = [re.sub(r"[^\w-]", "_", self.district)] if self.district else []
        words += [f"weight{self.weight:g}"] if by_weight else []
        return ".".join(words) + "." if words else "loop"

    def said(self, *, by_weight: bool) -> str:
        """Return the beginning of a line about the group."""
        words = [self.district] if self.district else []
        words += [f"weight {self.weight:g}"] if by_weight else []
        return ", ".join(words) + ": " if words else ""


@dataclass(frozen=True, slots=True)
class _Made:
    """Covers of groups of streets, in each district the heaviest first, and the vehicles on their loops."""

    covers: tuple[Cover, ...]
    groups: tuple[_Group, ...]
    patrol: Patrol

    @property
    def weights(self) -> list[float]:
        return [group.weight for group in self.groups]

    @property
    def loops(self) -> list[Loop]:
        return [loop for cover in self.covers for loop in cover.loops]


def cover_loops(wish: LoopsWish) -> None:
    """Make loops that cover streets, write them, and print their figures."""
    roads = wish.roads()
    kind = type_of_class(wish.vclass, "--vclass")
    covers, groups = _covers(roads, wish, kind)
    weights = [group.weight for group in groups]
    loops = [loop for cover in covers for loop in cover.loops]
    if len(covers) > 1:
        lay_out_queues(roads, [(loop, kind) for loop in loops])
    heavy = [weight for cover, weight in zip(covers, weights, strict=True) for _ in cover.loops]
    laps = [lap * weight for lap, weight in zip(laps_s(roads, loops), heavy, strict=True)]
    if wish.revisit_s is not None:
        number = vehicles_needed([lap * wish.margin for lap in laps], wish.revisit_s)
    else:
        number = allot(laps, wish.vehicles or len(loops))
    made = _Made(tuple(covers), tuple(groups), patrol(roads, loops, number))
    text = routes_text(loops, note=_note(wish), vehicles=_vehicles(roads, made, wish, kind))
    wish.put_out(text, _data(made))
    if wish.export is not None:
        from loopgate.export import export_loops

        left_out = {edge: str(why) for cover in covers for edge, why in cover.left_out.items()}
        export_loops(roads, loops, wish.export, left_out=left_out)
    if wish.plot is not None:
        from loopgate.report.network_map import draw_map

        left = [edge for cover in covers for edge in cover.left_out]
        title = f"{roads.name}: {counted(len(loops), 'loop')}, {_km(loops):.1f} km"
        draw_map(roads, loops, (), wish.plot, title=title, unwatched=left)
    for line in _report(roads, made, wish):
        click.echo(line, err=wish.out is None or wish.as_json)


def _covers(roads: RoadNetwork, wish: LoopsWish, kind: VehicleType) -> tuple[list[Cover], list[_Group]]:
    task = CoverTask(
        vclass=wish.vclass,
        u_turns=wish.u_turns,
        either_way=wish.either_way,
        both_sides=_both_sides(roads, wish),
        by_time=wish.revisit_s is not None or wish.shift_min is not None,
    )
    if wish.max_length_m is not None:
        task = replace(task, longest=wish.max_length_m)
    if wish.shift_min is not None:
        task = replace(task, longest=wish.shift_min * 60.0 / wish.margin)
    groups = [part for group in _groups(roads, wish) for part in _in_parts(roads, wish, task, group)]
    by_weight = len({group.weight for group in groups}) > 1
    covers = []
    whole = max(sum(len(group.edges) * group.weight for group in groups), 1.0)
    for group in groups:
        share = len(group.edges) * group.weight / whole
        with show_progress("rounds of search") as report:
            cover = cover_streets(
                roads,
                replace(task, edges=group.edges, depots=group.depots, around=group.around),
                max(1, round((wish.count or 1) * share)),
                kind=kind,
                seed=wish.seed,
                name=group.named(by_weight=by_weight),
                progress=report,
            )
        covers.append(cover)
    return covers, groups


def _in_parts(roads: RoadNetwork, wish: LoopsWish, task: CoverTask, group: _Group) -> Iterator[_Group]:
    """Yield the group, or its parts if it has more streets than one search takes in a short time."""
    task = replace(task, edges=group.edges, depots=group.depots)
    found = parts(roads, task, wish.count or 1)
    most, enough = max(len(part.edges) for part in found), math.ceil(len(group.edges) / MOST_STREETS)
    if (needed := search_bytes(most)) > MOST_BYTES:
        msg = (
            f"{roads.name}: {counted(most, 'street')} at once need {needed / 1e9:.0f} GB of memory and "
            f"hours; --count {enough} or more covers them part by part, --by-district district by district"
        )
        raise RouteError(msg)
    if len(found) == 1:
        if most > 2 * MOST_STREETS:
            said = (
                f"{counted(most, 'street')} at once take long; --count {enough} or more covers parts of them"
            )
            click.echo(said, err=True)
        yield group
    else:
        said = f"{counted(len(group.edges), 'street')}: covered in {len(found)} parts, one after the other"
        click.echo(said, err=wish.out is None or wish.as_json)
        for number, part in enumerate(found, 1):
            name = f"{group.district} part {number}".strip()
            # A depot may lie far away: then loops may leave the part.
            around = None if group.depots else part.around
            yield replace(group, edges=part.edges, district=name, around=around)


def _groups(roads: RoadNetwork, wish: LoopsWish) -> list[_Group]:
    every: Sequence[str] = [edge.id for edge in roads.edges.values() if edge.allows(wish.vclass)]
    if wish.cover is not None and wish.cover != "all":
        every = read_streets(roads, wish.cover, wish.vclass, option="--cover")
    if wish.driven is not None:
        driven, wanted = read_driven(roads, wish.driven, wish.vclass), every
        both = _both_sides(roads, wish)
        every = streets_left(roads, every, driven, either_way=wish.either_way, both_sides=both)
        left = f"{len(every)} of {counted(len(wanted), 'street')} left; the others were driven already"
        click.echo(left, err=wish.out is None or wish.as_json)
    weights = read_weights(roads, wish.weights) if wish.weights else {}
    depots = (
        ()
        if wish.start is None
        else read_streets(roads, wish.start, wish.vclass, option="--start", u_turns=wish.u_turns)
    )
    groups = []
    for district, inside, own in _districts(roads, wish, every, depots):
        classes: dict[float, list[str]] = {} if inside else {1.0: []}  # what is wrong is said by the design
        for edge in inside:
            classes.setdefault(weights.get(edge, 1.0), []).append(edge)
        groups += [_Group(tuple(classes[w]), w, district, own) for w in sorted(classes, reverse=True)]
    return groups


def _districts(
    roads: RoadNetwork, wish: LoopsWish, every: Sequence[str], depots: tuple[str, ...]
) -> Iterator[tuple[str, list[str], tuple[str, ...]]]:
    """Yield each district with streets to be covered: its name, these streets, and its depots.

    A street in two districts belongs to the first. Raises `RouteError` for a district without a depot.
    """
    if wish.by_district is None:
        yield "", list(every), depots
        return
    left = dict.fromkeys(every)
    for district, edges in read_districts(roads, wish.by_district, (wish.vclass,)).items():
        inside = [edge for edge in edges if edge in left]
        own = tuple(depot for depot in depots if depot in edges)
        if depots and inside and not own:
            msg = f"{wish.by_district}: no depot of --start lies in {district}; name an edge in it"
            raise RouteError(msg)
        for edge in inside:
            del left[edge]
        if inside:
            yield district, inside, own
    if len(left) == len(every):
        msg = f"{wish.by_district}: no street to be covered lies in any district; draw them over the streets"
        raise RouteError(msg)
    if left:
        outside = f"{counted(len(left), 'street')} in no district: not covered"
        click.echo(outside, err=wish.out is None or wish.as_json)


def _both_sides(roads: RoadNetwork, wish: LoopsWish) -> tuple[str, ...]:
    if wish.both_sides is None:
        return ()
    return read_streets(roads, wish.both_sides, wish.vclass, option="--both-sides")


def _too_long(covers: Sequence[Cover]) -> list[str]:
    """Return a warning for each loop that is longer than asked for."""
    found = []
    for cover in covers:
        task = cover.design.task
        unit = "s at the speed limits" if task.by_time else "m"
        found += [
            f"{loop.id} takes {cost:.0f} {unit}, more than the {task.longest:.0f} allowed"
            for loop, cost in zip(cover.loops, cover.costs, strict=True)
            if cost > task.longest * (1.0 + _ROUNDING)
        ]
    return found


def _vehicles(roads: RoadNetwork, made: _Made, wish: LoopsWish, kind: VehicleType) -> list[VehicleDemand]:
    """Return the vehicles to write; without a number one per loop if the file must name their class."""
    if wish.vehicles is None and wish.revisit_s is None and wish.vclass == VehicleType().vclass:
        return []
    return [
        VehicleDemand(f"{loop.id}.{k}", loop, kind, at)
        for loop, number in zip(made.loops, made.patrol.vehicles, strict=True)
        for k, at in enumerate(even_starts_m(roads, loop, number))
    ]


def _note(wish: LoopsWish) -> str:
    said = {
        "count": wish.count or 1,
        "max-length": wish.max_length_m,
        "shift": wish.shift_min,
        "driven": wish.driven,
        "either-way": wish.either_way or None,
        "both-sides": wish.both_sides,
        "by-district": wish.by_district,
        "vclass": wish.vclass,
        "u-turns": wish.u_turns or None,
        "avoid": wish.avoid,
        "start": wish.start,
        "weights": wish.weights,
        "vehicles": wish.vehicles,
        "revisit": wish.revisit_s,
        "margin": wish.margin if wish.revisit_s is not None or wish.shift_min is not None else None,
        "seed": wish.seed,
    }
    options = ", ".join(f"{name} {value}" for name, value in said.items() if value is not None)
    return f"loopgate loops {wish.network}: cover {wish.cover}, {options}"


def _km(loops: Sequence[Loop]) -> float:
    return sum(loop.length_m for loop in loops) / 1000.0


def _twice(roads: RoadNetwork, loops: Sequence[Loop]) -> float:
    """Return the share of the length that repeats streets."""
    visits = Counter(edge for loop in loops for edge in loop.edges)
    driven = sum(number * roads.edges[edge].length_m for edge, number in visits.items())
    return 1.0 - sum(roads.edges[edge].length_m for edge in visits) / driven


def _report(roads: RoadNetwork, made: _Made, wish: LoopsWish) -> Iterator[str]:
    if wish.out is not None:
        yield f"{counted(len(made.loops), 'loop')}, {_km(made.loops):.1f} km in all, written to {wish.out}"
    by_weight = len(set(made.weights)) > 1
    for cover, group in zip(made.covers, made.groups, strict=True):
        yield from _of_cover(roads, cover, group.said(by_weight=by_weight))
    for warning in _too_long(made.covers):
        yield f"warning: {warning}"
    yield from _of_patrol(made, wish)


def _of_cover(roads: RoadNetwork, cover: Cover, begin: str) -> Iterator[str]:
    design, loops = cover.design, cover.loops
    streets = len(cover.covered) + len(cover.left_out)
    if not cover.finished:
        yield f"{begin}interrupted: these are the best loops found so far"
    yield (
        f"{begin}{len(cover.covered)} of {counted(streets, 'street')} covered by {_km(loops):.2f} km, "
        f"{_twice(roads, loops):.1%} of the length repeats streets"
    )
    laps = laps_s(roads, loops) if design.task.by_time else [loop.length_m for loop in loops]
    unit = "s" if design.task.by_time else "m"
    bound = design.bound(len(loops))
    yield (
        f"{begin}in all {sum(laps):.0f} {unit}, {sum(laps) / design.circulation - 1.0:.1%} over the least "
        f"({design.circulation:.0f} {unit}); longest loop {max(laps):.0f} {unit}, "
        f"{max(laps) / bound - 1.0:.1%} over its least ({bound:.0f} {unit}); shortest {min(laps):.0f} {unit}"
    )
    reasons: dict[str, list[str]] = {}
    for edge, reason in cover.left_out.items():
        reasons.setdefault(str(reason), []).append(edge)
    for why, edges in sorted(reasons.items(), key=lambda item: -len(item[1])):
        yield f"{begin}not covered: {len(edges)}: {why}: {listed(edges, _EXAMPLES)}"


def _of_patrol(made: _Made, wish: LoopsWish) -> Iterator[str]:
    found = made.patrol
    rarest = max(found.intervals_s, key=lambda edge: found.intervals_s[edge])
    mean = sum(found.intervals_s.values()) / len(found.intervals_s)
    number = counted(sum(found.vehicles), "vehicle")
    if wish.revisit_s is not None:
        heavy = [w for cover, w in zip(made.covers, made.weights, strict=True) for _ in cover.loops]
        laps = [lap * weight for lap, weight in zip(found.laps_s, heavy, strict=True)]
        least = sum(vehicles_needed(laps, wish.revisit_s))
        yield (
            f"to see every street every {wish.revisit_s:g} s: {counted(least, 'vehicle')} at the speeds "
            f"allowed, "
            f"{sum(found.vehicles)} where laps take {wish.margin:g} times as long"
        )
    yield (
        f"with {number}, evenly spaced and at the speeds allowed, streets are seen every {mean:.0f} s on "
        f"average; "
        f"the rarest, {rarest}, every {found.intervals_s[rarest]:.0f} s"
    )


def _data(made: _Made) -> dict[str, Any]:
    found = made.patrol
    return {
        "loops": [
            {
                "id": loop.id,
                "length_m": round(loop.length_m, 2),
                "lap_s": round(lap, 2),
                "vehicles": number,
                "edges": loop.edges,
            }
            for loop, lap, number in zip(made.loops, found.laps_s, found.vehicles, strict=True)
        ],
        "covers": [
            {
                "weight": group.weight,
                "district": group.district,
                "streets": len(cover.covered) + len(cover.left_out),
                "covered": len(cover.covered),
                "least_in_all": round(cover.design.circulation, 2),
                "least_longest": round(cover.design.bound(len(cover.loops)), 2),
                "unit": "s" if cover.design.task.by_time else "m",
                "finished": cover.finished,
                "not_covered": {edge: str(reason) for edge, reason in cover.left_out.items()},
            }
            for cover, group in zip(made.covers, made.groups, strict=True)
        ],
        "intervals_s": {edge: round(interval, 2) for edge, interval in found.intervals_s.items()},
        "warnings": _too_long(made.covers),
    }
