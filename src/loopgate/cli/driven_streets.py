"""Streets that were driven already: from a run folder, or from a list of streets."""

from collections.abc import Sequence
from pathlib import Path

from loopgate.errors import RouteError
from loopgate.network import RoadNetwork
from loopgate.network.cover.wishes import read_streets
from loopgate.network.streets import both_ways


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
