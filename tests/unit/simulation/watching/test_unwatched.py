"""Streets that went unwatched while a place was blocked."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pandas as pd

from loopgate.analysis import compute_blocked
from loopgate.simulation.monitoring import note_unwatched


def test_streets_of_loops_through_a_blocked_place_are_named_with_since_when() -> None:
    """Not those that were seen meanwhile, that others go unseen as long, or that lie on no such loop."""
    tracks = []
    for loop, place, edges in (("one", "p", "a b rare never"), ("other", "q", "c")):
        legs = [SimpleNamespace(state=place)]
        tracks.append(SimpleNamespace(loop=loop, legs=legs, edges=[(0.0, e) for e in edges.split()]))
    times = {"a": [100, 200, 580, 1600], "b": [100, 200, 590, 900], "rare": [590], "c": [100, 580]}
    rows = [(float(t), "edge", edge) for edge, some in times.items() for t in some]
    events = pd.DataFrame(rows, columns=["time_s", "event", "place"])
    blocked: dict[str, Any] = {"place": "p", "why": "closed", "vehicle": "", "from_s": 600.0, "to_s": 1500.0}
    short = blocked | {"from_s": 600.0, "to_s": 700.0}
    note_unwatched([blocked, short], cast("Any", tracks), events, begin_s=0.0, end_s=2000.0)
    assert blocked["unwatched"] == {"a": 580.0, "rare": 590.0}
    assert short["unwatched"] == {"a": 580.0, "rare": 590.0}
    told = compute_blocked(summary={"standing": {"blocked": [blocked]}})["unwatched"].tolist()
    assert told == ["a since 580 s, rare since 590 s"]
