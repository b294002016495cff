"""Vehicles and posts that decide by messages: never a circle, never a slot twice, and somebody goes on."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from random import Random
from typing import Any

import pytest
from everyone import draw
from posts_model import Beside, NoStepError, Truth
from vehicles_alone import WRONG, walk_through

from loopgate.research.vehicles.exploring import explore
from loopgate.research.vehicles.walk import RandomWalk
from loopgate.research.vehicles.world import Receive, World, begin
from loopgate.vehicles import post as posts
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import (
    Ask,
    Clear,
    Goes,
    Grant,
    Here,
    Left,
    Moved,
    Offer,
    Probe,
    Refuse,
    Room,
    ToPost,
    Why,
)
from loopgate.vehicles.post import Entry, Post
from loopgate.vehicles.vehicle import AskingVehicle

SYSTEMS = 100


def _study(receive: Receive = posts.receive, *, loss: float = 0.1, systems: int = SYSTEMS) -> Counter[str]:
    total: Counter[str] = Counter()
    for seed in range(1, systems + 1):
        total += walk_through(seed, loss=loss, receive=receive)
    return total


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_no_grant_closes_a_circle_and_nobody_is_blocked(loss: float) -> None:
    """As the central chain rule, on random systems, in random orders."""
    total = _study(loss=loss)
    assert total["grants"] > 400
    assert total["Probe"] > 100
    assert {key: total[key] for key in WRONG} == dict.fromkeys(WRONG, 0)


def test_a_vehicle_that_loses_its_memory_goes_on_and_harms_nobody() -> None:
    """Killed and started again, anywhere between two messages."""
    total: Counter[str] = Counter()
    for seed in range(1, SYSTEMS + 1):
        total += walk_through(seed, loss=0.2, forgets=0.03)
    assert total["forgot"] > 500
    assert {key: total[key] for key in WRONG} == dict.fromkeys(WRONG, 0)


def test_a_vehicle_that_begins_anew_twice_is_in_the_books_once() -> None:
    """It left, came round and lost its memory each time, and the post did not hear that it left."""
    first = Entry(1, 4, 8)
    post = Post(5, 2, (Entry(1, 2_001, 8),), rears=((1, 4),))
    assert posts.receive(post, Here(5, 1, 1_000)) == (post, [Room(1, 1_000, 5)])
    after, out = posts.receive(post, Here(5, 1, 3_000))
    assert (after.line, after.rears, out) == (post.line, (), [Room(1, 3_000, 5)])
    both = replace(post, line=(first, *post.line), rears=())
    assert posts.receive(both, Here(5, 1, 3_000))[0] == after


@pytest.mark.parametrize("forgotten", [{"forgot": 0}, {"untold": ()}, {"rears": ()}])
def test_all_that_a_vehicle_says_when_it_begins_anew_is_needed(
    monkeypatch: pytest.MonkeyPatch, forgotten: dict[str, Any]
) -> None:
    """Without any of it books are wrong, or somebody is blocked."""
    right = cars.begin_anew
    monkeypatch.setattr(cars, "begin_anew", lambda *given: replace(right(*given), **forgotten))
    assert any(
        any(found[key] for key in WRONG)
        for found in (walk_through(seed, loss=0.2, forgets=0.03) for seed in range(1, 100))
    )


def _without_probe(post: Post, message: ToPost) -> posts.Answer:
    """Give the last slot away unasked."""
    after, out = posts.receive(post, message)
    if any(isinstance(one, Probe) and one.origin == post.place for one in out):
        return posts._let_in(after)
    return after, out


def _kept_is_free(post: Post, message: ToPost) -> posts.Answer:
    """Say to a probe that a slot is free which is kept for another vehicle."""
    if isinstance(message, Probe) and message.origin != post.place and post.kept is not None:
        return post, [Clear(message.origin, message.number, message.path)]
    return posts.receive(post, message)


def _any_answer(post: Post, message: ToPost) -> posts.Answer:
    """Take the answer to an old probe for that to the last one."""
    if isinstance(message, Clear) and post.kept is not None:
        return posts.receive(post, replace(message, number=post.kept.probe))
    return posts.receive(post, message)


def _two_at_a_time(post: Post, message: ToPost) -> posts.Answer:
    """Let one in before the one let in last has said that it goes."""
    return posts.receive(replace(post, known=True) if isinstance(message, Ask) else post, message)


def _forgetful(post: Post, message: ToPost) -> posts.Answer:
    """Forget who is gone."""
    after, out = posts.receive(post, message)
    return replace(after, gone=()), out


FAULTS = [
    (_without_probe, 1),
    (_kept_is_free, 3500),
    (_any_answer, 700),
    (_two_at_a_time, 1),
    (_forgetful, 30),
]


@pytest.mark.parametrize(("fault", "seeds"), FAULTS)
def test_each_fault_is_noticed(fault: Receive, seeds: int) -> None:
    """Each rule of the post is needed; `seeds` is where to begin."""
    total: Counter[str] = Counter()
    for seed in range(seeds, seeds + 1000):
        total += walk_through(seed, loss=0.1, receive=fault)
        if any(total[key] for key in WRONG):
            return
    pytest.fail(f"nothing was noticed: {total}")


RING = begin([(0, 1)], [2, 2], [[(0, 0), (0, 0)], [(0, 1)]])
"""Three vehicles round two places of two."""
CROSS = begin([(2, 0, 1), (3, 1, 0)], [2, 2, 2, 2], [[(0, 1)], [(1, 1)], [(0, 0)], [(1, 0)]])
"""Two places, each one short of full, whose heads want each other, and one vehicle before each."""


def test_every_order_of_messages_on_a_ring() -> None:
    """All that can come about, for ever: two messages in flight at most, any lost, any late."""
    found = explore(RING, limit=2_000, most=2)
    assert found.complete
    assert found.states > 500
    assert found.wrong == 0


def test_exploring_notices_a_circle() -> None:
    """The first states after a start at which two last slots are asked for."""
    assert explore(CROSS, limit=900, most=4).wrong == 0
    assert explore(CROSS, limit=900, most=4, receive=_without_probe).circles > 0


def _ask(place: int, vehicle: int, here: int, then: int) -> Ask:
    return Ask(place, vehicle, 1, here, then, (0, vehicle))


def _two_probes(world: World) -> tuple[Post, Post, Probe, Probe]:
    first, out = posts.receive(world.posts[0], _ask(0, 2, here=2, then=1))
    second, more = posts.receive(world.posts[1], _ask(1, 3, here=3, then=0))
    one, other = out[0], more[0]
    assert isinstance(one, Probe)
    assert isinstance(other, Probe)
    return first, second, one, other


def test_of_two_probes_that_meet_the_older_goes_on() -> None:
    """Vehicle 2 is the older: its probe takes the slot from vehicle 3, whose own probe comes back."""
    first, second, older, younger = _two_probes(CROSS)
    second, out = posts.receive(second, older)
    refused, clear = out
    assert refused == Refuse(3, 1, 1, Why.OLDER)
    assert isinstance(clear, Clear)
    first, granted = posts.receive(first, clear)
    assert granted == [Grant(2, 1, 0)]
    first, passed = posts.receive(first, younger)
    assert isinstance(passed[0], Probe)  # vehicle 2 fills the place now
    assert posts.receive(second, passed[0])[1] == []  # nobody waits for it by now


def test_a_probe_that_comes_back_hands_the_slot_to_the_head_that_wants_it() -> None:
    """The younger probe finds a circle; the head of its last place may have the slot, and nobody else."""
    first, second, _, younger = _two_probes(CROSS)
    _, passed = posts.receive(first, younger)
    assert isinstance(passed[0], Probe)
    second, out = posts.receive(second, passed[0])
    assert out == [Refuse(3, 1, 1, Why.CIRCLE), Offer(0, 1)]
    assert posts.receive(second, _ask(1, 3, here=3, then=0))[1] == [Refuse(3, 1, 1, Why.FULL)]
    second, out = posts.receive(second, _ask(1, 0, here=0, then=2))
    assert out == [Grant(0, 1, 1)]


def test_an_ask_that_waits_and_is_said_again_is_not_refused() -> None:
    """It asks once more what has become of the grant before it."""
    post, _ = posts.receive(Post(5, 4), Ask(5, 1, 1, here=4, then=6, stamp=(0, 1)))
    post, out = posts.receive(post, Ask(5, 2, 1, here=4, then=6, stamp=(0, 2), sent_s=1.0))
    assert out == []
    post, out = posts.receive(post, Ask(5, 2, 1, here=4, then=6, stamp=(0, 2), sent_s=1.3))
    assert out == [Grant(1, 1, 5)]
    assert posts.receive(post, Goes(5, 1, 1))[1] == [Grant(2, 1, 5)]


def test_words_that_come_late_change_nothing() -> None:
    """A vehicle was here and is gone; what it asked before, and that it moved on, come after that."""
    post, _ = posts.receive(Post(5, 2), Ask(5, 1, 1, here=4, then=6, stamp=(0, 1)))
    words: list[ToPost] = [Ask(5, 1, 1, here=4, then=6, stamp=(0, 1)), Moved(5, 1, 1)]
    post, _ = posts.receive(post, Left(5, 1, 1))
    for late in words:
        assert posts.receive(post, late) == (post, [])


def test_a_grant_given_back_does_not_free_the_slot_of_a_rear_still_there() -> None:
    """On two places: the vehicle wants back the place that its rear has not left. Random system 1816."""
    car, _ = cars.granted(AskingVehicle(1, (3, 7)), Grant(1, 1, 7))
    car, out = cars.give_back(car, Grant(1, 2, 3))
    assert out == []
    car, out = cars.rear_out(car)
    assert out == [Left(3, 1, 2), Goes(7, 1, 1)]
    assert walk_through(1816, loss=0.1)["overfull"] == 0


def _beside_the_model(
    seed: int, receive: Receive = posts.receive, *, loss: float = 0.2, forgets: float = 0.0, steps: int = 250
) -> int:
    """Return how many changes of books were steps of the model, on one system."""
    roads = draw(seed, narrow=False)
    if not any(roads.start) or roads.circle(roads.start):
        return 0
    start = begin(roads.loops, roads.slots, roads.start)
    truth = Truth(list(start.vehicles))
    beside = Beside(truth, receive)
    walk = RandomWalk(start, Random(seed), loss=loss, receive=beside, forgets=forgets)
    for _ in range(steps):
        walk.step()
        truth.look(walk)
    return beside.steps


@pytest.mark.parametrize("forgets", [0.0, 0.03])
def test_posts_take_only_steps_of_the_model_that_is_proved(forgets: float) -> None:
    """What they do with each message, on random systems, is what `docs/proofs/Posts.v` lets them do."""
    assert sum(_beside_the_model(seed, forgets=forgets) for seed in range(1, SYSTEMS + 1)) > 1_500


@pytest.mark.parametrize(("fault", "seeds"), FAULTS)
def test_what_is_no_step_of_the_model_is_noticed(fault: Receive, seeds: int) -> None:
    """Each rule of the post, broken; forgetting who is gone lets a vehicle in twice."""
    with pytest.raises(NoStepError):
        sum(_beside_the_model(seed, fault, loss=0.1) for seed in range(seeds, seeds + SYSTEMS))
