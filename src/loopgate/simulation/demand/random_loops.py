"""Random loops for a run: as many as were asked for and work, or as there are."""

from collections.abc import Sequence
from itertools import islice

from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.sharing import SharingBound
from loopgate.errors import LoopgateError, Refusal, RefusedLoopError
from loopgate.keeping import Kept
from loopgate.network import FoundLoops, Loop, RoadNetwork, find_loops
from loopgate.network.generate import LoopSearch
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.scenario import Scenario


def random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    """Find `count` loops for the scenario; on queues only loops that work there together.

    Raises
    ------
    RouteError
        If there is not a single one; the text says why.
    """
    if not network.content:
        return _random_loops(scenario, network, count)
    wanted = (scenario.abstraction, scenario.loop_length_m, scenario.loops_seed, scenario.u_turns)
    bound = (scenario.max_shared, scenario.rho_m)
    # Messages name the network as it was asked for.
    key = (network.content, network.name, count, *wanted, *bound)
    return _KEPT.get(key, lambda: _random_loops(scenario, network, count))


_KEPT: Kept[FoundLoops] = Kept(8)


def _random_loops(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    if scenario.abstraction == "queues":
        return _for_queues(scenario, network, count)
    sharing = SharingBound(network, scenario.max_shared, rho_m=scenario.rho_m)
    return find_loops(
        network,
        count,
        length_m=scenario.loop_length_m,
        seed=scenario.loops_seed,
        u_turns=scenario.u_turns,
        admits=sharing.admits if scenario.max_shared < 1.0 else None,
    )


def _for_queues(scenario: Scenario, network: RoadNetwork, count: int) -> FoundLoops:
    refused: list[str] = []

    def works(loop: Loop) -> bool:
        try:
            refusal = why_not(network, loop)
        except LoopgateError as error:
            refusal = Refusal(f"cannot be laid out: {error}")
        if refusal:
            refused.append(refusal.reason)
        return not refusal

    search = LoopSearch(
        network,
        count,
        length_m=scenario.loop_length_m,
        seed=scenario.loops_seed,
        u_turns=scenario.u_turns,
        admits=works,
    )
    loops = list(islice(search, count))
    spare = count
    while (error := _not_together(network, loops)) is not None:
        refused.append(error.refused[error.loop].reason)
        loops = [loop for loop in loops if loop.id != error.loop]
        # Each newcomer can keep others from working in its turn, so there is an end to trying.
        if spare:
            spare -= 1
            loops += islice(search, 1)
    return search.result(loops, count, dropped=_dropped(refused))


def _dropped(reasons: Sequence[str]) -> str:
    if len(reasons) > 1:
        return f"{len(reasons)} that do not work as queues, the last of which {reasons[-1]}"
    return f"1 that does not work as queues: it {reasons[0]}" if reasons else ""


def _not_together(network: RoadNetwork, loops: Sequence[Loop]) -> RefusedLoopError | None:
    """Return why one of the loops, each of which works alone, does not work beside the others.

    Where one loop changes lanes, or on the other lane of a narrow street, another loses places.
    """
    if not loops:
        return None
    try:
        lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops])
    except RefusedLoopError as error:
        return error
    return None
