"""Reasons why loops are a bad fit for zones, in lines for the user."""

from collections.abc import Callable, Sequence

from loopgate.abstraction.zones import Zones
from loopgate.model import StateId
from loopgate.network.loop import Loop
from loopgate.reading import listed

_SWALLOWED = 0.5


def zone_warnings(loops: Sequence[Loop], zones: Zones, name: Callable[[int], StateId]) -> list[str]:
    """Warn of zones that swallow loops or most robots, loops without private road, and merges by Prop. 1.

    `name`: name of a zone's state.
    """
    metres: dict[int, dict[str, float]] = {}
    for loop, visits in zip(loops, zones.visits, strict=True):
        for visit in visits:
            of_zone = metres.setdefault(visit.zone, {})
            of_zone[loop.id] = of_zone.get(loop.id, 0.0) + visit.length_m
    laps = {loop.id: loop.length_m for loop in loops}
    found = []
    for zone, by_loop in metres.items():
        found += _of_zone(name(zone), by_loop, laps)
    homeless = [
        loop.id
        for loop, visits in zip(loops, zones.visits, strict=True)
        if len(visits) > 1 and sum(v.length_m for v in visits) > loop.length_m - 1.0
    ]
    if homeless:
        found.append(f"no private road on {listed(homeless)}: its vehicle always blocks others")
    found += [
        f"zones that follow each other on {listed(users)} were made one (Prop. 1)" for users in zones.merged
    ]
    return found


def _of_zone(zone: StateId, metres: dict[str, float], laps: dict[str, float]) -> list[str]:
    found = []
    swallowed = [loop for loop, m in metres.items() if m > _SWALLOWED * laps[loop]]
    if swallowed:
        share = sum(metres[loop] for loop in swallowed) / sum(laps[loop] for loop in swallowed)
        found.append(
            f"{zone} takes {share:.0%} of {listed(swallowed)}: one vehicle at a time there; "
            f"limit the shared length (--max-shared), or use --abstraction queues"
        )
    whole = [loop for loop in swallowed if metres[loop] > laps[loop] - 1.0]
    others = [loop for loop in metres if loop not in whole]
    if whole:
        verb = "lies in it all the way: its vehicle never leaves" if len(whole) == 1 else "never leave it"
        found.append(
            f"{zone}: {listed(whole)} {verb}" + (f", and {listed(others)} can never enter" if others else "")
        )
    if len(metres) >= max(3, len(laps) // 2 + 1):
        found.append(
            f"{zone} is shared by {len(metres)} of {len(laps)} loops, {sum(metres.values()):.0f} m in all: "
            f"they wait for one another"
        )
    return found
