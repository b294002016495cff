"""The service rule: the order of moves by which the vehicle with the longest wait gets its turn."""

from loopgate.gates.certified import chain
from loopgate.gates.certified.occupancy import Occupancy


def next_mover(stand: Occupancy, robot: int) -> int:
    """Return the robot to move next so that `robot` moves in the end.

    It is for systems in which the chain rule decides: all places are left in order of arrival, and have two
    slots or more or are private; all paths are closed. Call it again after each move until `robot` has moved.
    The moves come to an end where no set of places is crowded (`loopgate.gates.certified.crowding`).
    Otherwise residents alone could leave and enter the same places again and again, with one free slot in
    all.

    Raises `ValueError` if full places already wait for one another in a circle: no robot in them can ever
    move.

    Notes
    -----
    `loopgate.gates.certified.chain.next_mover` names the robot. O(places on the chain). The number of moves
    has no bound that is polynomial in the places.
    """
    lines = _Lines(stand)
    mover = chain.next_mover(lines, stand.state(robot))
    if mover is None:
        circle = chain.circle_from(lines, stand.wanted(robot))
        msg = f"full places wait for one another in a circle through {stand.layout.system.states[circle[0]]}"
        raise ValueError(msg)
    return mover


class _Lines:
    """A configuration as places for the chain rule."""

    def __init__(self, stand: Occupancy) -> None:
        self._stand = stand

    def free(self, place: int) -> int:
        """Return the number of free slots; a private place always has one."""
        layout = self._stand.layout
        return 1 if layout.system.private[place] else layout.room[place] - self._stand.count[place]

    def first(self, place: int) -> int | None:
        """Return the first robot in line of a place; of a private state the robot in it."""
        return next(iter(self._stand.occupants(place)), None)

    def wanted(self, robot: int) -> int | None:
        """Return the place that a robot enters next."""
        state = self._stand.wanted(robot)
        return state if state >= 0 else None
