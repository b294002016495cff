"""The course of a run: a loop over time."""

import pandas as pd

from loopgate.analysis import compute_time_space


def test_a_vehicle_that_is_led_round_a_street_drives_no_round_of_its_loop_on_each_edge_of_its_way() -> None:
    """Edges that are on no round of the loop are no places on it; the round goes on where the loop does."""
    entered = [(0, "a"), (10, "b"), (20, "x"), (30, "y"), (40, "d"), (50, "a")]
    rows = [(time_s, "v1", "edge", edge) for time_s, edge in entered]
    events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    loops = pd.DataFrame({"loop": "l", "edge": ["a", "b", "c", "d"], "begin_m": [0.0, 100.0, 200.0, 300.0]})
    vehicles = pd.DataFrame({"vehicle": ["v1"], "loop": "l", "loop_length_m": 400.0})
    points = compute_time_space(events=events, vehicles=vehicles, loops=loops, loop="l")
    assert points[["lap", "time_s", "position_m"]].to_numpy().tolist() == [
        [0, 0, 0], [0, 10, 100], [0, 40, 300], [0, 50, 400], [1, 50, 0]
    ]  # fmt: skip
