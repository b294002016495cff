"""Closed places in words: a street once, by its name, with times of day."""

from __future__ import annotations

from typing import Any

from loopgate.results.figures import _blocked


def test_a_closed_street_is_named_once() -> None:
    """Its lanes close together; a place without a street keeps its name."""
    lane: dict[str, Any] = {"why": "closed", "from_s": 36000.0, "to_s": 39600.0, "street": "Long Lane"}
    places = [lane | {"place": "s1_0"}, lane | {"place": "s2_0"}, lane | {"place": "s3_0", "street": ""}]
    summary = {"begins_s": 34200.0, "standing": {"blocked": places, "led_round": 2}}
    ((_, text),) = _blocked(summary)
    assert text == "Long Lane (closed) from 10:00:00 to 11:00:00, and 1 more; 2 vehicles led round"
