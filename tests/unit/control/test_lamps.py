"""What a light shows in the next step, and what its program says of later."""

from __future__ import annotations

from math import inf
from typing import cast

import pytest

from loopgate.control.lamps import Lamp, Signal
from loopgate.traffic.base import Light, Phase, Program, Traffic


class _Shows:
    """A simulation with one light, which counts how often it is read."""

    def __init__(self, letters: str, left_s: float, *, fixed: bool) -> None:
        longest_s = (30.0, 3.0, 20.0)
        following = (1, 2, 0)
        phases = tuple(map(Phase, letters, longest_s, following))
        self._shown = Light(letters[0], left_s, "day", 0, 30.0 - left_s)
        self._program = Program(phases, fixed=fixed)
        self.read = 0

    def light(self, _: str) -> Light:
        self.read += 1
        return self._shown

    def light_program(self, _: str) -> Program:
        return self._program


def signal(letters: str = "Gyr", left_s: float = 10.0, *, fixed: bool = True) -> tuple[_Shows, Signal]:
    """Return a light that has shown its first letter for 30 s less `left_s`, and the time is 0."""
    shows = _Shows(letters, left_s, fixed=fixed)
    return shows, Signal(Lamp("t", cast("Traffic", shows)), 0, 13.9)


def test_a_light_is_read_when_it_may_have_changed() -> None:
    shows, one = signal()
    for now_s in (0.0, 5.0, 10.0):
        assert one.next_letter(now_s) == ("y" if now_s == 10.0 else "G")
    assert shows.read == 1


@pytest.mark.parametrize(("letters", "red_s"), [("Gyr", 13.0), ("GGr", 13.0), ("ryG", 0.0), ("GGG", inf)])
def test_red_comes_after_green_and_amber(letters: str, red_s: float) -> None:
    assert signal(letters)[1].red_at_s(0.0) == red_s


def test_of_a_program_that_is_not_fixed_only_what_it_shows_is_known() -> None:
    _, one = signal(fixed=False, left_s=10.0)
    assert one.may_be_open(0.0, 0.0, 10.0)
    assert not one.may_be_open(0.0, 0.0, 11.0)
    assert not signal("ryG", fixed=False)[1].may_be_open(0.0, 20.0, 21.0)


def test_a_fixed_program_is_known_all_along() -> None:
    _, one = signal("ryG", left_s=10.0)
    assert not one.may_be_open(0.0, 12.0, 14.0)
    assert one.may_be_open(0.0, 13.0, 33.0)
    assert not one.may_be_open(0.0, 13.0, 34.0)
