"""Finds random loops for a run."""

from collections.abc import Callable, Sequence
from itertools import islice
from typing import Unpack

from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.sharing import SharingBound
from loopgate.cache import Cache
from loopgate.errors import LoopgateError, Refusal, RefusedLoopError
from loopgate.network import FoundLoops, Loop, RoadNetwork, VehicleType, find_loops
from loopgate.network.generate import LoopOptions, LoopSearch
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.scenario import Scenario


def random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    """Find `count` random loops for a scenario; with queues, only loops that can all be cut together.

    Raises
    ------
    RouteError
        If there is not a single loop; the text says why.
    """
    if not network.content:
        return _random_loops(scenario, network, count)
    wanted = (scenario.abstraction, scenario.loop_length_m, scenario.loops_seed, scenario.u_turns)
    bound = (scenario.max_shared, scenario.rho_m)
    # Messages name the network as it was asked for.
    key = (network.content, network.name, count, *wanted, *bound)
    return _KEPT.get(key, lambda: _random_loops(scenario, network, count))


_KEPT: Cache[FoundLoops] = Cache(8)


def _random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    if scenario.abstraction == "queues":
        return loops_for_queues(
            network,
            count,
            length_m=scenario.loop_length_m,
            seed=scenario.loops_seed,
            u_turns=scenario.u_turns,
        )
    sharing = SharingBound(network, scenario.max_shared, rho_m=scenario.rho_m)
    return find_loops(
        network,
        count,
        length_m=scenario.loop_length_m,
        seed=scenario.loops_seed,
        u_turns=scenario.u_turns,
        admits=sharing.admits if scenario.max_shared < 1.0 else None,
    )


def loops_for_queues(
    network: RoadNetwork,
    count: int,
    *,
    kind: VehicleType = DEFAULT_TYPE,
    progress: Callable[[int], None] | None = None,
    **options: Unpack[LoopOptions],
) -> FoundLoops:
    """Find `count` loops that can be cut into queues for vehicles of a type `kind`, also all together.

    Raises
    ------
    RouteError
        If there is not a single loop; the text says why.
    """
    refused: list[str] = []

    def works(loop: Loop) -> bool:
        try:
            refusal = why_not(network, loop, kind)
        except LoopgateError as error:
            refusal = Refusal(f"cannot be laid out: {error}")
        if refusal:
            refused.append(refusal.reason)
        return not refusal

    wishes: LoopOptions = {**options, "admits": works}
    search = LoopSearch(network, count, **wishes)
    loops: list[Loop] = []
    for loop in islice(search, count):
        loops.append(loop)
        if progress:
            progress(len(loops))
    spare = count
    while (error := _not_together(network, loops, kind)) is not None:
        refused.append(error.refused[error.loop].reason)
        loops = [loop for loop in loops if loop.id != error.loop]
        # Each new loop can make other loops fail in turn, so the number of tries is limited.
        if spare:
            spare -= 1
            loops += islice(search, 1)
    return search.result(loops, count, dropped=_dropped(refused))


def _dropped(reasons: Sequence[str]) -> str:
    if len(reasons) > 1:
        return f"{len(reasons)} that do not work as queues, the last of which {reasons[-1]}"
    return f"1 that does not work as queues: it {reasons[0]}" if reasons else ""


def _not_together(network: RoadNetwork, loops: Sequence[Loop], kind: VehicleType) -> RefusedLoopError | None:
    """Return the error for a loop that can be cut into queues alone, but not with the other loops.

    A loop that changes lanes, or uses the other lane of a narrow street, can take places from another loop.
    """
    if not loops:
        return None
    try:
        lay_out_queues(network, [(loop, kind) for loop in loops])
    except RefusedLoopError as error:
        return error
    return None
