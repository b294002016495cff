"""Closed places in words: a street once, by its name, with times of day."""

from __future__ import annotations

from typing import Any

from loopgate.results.figures import _blocked, _others, _vehicles


def test_a_closed_street_is_named_once() -> None:
    """Its lanes close together; a place without a street keeps its name."""
    lane: dict[str, Any] = {"why": "closed", "from_s": 36000.0, "to_s": 39600.0, "street": "Long Lane"}
    places = [lane | {"place": "s1_0"}, lane | {"place": "s2_0"}, lane | {"place": "s3_0", "street": ""}]
    summary = {"begins_s": 34200.0, "standing": {"blocked": places, "led_round": 2}}
    ((_, text),) = _blocked(summary)
    assert text == "Long Lane (closed) from 10:00:00 to 11:00:00, and 1 more; 2 vehicles led round"


def test_one_is_counted_as_one() -> None:
    """Nouns follow their numbers."""
    assert _vehicles({"vehicles": 3, "loops": 1}) == [("vehicles", "3 on 1 loop")]
    assert _vehicles({"vehicles": 3, "loops": 2}) == [("vehicles", "3 on 2 loops")]
    ((_, text),) = _others({"others": {"vehicles": 1, "collisions": 1}})
    assert text == "1 ordinary vehicle; 1 collision between them"
