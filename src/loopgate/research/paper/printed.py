"""Figures and tables that Zhou et al. 2020 print."""

from typing import Final

LIVE_ROUNDS: Final = {
    10: 3.19,
    100: 30.22,
    500: 149.41,
    1000: 296.9,
    2000: 602.47,
    5000: 1503.97,
    8000: 2406.44,
    10000: 3017.65,
}
"""Rounds without avoidance and how many of them were live, mean of 100 experiments (Section 5.1)."""

MOVES: Final = (
    *("r3", "r7", "r5", "r6", "r2", "r2", "r8", "r6", "r8"),
    *("r6", "r4", "r7", "r6", "r4", "r1", "r5", "r3", "r7"),
    *("r5", "r3", "r1", "r3", "r1", "r1", "r3", "r1", "r1"),
)
"""The evolution of Section 5.2."""

ADMITTED: Final = {
    0: ("r3", "r5", "r6", "r7", "r8"),
    1: ("r2", "r5", "r6", "r7", "r8"),
    2: ("r2", "r5", "r6", "r8"),
}
"""Robots that may move, by the number of moves made, where the text names them."""

SNAPSHOTS: Final = {
    "a": (1, ("s1", "s6", "s5", "s10", "s11", "s12", "s13", "s14")),
    "b": (2, ("s1", "s6", "s5", "s10", "s11", "s12", "s3", "s14")),
    "c": (3, None),
    "d": (4, None),
    "e": (6, ("s1", "s2_0", "s5", "s10", "s9", "s8", "s3", "s14")),
    "f": (10, ("s1", "s2_0", "s5", "s10", "s9", "s13", "s3", "s8_0")),
    "g": (14, None),
    "h": (19, None),
}
"""Panels of Fig. 12: moves made, and the configuration where the text prints it."""

TABLE1: Final = (
    ((18903, 5155), (14859, 4023)),
    ((34165, 9860), (28204, 8191)),
    ((19830, 5407), (14913, 4021)),
    ((7616, 2164), (5960, 1669)),
    ((2506, 661), (1187, 316)),
)
"""Table 1: for each start (configurations, routes) of their method and of VBanker."""
