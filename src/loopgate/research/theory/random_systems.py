"""Random systems, for searches, property tests and benchmarks. Same shape and seed, same system."""

import random
from dataclasses import dataclass

from loopgate.errors import SystemModelError
from loopgate.model import Robot, RobotId, StateId, System

_TRIES = 40
_REDRAWS = 1_000_003
"""Distance between the seeds tried where robots do not fit into their states; larger than any study."""


@dataclass(frozen=True, slots=True)
class Shape:
    """Properties that random systems have in common.

    Raises `SystemModelError` if a number is out of range.

    Parameters
    ----------
    states
        Number of states that may be shared.
    path
        Least and most states drawn for one path; private states come on top. Ignored if `sharers` is given.
    sharers
        Least and most robots that visit one state; then the states draw their robots, and not the robots
        their states, so that paths differ more in length.
    private
        Private states per path. Where there are none, a robot starts in a shared state.
    capacity
        Least and most capacity of a shared state.
    fifo
        Share of the shared states that are FIFO, from 0 to 1.
    closed
        Whether paths are closed. Open ones end in a private state, if there is any, and begin in another.
    proposition1
        Whether no two states are neighbours on the paths of two robots (Zhou et al. 2020, Prop. 1).
    """

    robots: int
    states: int
    path: tuple[int, int] = (2, 5)
    sharers: tuple[int, int] | None = None
    private: int = 1
    capacity: tuple[int, int] = (1, 1)
    fifo: float = 0.0
    closed: bool = True
    proposition1: bool = True

    def __post_init__(self) -> None:
        ranges = [
            ("robots", (self.robots, self.robots), 1),
            ("states", (self.states, self.states), 1),
            ("path", self.path, 1),
            ("sharers", self.sharers or (1, 1), 1),
            ("private", (self.private, self.private), 0),
            ("capacity", self.capacity, 1),
        ]
        for name, (low, high), least in ranges:
            if not least <= low <= high:
                msg = f"random system: {name} is {low} to {high}; expected numbers from {least} up, ascending"
                raise SystemModelError(msg)
        if not 0.0 <= self.fifo <= 1.0:
            msg = f"random system: fifo is {self.fifo}; expected a share between 0 and 1"
            raise SystemModelError(msg)


def sparse(robots: int) -> Shape:
    """Return a shape where two or three robots visit each state, about five shared states per path."""
    return Shape(robots=robots, states=2 * robots, sharers=(2, 3))


def dense(robots: int) -> Shape:
    """Return a shape where a quarter of the robots (two at least) visit each state, about five per path."""
    visiting = min(robots, max(2, robots // 4))
    return Shape(robots=robots, states=max(3, 5 * robots // visiting), sharers=(visiting, visiting))


def small_system(seed: int) -> System:
    """Return a seed's system in the studies: 4 to 8 robots in turn, up to half as many states more."""
    rng = random.Random(seed)
    robots = 4 + seed % 5
    states = rng.randint(robots, robots + robots // 2)
    return random_system(Shape(robots=robots, states=states, path=(2, 5)), seed)


def random_system(shape: Shape, seed: int) -> System:
    """Draw a system of `shape`.

    Robots are called r1, r2, ..., shared states s0, s1, ..., private ones p1, p2, ... (p1_1, p1_2, ... if a
    robot has several). On closed paths robots start in their first private state; on open ones, and where
    there are no private states, in the first state with room.

    Raises `SystemModelError` if no private states are asked for and the robots do not fit into the states on
    their paths.
    """
    rng = random.Random(seed)
    names = [StateId(f"s{k}") for k in range(shape.states)]
    drawn = _drawn_by_states(shape, names, rng) if shape.sharers else _drawn_by_robots(shape, names, rng)
    neighbours: set[frozenset[StateId]] = set()
    paths = [_path(shape, number, states, neighbours, rng) for number, states in enumerate(drawn, start=1)]
    visited = sorted({s for path in paths for s in path}, key=lambda s: (len(s), s))
    shared = [s for s in visited if s.startswith("s")]
    rooms = {s: rng.randint(*shape.capacity) for s in shared}
    fifo = [s for s in shared if rng.random() < shape.fifo]
    starts = _starts(shape, paths, rooms)
    robots = [
        Robot(RobotId(f"r{number}"), tuple(path), closed=shape.closed, start=start)
        for number, (path, start) in enumerate(zip(paths, starts, strict=True), start=1)
    ]
    return System(robots, {s: room for s, room in rooms.items() if room > 1}, fifo)


def _drawn_by_robots(shape: Shape, names: list[StateId], rng: random.Random) -> list[list[StateId]]:
    low, high = (min(n, len(names)) for n in shape.path)
    return [rng.sample(names, rng.randint(low, high)) for _ in range(shape.robots)]


def _drawn_by_states(shape: Shape, names: list[StateId], rng: random.Random) -> list[list[StateId]]:
    drawn: list[list[StateId]] = [[] for _ in range(shape.robots)]
    low, high = (min(n, shape.robots) for n in shape.sharers or (1, 1))
    for name in names:
        for robot in rng.sample(range(shape.robots), rng.randint(low, high)):
            drawn[robot].append(name)
    for states in drawn:
        if not states:
            states.append(rng.choice(names))
    return drawn


def _path(
    shape: Shape,
    number: int,
    states: list[StateId],
    neighbours: set[frozenset[StateId]],
    rng: random.Random,
) -> list[StateId]:
    """Order the states, with private states between; leave states out where Prop. 1 would fail."""
    own = [StateId(f"p{number}_{k}" if k else f"p{number}") for k in range(shape.private)]
    left = list(states)
    while True:
        for _ in range(_TRIES):
            path = [*left, *own] if shape.closed else [*left, *own[2:]]
            rng.shuffle(path)
            if not shape.closed:
                path = [*own[1:2], *path, *own[:1]]
            around = path[1:] + path[:1] if shape.closed else path[1:]
            pairs = [frozenset(pair) for pair in zip(path, around, strict=False) if pair[0] != pair[1]]
            if not shape.proposition1 or not neighbours.intersection(pairs):
                neighbours.update(pairs)
                return path
        left.pop()


def _starts(shape: Shape, paths: list[list[StateId]], rooms: dict[StateId, int]) -> list[int]:
    if shape.private and shape.closed:
        return [next(k for k, s in enumerate(path) if s.startswith("p")) for path in paths]
    room = {s: rooms.get(s, 1) for path in paths for s in path}
    starts: list[int] = []
    for number, path in enumerate(paths, start=1):
        free = [k for k, s in enumerate(path) if room[s] > 0]
        if not free:
            msg = f"random system: robot r{number} finds no state with room to start in; draw more states"
            raise SystemModelError(msg)
        room[path[free[0]]] -= 1
        starts.append(free[0])
    return starts


def any_shape(seed: int, robots: tuple[int, int] = (3, 8)) -> Shape:
    """Draw a shape: sparse or dense, with or without private states, capacities 1 to 3, FIFO or not.

    Two thirds have closed paths with a private state on each, as in the paper; the rest share their whole
    paths or end in shared terminals, where paths are open. With more robots the paths are shorter, so that
    most systems can be explored to the end.
    """
    rng = random.Random(seed)
    n = rng.randint(*robots)
    longest = 5 if n <= 5 else 4 if n <= 6 else 3  # noqa: PLR2004 - where exploring gets slow
    dense = rng.random() < 0.5  # noqa: PLR2004 - a fair coin
    return Shape(
        robots=n,
        states=rng.randint(3, n + 1) if dense else rng.randint(n + 1, 2 * n + 2),
        path=(2, rng.randint(2, longest)),
        private=rng.choice([0, 1, 1, 1, 2]),
        capacity=rng.choice([(1, 1), (1, 1), (1, 2), (1, 3), (2, 3)]),
        fifo=rng.choice([0.0, 0.0, 0.5, 1.0]),
        closed=rng.random() < 0.8,  # noqa: PLR2004 - most paths in the paper are closed
        proposition1=rng.random() < 0.5,  # noqa: PLR2004 - a fair coin
    )


def any_system(seed: int, robots: tuple[int, int] = (3, 8)) -> System:
    """Return the system of `seed`; where its robots find no room, that of a seed far away."""
    while True:
        try:
            return random_system(any_shape(seed, robots), seed)
        except SystemModelError:
            seed += _REDRAWS
