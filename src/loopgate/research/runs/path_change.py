"""A robot's path is changed while everyone is under way (Zhou et al. 2020, Section 6)."""

from collections.abc import Sequence
from dataclasses import replace

from loopgate.errors import LoopgateError, UnsafeStartError
from loopgate.gates.certified import CertifiedGate
from loopgate.model import Configuration, RobotId, StateId, System


class PathChangeError(LoopgateError):
    """A path that cannot take the place of a robot's path now."""


def change_path(
    system: System,
    configuration: Configuration,
    robot: RobotId,
    path: Sequence[StateId],
    *,
    closed: bool = True,
) -> System:
    """Return the system with the robot's new path, everyone starting where they stand.

    The change is accepted only if the new system is live from there; gates of the old system are to be made
    anew. A state that was private may be shared now, and the other way round.

    Liveness is decided by the certified gate: exactly where every robot has a private state, within its
    budget. Raises `SystemModelError` if there is no such robot, or the path breaks a rule of the model;
    `PathChangeError` if the robot does not stand on the new path, several robots stand in one queue, whose
    order a start cannot tell, or the new system is not live from there; the text says which, and who could
    not go on.

    Parameters
    ----------
    robot, path, closed
        The robot whose path to change, and its new path; it starts at the first visit of the state in which
        it stands.
    """
    number = system.robot_number(robot)
    here = system.states[system.state_at(configuration, number)]
    if here not in path:
        msg = f"robot {robot}: it stands in {here}, which is not on its new path"
        raise PathChangeError(msg)
    for queue in configuration.queues:
        if len(queue) > 1:
            names = ", ".join(system.robots[i].id for i in queue)
            msg = f"robot {robot}: robots {names} stand in one queue; wait until one has left it"
            raise PathChangeError(msg)
    robots = [
        replace(entry, start=position)
        for entry, position in zip(system.robots, configuration.positions, strict=True)
    ]
    robots[number] = replace(robots[number], path=tuple(path), closed=closed, start=list(path).index(here))
    visited = {state for entry in robots for state in entry.path}
    capacity = {state: room for state, room in system.capacity.items() if state in visited}
    changed = System(robots, capacity, system.fifo & visited)
    try:
        CertifiedGate(changed)
    except UnsafeStartError as error:
        msg = f"robot {robot}: its new path is refused: {error}"
        raise PathChangeError(msg) from error
    return changed
