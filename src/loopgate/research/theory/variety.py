"""Small random systems of every kind, one per seed, for checking gates."""

import random

from loopgate.errors import SystemModelError
from loopgate.model import System
from loopgate.research.theory.random_systems import Shape, random_system

_REDRAWS = 1_000_003
"""Distance between the seeds tried where robots do not fit into their states; larger than any study."""


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
