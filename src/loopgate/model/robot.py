"""A robot and its path: a closed or open sequence of states."""

from dataclasses import dataclass

from loopgate.errors import SystemModelError
from loopgate.model.ids import RobotId, StateId
from loopgate.reading import shown


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot on a fixed path: the sequence of states that it visits (Zhou et al. 2020, Section 3.2).

    Raises `SystemModelError` on an empty name or path, a start outside the path, or a state that follows
    itself.

    Parameters
    ----------
    id
        The robot's name, unique in its system.
    path
        The states in driving order. A state may occur several times, but not twice in a row; each visit is a
        position of its own.
    closed
        Whether the last state is followed by the first. An open path ends in a terminal state where the
        robot stays for good.
    start
        Position on the path at the beginning, ``0 <= start < len(path)``.

    Examples
    --------
    >>> from loopgate import Robot
    >>> Robot("a", ("s1", "s2", "s3")).next_position(2)
    0
    >>> Robot("b", ("s1", "s2", "s3"), closed=False).next_position(2) is None
    True
    """

    id: RobotId
    path: tuple[StateId, ...]
    closed: bool = True
    start: int = 0

    def __post_init__(self) -> None:
        if not self.id:
            msg = "a robot has an empty id; give every robot a name"
            raise SystemModelError(msg)
        if not self.path:
            msg = f"robot {self.id}: its path is empty; a path needs at least one state"
            raise SystemModelError(msg)
        if not all(self.path):
            msg = f"robot {self.id}: a state on its path has an empty id"
            raise SystemModelError(msg)
        if not 0 <= self.start < len(self.path):
            last = len(self.path) - 1
            msg = f"robot {self.id}: start {shown(self.start)} is not a position on its path (0 to {last})"
            raise SystemModelError(msg)
        followers = self.path[1:] + self.path[:1] if self.closed and len(self.path) > 1 else self.path[1:]
        for here, following in zip(self.path, followers, strict=False):
            if here == following:
                msg = f"robot {self.id}: state {here} follows itself; write the two visits as one"
                raise SystemModelError(msg)

    def next_position(self, position: int) -> int | None:
        """Return the index on the path after `position`; None if the robot stays for good.

        A robot stays for good at the end of an open path and on a closed path of a single state.
        """
        if position + 1 < len(self.path):
            return position + 1
        return 0 if self.closed and len(self.path) > 1 else None
