"""Counts for each robot the moves of other robots since its own last move."""

from collections import OrderedDict


class Patience:
    """Finds the robot that has waited too long, counted in moves of other robots.

    Parameters
    ----------
    patience
        Number of moves of other robots, per robot of the system, after which a robot without a move has
        waited too long; 0: never.

    Notes
    -----
    A robot is favoured until it moves, or until it has been favoured for as long as it had waited: it may be
    parked or broken down, and then the next robot gets its turn. O(1) per move.
    """

    def __init__(self, robots: int, patience: int) -> None:
        self._limit = patience * robots
        self._moves = 0
        self._since = OrderedDict.fromkeys(range(robots), 0)
        self._begun = 0
        self.favoured = -1
        """The robot that the gate works towards, or -1."""

    def moved(self, robot: int, *, for_good: bool) -> bool:
        """Count a move; return whether another robot is now favoured. `for_good`: the robot now stays."""
        if not self._limit:
            return False
        self._moves += 1
        before = self.favoured
        if for_good:
            self._since.pop(robot, None)
        else:
            self._since[robot] = self._moves
            self._since.move_to_end(robot)
        if robot == before:
            self.favoured = -1
        elif before >= 0 and self._moves - self._begun > self._limit:
            self._since[before] = self._moves
            self._since.move_to_end(before)
            self.favoured = -1
        if self.favoured < 0 and self._since:
            oldest = next(iter(self._since))
            if self._moves - self._since[oldest] > self._limit:
                self.favoured = oldest
                self._begun = self._moves
        return self.favoured != before

    def forget(self) -> None:
        """Restart all counts."""
        self._since = OrderedDict.fromkeys(sorted(self._since), self._moves)
        self.favoured = -1
