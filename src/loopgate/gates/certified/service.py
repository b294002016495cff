"""The service rule: the order of moves by which the vehicle with the longest wait gets its turn."""

from loopgate.gates.certified import chain
from loopgate.gates.certified.occupancy import Occupancy


def next_mover(stand: Occupancy, robot: int) -> int:
    """Return the robot to move next so that `robot` moves in the end.

    For systems that the chain rule keeps going: all places left in order of arrival, holding two or more or
    a single robot's own, all paths closed. Ask again after each move until `robot` has moved. It ends where
    no set of places is crowded (`loopgate.gates.certified.crowding`): else the same places would be left and
    entered again and again, by residents alone, with one slot in all.

    Raises `ValueError` if full places wait for one another in a circle already: nobody in them can ever move.

    Notes
    -----
    `loopgate.gates.certified.chain.next_mover` says whose turn it is. O(places on the chain). How many moves
    it takes has no bound that is polynomial in the places.
    """
    lines = _Lines(stand)
    mover = chain.next_mover(lines, stand.state(robot))
    if mover is None:
        circle = chain.circle_from(lines, stand.wanted(robot))
        msg = f"full places wait for one another in a circle through {stand.layout.system.states[circle[0]]}"
        raise ValueError(msg)
    return mover


class _Lines:
    """A configuration as the chain rule sees it."""

    def __init__(self, stand: Occupancy) -> None:
        self._stand = stand

    def free(self, place: int) -> int:
        """Return how many slots are free; a place of a robot's own always has one."""
        layout = self._stand.layout
        return 1 if layout.system.private[place] else layout.room[place] - self._stand.count[place]

    def first(self, place: int) -> int | None:
        """Return the first robot in line of a place; of a private state the robot in it."""
        return next(iter(self._stand.occupants(place)), None)

    def wanted(self, robot: int) -> int | None:
        """Return the place that a robot enters next."""
        state = self._stand.wanted(robot)
        return state if state >= 0 else None
