"""The table that comes first says of intervals only where there are some."""

import pandas as pd
import pytest

from loopgate.report.page import caption

NAN = float("nan")


@pytest.mark.parametrize(
    ("runs", "low", "said"),
    [
        ([1, 1], [NAN, NAN], "Throughput [vehicle-km/h]"),
        ([2, 1], [NAN, NAN], "Throughput [vehicle-km/h]: mean over runs"),
        ([3, 1], [90.0, NAN], "with its 95 % interval"),
    ],
)
def test_the_caption_follows_the_table(runs: list[int], low: list[float], said: str) -> None:
    """Of single runs there is no mean, and no interval."""
    means = pd.DataFrame({"runs": runs, "low": low})
    assert caption(means).endswith(said) or said in caption(means)
    assert ("interval" in caption(means)) == ("interval" in said)
