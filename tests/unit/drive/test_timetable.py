"""When links are open, by programs that are fixed and programs that follow the traffic."""

import math
from typing import Any

import pytest
from fake_traffic import FakeTraffic
from lights_scene import Scene, signal

from loopgate.drive.tables import Tables
from loopgate.drive.timetable import Signal, Timetable
from loopgate.simulation.around.lights import longest_closed_s
from loopgate.traffic.base import Light, Phase, Program

CROSS = (Phase("Gr", 20.0, 1), Phase("yr", 3.0, 2), Phase("rG", 30.0, 3), Phase("ry", 3.0, 0))
"""Two links take turns: the first has green for 20 s and red for 33 s."""


def cross(*, fixed: bool, changes_s: float = 8.0, spent_s: float = 12.0) -> Scene:
    """Make the light ``t`` in its first phase."""
    scene = Scene(signal("t"), links=2)
    scene.traffic.lights["t"] = Light("Gr", changes_s, "p", 0, spent_s)
    scene.traffic.programs["t"] = Program(CROSS, fixed=fixed)
    return scene


@pytest.mark.parametrize(
    ("link", "from_s", "to_s", "expected"),
    [
        (0, 0.0, 8.0, True),  # green for 8 s more
        (0, 0.0, 8.5, False),  # then yellow
        (1, 0.0, 1.0, False),
        (1, 11.0, 41.0, True),  # 8 + 3 s on, the second link has its 30 s
        (1, 10.0, 12.0, False),
        (1, 11.0, 42.0, False),
        (0, 44.0, 64.0, True),  # and the first again after 8 + 3 + 30 + 3 s
    ],
)
def test_a_fixed_program_is_known_ahead(link: int, from_s: float, to_s: float, *, expected: bool) -> None:
    """Every phase that touches the time asked about must be green."""
    assert cross(fixed=True).may_be_open(link, from_s, to_s) is expected


@pytest.mark.parametrize(
    ("link", "to_s", "expected"), [(0, 8.0, True), (0, 8.5, False), (1, 1.0, False), (1, 30.0, False)]
)
def test_of_a_program_that_follows_traffic_only_the_latest_end_is_known(
    link: int, to_s: float, *, expected: bool
) -> None:
    """After 12 of at most 20 s it is green for at most 8 s more, though it may change in a second."""
    scene = cross(fixed=False, changes_s=1.0)
    assert scene.may_be_open(link, 0.0, to_s) is expected
    assert not scene.may_be_open(1, 15.0, 16.0)  # it may be, but nothing says so


@pytest.mark.parametrize(
    ("changes_s", "link", "expected"),
    [
        (8.0, 0, ("G", 11.0)),  # 8 s of green and 3 of amber
        (8.0, 1, ("r", 0.0)),
        # It changes at the beginning of the next step.
        (0.0, 0, ("y", 3.0)),
    ],
)
def test_the_next_step_of_a_fixed_program_is_known(
    changes_s: float, link: int, expected: tuple[str, float]
) -> None:
    """Also a change that is due but not made yet."""
    assert cross(fixed=True, changes_s=changes_s).next(link) == expected


def test_a_green_that_is_due_counts_already() -> None:
    """Whoever waits for it sets out in the step in which it comes."""
    scene = cross(fixed=True)
    scene.traffic.lights["t"] = Light("yr", 0.0, "p", 1)
    assert scene.next(1) == ("G", 33.0)
    assert scene.next(0) == ("r", 0.0)


def test_a_program_that_follows_traffic_is_taken_to_change_as_soon_as_it_may() -> None:
    """It may change in 2 s, or already; then comes its amber."""
    scene = cross(fixed=False, changes_s=2.0)
    assert scene.next() == ("G", 5.0)
    scene.traffic.now_s = 30.0
    assert scene.next() == ("G", 33.0)


def test_a_light_is_read_again_only_when_it_can_have_changed() -> None:
    """What was seen holds until the change is due; the change is there a step later."""
    scene = cross(fixed=True, changes_s=8.0)
    timetable, traffic = scene.timetable, scene.traffic
    assert timetable.is_open("t", 0)
    traffic.lights["t"] = Light("rG", 40.0, "p", 2)
    traffic.now_s = 8.0
    assert timetable.is_open("t", 0)
    traffic.now_s = 9.0
    assert not timetable.is_open("t", 0)
    assert timetable.is_open("t", 1)


def test_how_long_it_stays_red() -> None:
    """Over the end of the cycle too; for ever if no phase opens the link; unknown if it follows traffic."""
    program = cross(fixed=True).timetable.program("t")
    assert longest_closed_s(program, 0) == 36.0
    assert longest_closed_s(program, 1) == 26.0
    traffic = FakeTraffic({})
    traffic.lights["u"] = Light("r", 1000.0, "p", 0)
    traffic.programs["u"] = Program((Phase("r", 1000.0, 1), Phase("y", 3.0, 0)), fixed=True)
    never = Timetable(traffic, [Signal("over u", "u", 0, 10.0)])
    assert longest_closed_s(never.program("u"), 0) == math.inf
    assert longest_closed_s(cross(fixed=False).timetable.program("t"), 0) == 0.0


def test_lights_that_are_off_let_everybody_pass() -> None:
    """Without a program only the letters count."""
    scene = Scene(signal("t"), links=2)
    scene.traffic.lights["t"] = Light("Oo", -1.0)
    scene.traffic.programs["t"] = Program((), fixed=False)
    assert scene.timetable.is_open("t", 0)
    assert scene.may_be_open(1, 0.0, 1e6)
    assert scene.next() == ("O", math.inf)


def test_tables_take_over_the_room_that_somebody_else_needed() -> None:
    """Ordinary traffic asks what lights show; what the steps look at would end before their phases."""
    timetable = Timetable(cross(fixed=True).traffic, [Signal("m", "t", 0, 10.0)])
    nothing: Any = dict.fromkeys(Tables._fields)
    before = timetable.put_into(Tables(**nothing))
    assert not timetable.read()
    timetable.showing(timetable.numbers_of(["t"]))
    assert timetable.read()
    after = timetable.put_into(before)
    assert not timetable.read()
    assert len(before.phases) < len(CROSS) <= len(after.phases)
