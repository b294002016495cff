"""The service rule of the chain: it says whose turn it is, so that the one who has waited longest goes on."""

from loopgate.gates.certified.occupancy import Occupancy


def next_mover(stand: Occupancy, robot: int) -> int:
    """Return the robot to move next, so that `robot` moves after finitely many such moves.

    For systems that the chain rule keeps going: all places left in order of arrival, holding two or more or
    a single robot's own, all paths closed. Ask again after each move until `robot` has moved.

    Follow the heads from the robot's place over full places to the first that has room. The head of the
    place before it moves; if that closed a circle of full places, the head of the circle's last place moves
    instead, which wants the same place and closes none. So no move closes a circle. It ends where no set of
    places is crowded (`loopgate.gates.certified.crowding`): else the same places would be left and entered
    again and again, by residents alone, with one slot in all.

    Raises `ValueError` if full places wait for one another in a circle already: nobody in them can ever move.

    Notes
    -----
    O(places on the chain). How many moves it takes has no bound that is polynomial in the places.
    """
    here = stand.state(robot)
    head = _head(stand, here, robot)
    seen = {here}
    while (there := stand.wanted(head)) not in seen and _full(stand, there):
        here = there
        seen.add(here)
        head = _head(stand, here, robot)
    if there in seen and _full(stand, there):
        msg = f"full places wait for one another in a circle through {stand.layout.system.states[there]}"
        raise ValueError(msg)
    return _last_of_circle(stand, head, there)


def _last_of_circle(stand: Occupancy, head: int, filled: int) -> int:
    """Return the head of the last place of the circle that the move of `head` would close; `head` if none."""
    if stand.count[filled] + 1 < stand.layout.room[filled]:
        return head
    left = stand.state(head)
    place, seen, last = filled, set[int](), head
    while place not in seen:
        seen.add(place)
        last = _head(stand, place, -1)
        if last < 0:
            return head
        place = stand.wanted(last)
        if place == filled:
            return last
        if place == left or not _full(stand, place):
            return head
    return head


def _full(stand: Occupancy, place: int) -> bool:
    return not stand.layout.system.private[place] and stand.count[place] >= stand.layout.room[place]


def _head(stand: Occupancy, place: int, alone: int) -> int:
    """Return the first in line at `place`; `alone` where it is a robot's own and has no line."""
    line = stand.queue.get(place)
    if line:
        return line[0]
    return alone
