"""What a light shows in the next step, and what its program says of later."""

from __future__ import annotations

from math import inf
from typing import cast

import pytest
from fake_traffic import FakeTraffic

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


CROSS = (Phase("Gr", 20.0, 1), Phase("yr", 3.0, 2), Phase("rG", 30.0, 3), Phase("ry", 3.0, 0))
"""Two movements take turns: the first has green for 20 s and red for 33 s."""


def cross(*, fixed: bool, changes_s: float = 8.0, spent_s: float = 12.0) -> tuple[FakeTraffic, list[Signal]]:
    """Return a light in its first phase, and what it shows to both movements."""
    traffic = FakeTraffic({})
    traffic.lights["t"] = Light("Gr", changes_s, "p", 0, spent_s)
    traffic.programs["t"] = Program(CROSS, fixed=fixed)
    lamp = Lamp("t", traffic)
    return traffic, [Signal(lamp, link, 10.0) for link in range(2)]


@pytest.mark.parametrize(
    ("link", "from_s", "to_s", "expected"),
    [
        (0, 0.0, 8.0, True),  # green for 8 s more
        (0, 0.0, 8.5, False),  # then yellow
        (1, 0.0, 1.0, False),
        (1, 11.0, 41.0, True),  # 8 + 3 s on, the second movement has its 30 s
        (1, 10.0, 12.0, False),
        (1, 11.0, 42.0, False),
        (0, 44.0, 64.0, True),  # and the first again after 8 + 3 + 30 + 3 s
    ],
)
def test_a_fixed_program_is_known_ahead(link: int, from_s: float, to_s: float, *, expected: bool) -> None:
    """Every phase that touches the time asked about must be green."""
    assert cross(fixed=True)[1][link].may_be_open(0.0, from_s, to_s) is expected


@pytest.mark.parametrize(
    ("link", "to_s", "expected"), [(0, 8.0, True), (0, 8.5, False), (1, 1.0, False), (1, 30.0, False)]
)
def test_of_a_program_that_follows_traffic_only_the_latest_end_is_known(
    link: int, to_s: float, *, expected: bool
) -> None:
    """After 12 of at most 20 s it is green for at most 8 s more, though it may change in a second."""
    _, shown = cross(fixed=False, changes_s=1.0)
    assert shown[link].may_be_open(0.0, 0.0, to_s) is expected
    assert not shown[1].may_be_open(0.0, 15.0, 16.0)  # it may be, but nothing says so


@pytest.mark.parametrize(
    ("changes_s", "link", "letter", "red_s"),
    [
        (8.0, 0, "G", 11.0),  # 8 s of green and 3 of amber
        (8.0, 1, "r", 0.0),
        (0.0, 0, "y", 3.0),  # it changes at the beginning of the next step
    ],
)
def test_the_next_step_of_a_fixed_program_is_known(
    changes_s: float, link: int, letter: str, red_s: float
) -> None:
    """Also a change that is due but not made yet."""
    one = cross(fixed=True, changes_s=changes_s)[1][link]
    assert (one.next_letter(0.0), one.red_at_s(0.0)) == (letter, red_s)


def test_a_green_that_is_due_counts_already() -> None:
    """A vehicle that waits for it sets out in the step in which it comes."""
    traffic, shown = cross(fixed=True)
    traffic.lights["t"] = Light("yr", 0.0, "p", 1)
    assert [(one.next_letter(0.0), one.red_at_s(0.0)) for one in shown] == [("r", 0.0), ("G", 33.0)]


def test_a_program_that_follows_traffic_is_taken_to_change_as_soon_as_it_may() -> None:
    """It may change in 2 s, or already; then comes its amber."""
    _, (one, _) = cross(fixed=False, changes_s=2.0)
    assert (one.next_letter(0.0), one.red_at_s(0.0)) == ("G", 5.0)
    assert (one.next_letter(30.0), one.red_at_s(30.0)) == ("G", 33.0)


def test_what_was_seen_holds_until_the_change_is_due() -> None:
    """The change is there a step later."""
    traffic, shown = cross(fixed=True, changes_s=8.0)
    lamp = shown[0].lamp
    for now_s, state in ((0.0, "Gr"), (8.0, "Gr"), (9.0, "rG")):
        lamp.look(now_s)
        assert lamp.state == state
        traffic.lights["t"] = Light("rG", 40.0, "p", 2)


def test_lights_that_are_off_let_every_vehicle_pass() -> None:
    """Without a program only the letters count."""
    traffic, (first, second) = cross(fixed=True)
    traffic.lights["t"] = Light("Oo", -1.0)
    traffic.programs[""] = traffic.programs["t"] = Program((), fixed=False)
    assert second.may_be_open(0.0, 0.0, 1e6)
    assert (first.next_letter(0.0), first.red_at_s(0.0)) == ("O", inf)
