"""Algorithm 2 by messages on segments: the decisions of the central gate, and none that it would refuse."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from random import Random

import pytest

from loopgate.research.theory.instances import instance
from loopgate.research.theory.random_systems import dense, random_system
from loopgate.research.vehicles.surveys import Receive, SurveyWalk, rounds
from loopgate.vehicles import survey as monitors
from loopgate.vehicles import surveyor as cars
from loopgate.vehicles.messages import Goes, Left, Moved
from loopgate.vehicles.survey import Busy, Cause, Free, Look, Monitor, Role, Seen, Stand, ToMonitor, Whose

WRONG = ("unsafe", "otherwise", "overfull", "blocked")
NAMED = ("unsound_n5", "blocked_n5", "fig8", "fig10")


def _walk(seed: int, loss: float, receive: Receive = monitors.receive, events: int = 600) -> Counter[str]:
    named = NAMED[seed % 8] if seed % 8 < len(NAMED) else ""
    system = rounds(instance(named) if named else random_system(dense(4 + seed % 5), seed))
    walk = SurveyWalk(system, Random(seed), loss=loss, receive=receive)
    for _ in range(events):
        walk.step()
    walk.found["blocked"] += not walk.goes_on()
    return walk.found


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
def test_no_move_is_made_that_the_central_gate_refuses(loss: float) -> None:
    """Messages late, lost, in any order; decisions that nothing came between are the same."""
    total: Counter[str] = Counter()
    for seed in range(1, 61):
        total += _walk(seed, loss)
    assert {key: total[key] for key in WRONG} == dict.fromkeys(WRONG, 0)
    assert total["moves"] > 500
    assert total["compared"] > 200
    assert total["refused"] > 200


def _no_marks(monitor: Monitor, message: ToMonitor, now_s: float) -> monitors.Answer:
    """Let others come and go where a vehicle has looked and still decides."""
    after, out = monitors.receive(monitor, message, now_s)
    return replace(after, marks=()), out


def _no_doubt(monitor: Monitor, message: ToMonitor, now_s: float) -> monitors.Answer:
    """Say who is there, though that one may have gone, and another may come."""
    if isinstance(message, Look) and message.roles[message.at] is Role.READ:
        sure = replace(monitor, coming=False, leaving=0)
        after, out = monitors.receive(sure, message, now_s)
        return replace(after, coming=monitor.coming, leaving=monitor.leaving), out
    return monitors.receive(monitor, message, now_s)


def _no_rears(monitor: Monitor, message: ToMonitor, now_s: float) -> monitors.Answer:
    """Give a segment away that a rear is still in."""
    after, out = monitors.receive(replace(monitor, rears=()), message, now_s)
    return after, out


def _pairs(seed: int, receive: Receive) -> Counter[str]:
    """Let two decide, the second when the first has all answers and has not gone; the second goes first."""
    system = rounds(instance(NAMED[seed % 4]) if seed % 2 else random_system(dense(4 + seed % 5), seed))
    rng = Random(seed)
    walk = SurveyWalk(system, rng, loss=0.0, receive=receive)
    for _ in range(30):
        first, second = rng.sample(range(len(walk.cars)), 2)
        for number in (first, second):
            walk.asks(number)
        for number in (second, first):
            walk.goes_or_gives_up(number)
    return walk.found


def test_where_one_decides_nobody_comes_that_changes_the_answer() -> None:
    """Of two that decide at a time both go, or one is refused; the marks of the first are needed for that."""
    assert not any(_pairs(seed, monitors.receive)["unsafe"] for seed in range(100, 135))
    assert any(_pairs(seed, _no_marks)["unsafe"] for seed in range(125, 135))


@pytest.mark.parametrize("fault", [_no_doubt, _no_rears])
def test_each_rule_of_a_monitor_is_needed(fault: Receive) -> None:
    """Without it some move is made that the central gate refuses."""
    assert any(
        any(found[key] for key in WRONG) for found in (_walk(seed, 0.1, fault) for seed in range(1, 400))
    )


def _stand(vehicle: int, number: int = 1) -> Stand:
    return Stand(vehicle, number, (7, 3), (True, False), 0)


def test_a_segment_is_given_to_one_at_a_time() -> None:
    """Who may come is asked whether it has, until it has said so; then the segment is full."""
    monitor, _ = monitors.receive(Monitor(7, 2.0), Look(1, 1, (7,), (Role.TAKE,), _stand(1)), 0.0)
    other = Look(2, 4, (7,), (Role.TAKE,), _stand(2, 4))
    _, out = monitors.receive(monitor, other, 100.0)
    assert out == [Busy(2, 4, (7,), Cause.BUSY), Whose(1, 1, 7)]
    monitor, _ = monitors.receive(monitor, Goes(7, 1, 1), 100.0)
    assert monitors.receive(monitor, other, 100.0)[1] == [Busy(2, 4, (7,), Cause.FULL)]
    monitor, _ = monitors.receive(monitor, Moved(7, 1, 2), 101.0)
    assert monitors.receive(monitor, other, 101.0)[1] == [Busy(2, 4, (7,), Cause.FULL)]
    monitor, _ = monitors.receive(monitor, Left(7, 1, 2), 102.0)
    assert monitors.receive(monitor, other, 102.0)[1] == [Seen(2, 4, (7,), ())]


def test_a_wish_that_is_given_up_frees_what_was_looked_at_and_old_words_are_void() -> None:
    """Also if the first of them comes after that."""
    look = Look(1, 1, (7,), (Role.TAKE,), _stand(1))
    monitor, _ = monitors.receive(Monitor(7, 2.0), look, 0.0)
    monitor, _ = monitors.receive(monitor, Free(1, 1, (7,)), 0.1)
    assert monitor.stand is None
    assert monitors.receive(monitor, look, 0.2) == (monitor, [])


def test_an_older_wish_does_not_take_the_place_of_a_newer_one() -> None:
    """The vehicle has come under the newer, and to give up the older would free its segment."""
    monitor = Monitor(7, 2.0)
    for number in (2, 1):
        monitor, _ = monitors.receive(monitor, Look(1, number, (7,), (Role.TAKE,), _stand(1, number)), 0.0)
    assert monitor.stand == _stand(1, 2)
    assert monitors.receive(monitor, Free(1, 1, (7,)), 0.1)[0].stand == _stand(1, 2)


def test_a_vehicle_tells_what_has_become_of_a_wish() -> None:
    """It has come, has gone, is out, or has given up; while it decides it says nothing."""
    car = cars.Surveyor(Stand(1, 0, (7, 3, 9), (True, True, True), 0), 3)
    car, (look,) = cars.ask(car, 0.0)
    assert isinstance(look, Look)
    assert (look.way, look.roles) == ((7, 3, 9), (Role.LEAVE, Role.TAKE, Role.READ))
    assert cars.told(car, Whose(1, 1, 3))[1] == []
    assert cars.told(cars.give_up(car)[0], Whose(1, 1, 3))[1] == [Free(1, 1, (3,))]
    car, _ = cars.seen(car, Seen(1, 1, look.way, ((9, None),)))
    car, said = cars.go(car)
    assert said == [Goes(3, 1, 1), Moved(7, 1, 1), Free(1, 1, look.way, 2, went=True)]
    assert cars.told(car, Whose(1, 1, 3))[1] == [Goes(3, 1, 1)]
    assert cars.told(car, Whose(1, 1, 7))[1] == [Moved(7, 1, 1)]
    car, said = cars.rear_out(car)
    assert said == cars.told(car, Whose(1, 1, 7))[1] == cars.repeat(car) == [Left(7, 1, 1)]
