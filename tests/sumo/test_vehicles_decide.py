"""Vehicles that decide among themselves, in SUMO: nobody is handed what it cannot know; no collision."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import pytest

from loopgate.control.keeping import Keeping
from loopgate.control.ledger import Ledger
from loopgate.errors import ScenarioError
from loopgate.simulation import build
from loopgate.simulation.by_messages import answering
from loopgate.simulation.by_messages.controllers import ControllersHere
from loopgate.simulation.by_messages.decisions import DecisionsByMessages
from loopgate.simulation.by_messages.on_segments import DecisionsOnSegments
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.vehicles import keeper as keepers
from loopgate.vehicles import post as posts
from loopgate.vehicles import survey, surveyor
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import Ask
from loopgate.vehicles.post import Post
from loopgate.vehicles.vehicle import AskingVehicle

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
CROWD = Scenario(network=GRID, loops=180, vehicles=730, duration_s=20.0, decide="vehicles:loss=0.1")
_Made = TypeVar("_Made")
PLAIN = (int, float, str, bool, type(None))


def _parts(thing: Any) -> list[Any]:  # noqa: ANN401  whatever is in there
    if dataclasses.is_dataclass(thing):
        return [getattr(thing, field.name) for field in dataclasses.fields(thing)]
    assert isinstance(thing, tuple), f"{type(thing)} can hold more than what it shows"
    return list(thing)


def _numbers(thing: Any) -> None:  # noqa: ANN401  whatever is in there
    """Fail if a thing holds anything but numbers and words."""
    if not isinstance(thing, PLAIN):
        for part in _parts(thing):
            _numbers(part)


def _kept(monkeypatch: pytest.MonkeyPatch, kind: Callable[..., _Made]) -> list[_Made]:
    """Return a list to which the decisions of the next runs are added as they are made."""
    made: list[_Made] = []

    def make(*given: Any) -> _Made:  # noqa: ANN401  as there
        made.append(kind(*given))
        return made[-1]

    monkeypatch.setattr(answering, kind.__name__, make)
    return made


def test_a_crowd_with_loss_is_clean_and_nobody_is_handed_more_than_it_knows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Vehicles know their loops and what they heard; posts their place; and all of it is numbers."""
    made = _kept(monkeypatch, DecisionsByMessages)
    summary = simulate(CROWD, tmp_path / "run")
    assert (summary["outcome"], summary["audit"], summary["clean"]) == ("done", "clean", True)
    assert summary["promise"] == "somebody"  # all that is proved of these messages
    found = summary["by_messages"]
    assert found["unsafe"] == 0
    assert found["moves"] > 100
    assert found["lost"] > 20
    assert found["by_kind"]["probe"] > 0
    assert found["bytes"] == sum(found["bytes_by_kind"].values()) > 50 * found["moves"]
    assert summary["messages"] == found["messages"]
    (decisions,) = made
    assert isinstance(decisions.controllers, ControllersHere)
    for car in (one.vehicle for one in decisions.controllers.all):
        _numbers(car)
        assert {place for place, _ in (*car.rears, *car.untold)} <= set(car.loop)
    for post in decisions.posts:
        _numbers(post)
        assert len(post.line) <= post.slots
    for keeper in decisions.keepers:
        _numbers((keeper.lease_s, keeper.leases, keeper.claims, *keeper.conflicts))
    assert len(decisions.keepers) > 20  # one for each junction, none for all
    said = {field.name for field in dataclasses.fields(AskingVehicle)}
    assert said == {"id", "loop", "at", "number", "inside", "rears", "untold", "forgot"}
    assert {field.name for field in dataclasses.fields(Post)} == {
        *("place", "slots", "line", "known", "rears", "kept", "probes", "gone", "waiting")
    }


@pytest.mark.parametrize("decides", [posts.receive, posts.expire, posts.inquire])
def test_a_post_decides_from_its_books_and_a_message(decides: Any) -> None:  # noqa: ANN401  any of these
    """There is no other way in: no state of the module, no argument."""
    assert list(inspect.signature(decides).parameters) in (["post", "message"], ["post"])
    assert not {
        name for name, one in vars(posts).items() if isinstance(one, dict | list | set) and name[0] != "_"
    }


def test_a_keeper_decides_from_its_books_those_of_one_post_and_a_message() -> None:
    """And from its clock."""
    assert list(inspect.signature(keepers.receive).parameters) == ["keeper", "post", "message", "now_s"]


@pytest.mark.parametrize("decides", [cars.ask, cars.granted, cars.give_back, cars.rear_out, cars.heard])
def test_a_vehicle_decides_from_what_it_knows(decides: Any) -> None:  # noqa: ANN401  any of these
    """Itself, a message, and since when it waits."""
    first, *rest = inspect.signature(decides).parameters
    assert first == "vehicle"
    assert rest in ([], ["stamp", "now_s", "free"], ["grant"], ["room"])


def test_crossings_and_the_order_of_asking_are_left_to_vehicles_and_keepers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nobody who sees all is asked; two whose ways cross never have leases at a time; somebody waits."""
    seen: list[bool] = []
    held: list[bool] = []
    right = keepers.receive

    def looked_at(*given: Any) -> keepers.Answer:  # noqa: ANN401  as there
        keeper, post, out = right(*given)
        pairs = [(a.way, b.way) for a in keeper.leases for b in keeper.leases]
        seen.append(any(pair in keeper.conflicts for pair in pairs))
        held.append(any(one.held for one in keeper.claims))
        return keeper, post, out

    def asked(*given: Any) -> None:  # noqa: ANN401  whatever is asked
        pytest.fail(f"one who sees all was asked: {given}")

    monkeypatch.setattr(keepers, "receive", looked_at)
    monkeypatch.setattr(build, "Deciding", asked)
    monkeypatch.setattr(Keeping, "look", asked)
    summary = simulate(dataclasses.replace(CROWD, vehicles=300, duration_s=40.0))
    assert (summary["outcome"], summary["clean"]) == ("done", True)
    assert any(held)
    assert len(seen) > 500
    assert not any(seen)


@pytest.mark.parametrize("decide", ["vehicles", "vehicles:loss=0.2,delay=0.3"])
def test_vehicles_that_look_only_when_woken_do_as_if_all_looked_in_each_step(
    decide: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody sleeps who could ask; on a full grid too."""
    some = dataclasses.replace(CROWD, vehicles=500, duration_s=60.0, decide=decide)
    woken = simulate(some)
    monkeypatch.setattr(build, "Ledger", partial(Ledger, everybody=True))
    asked = simulate(some)
    assert woken["by_messages"]["moves"] > 300
    assert woken["by_messages"] == asked["by_messages"]
    assert woken["distance_km"] == asked["distance_km"]


def test_the_same_seed_gives_the_same_messages() -> None:
    """What is lost, and how long each takes, is drawn from the seed."""
    short = dataclasses.replace(CROWD, duration_s=20.0, vehicles=60)
    assert simulate(short)["by_messages"] == simulate(short)["by_messages"]


@pytest.mark.parametrize(
    ("where", "name", "instead"),
    [
        (keepers, "_conflict", lambda *_: False),
        (posts, "_decided", lambda post, ask: posts._let_in(replace_kept(post, ask))),
    ],
    ids=["leases in conflict", "no slot free"],
)
def test_a_broken_rule_is_seen(monkeypatch: pytest.MonkeyPatch, where: Any, name: str, instead: Any) -> None:  # noqa: ANN401  functions of these modules
    """Nothing that sees all stands between a grant and the road: collisions, or places with too many."""
    monkeypatch.setattr(where, name, instead)
    summary = simulate(dataclasses.replace(CROWD, duration_s=200.0))
    assert summary["collisions"] + len(summary["audit"] if summary["audit"] != "clean" else ()) > 0


def replace_kept(post: Post, ask: Ask) -> Post:
    """Return a post that keeps its last slot for a request, whether it has one or not."""
    entry = posts.Entry(ask.vehicle, ask.number, ask.then)
    return dataclasses.replace(post, kept=posts.Kept(ask.vehicle, ask.here, ask.stamp, post.probes, entry))


@pytest.mark.parametrize(
    "asked",
    [{"spacing": "hold"}, {"negotiation": "oldest"}, {"serve_after_s": 30.0}],
    ids=lambda one: next(iter(one)),
)
def test_what_sees_all_vehicles_is_refused(asked: dict[str, Any]) -> None:
    """Not accepted in silence."""
    with pytest.raises(ScenarioError, match="only what they sense and hear"):
        simulate(dataclasses.replace(CROWD, **asked))


def test_with_one_in_ten_lost_a_move_takes_little_more_than_six_messages() -> None:
    """Five and a half, if all are heard; six if each is said again until it is."""
    found = simulate(dataclasses.replace(CROWD, vehicles=140, duration_s=120.0))["by_messages"]
    assert found["moves"] > 500
    assert found["per_move"] < 6.5
    assert found["given_back"] < 0.0125 * found["moves"]  # twice as many if some do not see who goes first


def test_a_range_that_does_not_reach_over_a_crossing_is_refused() -> None:
    """With the range that it takes."""
    with pytest.raises(ScenarioError, match=r"range is 10 m; expected at least [0-9.]+ m"):
        simulate(dataclasses.replace(CROWD, decide="vehicles:range=10"))


@pytest.mark.parametrize("beside", ["departures", "stops", "others"])
def test_vehicles_that_come_later_or_stop_are_refused(beside: str) -> None:
    """In one line that says what works."""
    assembly: Any = SimpleNamespace(departures=(), stops={}, others=())
    build.check(CROWD, assembly)
    setattr(assembly, beside, ("one",))
    with pytest.raises(ScenarioError, match="decide: vehicles works with loops without stops"):
        build.check(CROWD, assembly)


def test_processes_decide_as_vehicles_in_one_process_do() -> None:
    """Over the wire nothing changes; a process that is killed comes back, and nobody collides."""
    few = dataclasses.replace(CROWD, vehicles=4, duration_s=40.0, decide="vehicles:delay=0.2")
    here = simulate(few)
    apart = simulate(dataclasses.replace(few, decide="processes:delay=0.2"))
    assert apart["by_messages"]["processes"] == 4
    assert here["by_messages"].items() <= apart["by_messages"].items()
    harm = "processes:delay=0.2,kill=2,kill_at=10,again=5,cut_at=20,cut=15"
    harmed = simulate(dataclasses.replace(few, decide=harm))
    assert (harmed["outcome"], harmed["clean"], harmed["by_messages"]["unsafe"]) == ("done", True, 0)
    assert harmed["by_messages"]["started_again"] == 2
    assert harmed["by_messages"]["cut_off"] > 0


def test_a_cut_parts_places_by_where_they_lie(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those in the east from those in the west, as many on each side; nobody speaks across while it lasts."""
    made = _kept(monkeypatch, DecisionsByMessages)
    cut = "vehicles:cut_at=10,cut=15"
    summary = simulate(dataclasses.replace(CROWD, vehicles=60, duration_s=40.0, decide=cut))
    assert (summary["outcome"], summary["clean"], summary["by_messages"]["unsafe"]) == ("done", True, 0)
    assert 0 < summary["by_messages"]["cut_off"] < 0.2 * summary["by_messages"]["messages"]
    (decisions,) = made
    side, places = decisions.radio.far_side, range(len(decisions.posts))
    assert 0.4 * len(places) < len(side) <= 0.5 * len(places)
    across = [pair for pair in decisions.where.over_m if (pair[0] in side) is not (pair[1] in side)]
    assert 0 < len(across) < 0.25 * len(decisions.where.over_m)  # by number it would be half of them


ORDER2 = Scenario(
    network=str(Path(GRID).parent / "order2.net.xml"),
    routes=str(Path(GRID).parents[1] / "routes" / "order2.rou.xml"),
    abstraction="segments",
    gate="algorithm2",
    duration_s=240.0,
)


@pytest.mark.parametrize("decide", ["vehicles", "vehicles:loss=0.1,delay=0.2"])
def test_algorithm2_is_decided_by_vehicles_and_none_goes_whom_the_gate_would_refuse(
    decide: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A vehicle is handed its loop and what monitors say; a monitor its segment; all of it is numbers."""
    made = _kept(monkeypatch, DecisionsOnSegments)
    summary = simulate(dataclasses.replace(ORDER2, decide=decide))
    assert (summary["outcome"], summary["audit"], summary["clean"]) == ("done", "clean", True)
    found = summary["by_messages"]
    assert found["unsafe"] == 0
    assert found["moves"] > 80
    assert found["by_kind"]["look"] > 50
    assert found["found_per_decision"] > 0.5
    assert found["bytes"] == sum(found["bytes_by_kind"].values())
    (decisions,) = made
    for car in decisions.cars:
        _numbers((car.stand, car.rears, car.untold))
    for monitor in decisions.monitors.values():
        _numbers(monitor)
    assert list(inspect.signature(survey.receive).parameters) == ["monitor", "message", "now_s"]
    assert list(inspect.signature(surveyor.decide).parameters) == ["me"]
