"""The sight of a robot: the signals of its own collision states within range."""

from dataclasses import dataclass

from loopgate.model import Configuration, System


@dataclass(frozen=True, slots=True)
class Sensing:
    """How far a robot sees."""

    states_ahead: int | None = None
    """States ahead on its own path whose signals a robot can read; None for as many as it looks ahead."""
    monitored: frozenset[int] = frozenset()
    """States with a monitor at their ends, which tells anyone who is in them (Section 3.1 of Zhou et al.
    2020): for segments longer than the range."""


def sense(
    system: System, configuration: Configuration, robot: int, sensing: Sensing, lookahead: int
) -> dict[int, int | None]:
    """Return the signals that `robot` can read: who stands in each collision state ahead, None for nobody.

    A state whose signal it cannot read is not in the answer. It looks no further than its next private state.
    """
    signals: dict[int, int | None] = {}
    position = configuration.positions[robot]
    path = system.paths[robot]
    for step in range(lookahead + 1):
        following = system.robots[robot].next_position(position)
        if following is None:
            break
        position = following
        state = path[position]
        if system.private[state]:
            break
        if sensing.states_ahead is None or step < sensing.states_ahead or state in sensing.monitored:
            inside = system.occupants(configuration, state)
            signals[state] = inside[0] if inside else None
    return signals
