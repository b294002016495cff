"""Systems of Zhou et al. 2020, rebuilt from its text, and the smallest known where its algorithm fails.

Each is a system file beside this module; its note says where it comes from.
"""

from importlib.resources import as_file, files

from loopgate.errors import SystemFileError
from loopgate.model import Robot, RobotId, StateId, System, read_system

__all__ = ["TABLE1_STARTS", "fig7", "instance", "instance_names"]

TABLE1_STARTS = (
    ("s1", "s4", "s10", "s12"),
    ("s1", "s8", "s6", "s12"),
    ("s1", "s8", "s10", "s7"),
    ("s1", "s4", "s6", "s12"),
    ("s1", "s4", "s6", "s7"),
)
"""Initial configurations of Table 1, for the system ``fig8``."""


def instance_names() -> list[str]:
    """Return the names of all example systems, sorted."""
    return sorted(
        entry.name.removesuffix(".json")
        for entry in files(__name__).iterdir()
        if entry.name.endswith(".json")
    )


def instance(name: str) -> System:
    """Return the example system called `name`, such as ``fig10`` or ``unsound_n5``.

    Raises `SystemFileError` if no example system has the name.
    """
    if name not in instance_names():
        msg = f"instance {name}: there is no such system; there are {', '.join(instance_names())}"
        raise SystemFileError(msg)
    with as_file(files(__name__) / f"{name}.json") as file:
        return read_system(file)


def fig7(robots: int) -> System:
    """Return a system of the paper's Fig. 7: `robots` (at least 4) with a deadlock of order ``robots - 3``.

    With m robots, t and x for the states: r1 runs t1 x1 ... x(m-3) t2, r2 runs t2 t3, r(m-i) runs
    t(m-i) xi t(m-i+1) for i from 1 to m-3, and rm runs tm t1 (proof of Lemma 2). A private end state of each
    robot is added.

    Raises `ValueError` if `robots` is below 4.
    """
    m = robots
    if m < 4:  # noqa: PLR2004 - fewer robots form no higher-order deadlock
        msg = f"the family of Fig. 7 begins with 4 robots, not {m}"
        raise ValueError(msg)
    walks = {1: ["t1", *(f"x{i}" for i in range(1, m - 2)), "t2"], 2: ["t2", "t3"], m: [f"t{m}", "t1"]}
    walks.update({m - i: [f"t{m - i}", f"x{i}", f"t{m - i + 1}"] for i in range(1, m - 2)})
    return System(
        Robot(RobotId(f"r{k}"), tuple(StateId(s) for s in [*walks[k], f"r{k}_0"]), closed=False)
        for k in range(1, m + 1)
    )
