"""Walks, safe and risky, on cases solved by hand."""

from __future__ import annotations

from pathlib import Path

import networkx as nx
import pytest

from loopgate.gates import Reason, make_gate
from loopgate.gates.algorithm2 import Holders, risky_walks, safe_walk
from loopgate.gates.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.theory.digraph import digraph, proposition1, write_graphml
from loopgate.research.theory.instances import instance, instance_names


def robot(name: str, path: str, *, closed: bool = True, start: int = 0) -> Robot:
    return Robot(RobotId(name), tuple(StateId(s) for s in path.split()), closed=closed, start=start)


def test_risky_walks_go_on_behind_an_occupied_state() -> None:
    """Fig. 3: r1 has w16 = s1 s2 s3 s4 and w12 = s1 s2 s3 s4 s5, with 2 and 3 intermediate states."""
    system = instance("fig3")
    walks = risky_walks(system, system.initial, 0)
    names = [" ".join(system.states[s] for s in walk.states) for walk in walks]
    assert names == ["s1 s2 s3 s4", "s1 s2 s3 s4 s5"]
    assert [len(walk.intermediate) for walk in walks] == [2, 3]


def test_look_ahead_ends_after_so_many_states() -> None:
    """With a look-ahead of 3 states r1 sees s4 and not s5."""
    system = instance("fig3")
    walks = risky_walks(system, system.initial, 0, lookahead=3)
    assert [system.states[walk.head] for walk in walks] == ["s4"]


def test_a_robot_at_home_has_no_risky_walk() -> None:
    """It blocks nobody."""
    system = System([robot("r1", "p a b"), robot("r2", "q b a", start=1)])
    assert risky_walks(system, system.initial, 0) == ()


def test_no_walk_ends_where_its_own_robot_stands() -> None:
    """r1 comes back to a in its round; that it stands there itself is no risk, that r2 stands in c is."""
    system = System([robot("r1", "a b a c"), robot("r2", "q a b c")])
    assert risky_walks(system, system.initial, 0) == ()
    walks = risky_walks(system, system.configuration((0, 3)), 0, lookahead=3)
    assert [[system.states[s] for s in walk.states] for walk in walks] == [["a", "b", "a", "c"]]


def test_safe_walk_needs_all_states_free() -> None:
    """From p over a and b home; with r2 in b it is gone."""
    system = System([robot("r1", "p a b"), robot("r2", "q b a")])
    walk = safe_walk(system, system.initial, 0)
    assert walk is not None
    assert [system.states[s] for s in walk.states] == ["p", "a", "b", "p"]
    assert safe_walk(system, system.configuration((0, 1)), 0) is None


def test_a_shared_end_is_safe_only_if_nobody_else_will_come() -> None:
    """Both end in e: r1 may not take it while r2 has to go there or pass; alone it may."""
    passing = System([robot("r1", "a e", closed=False), robot("r2", "b e c", closed=False)])
    assert safe_walk(passing, passing.initial, 0) is None
    assert safe_walk(passing, passing.configuration((0, 2)), 0) is not None


def test_states_of_several_robots_block_when_full() -> None:
    """Two in q and two in t, each pair waiting for the other: both block, and room in one frees both."""
    system = System(
        [robot("r1", "q t"), robot("r2", "q t"), robot("r3", "t q", start=0), robot("r4", "t q")],
        {StateId("q"): 2, StateId("t"): 2},
        [StateId("q"), StateId("t")],
    )
    full = system.initial
    q, t = system.states.index(StateId("q")), system.states.index(StateId("t"))
    held = Holders(system, full)
    assert (held.of(q), held.of(t)) == ((0,), (2,))
    assert deadlocked_robots(system, full) == {0, 1, 2, 3}
    roomy = System(system.robots[:3], {StateId("q"): 2, StateId("t"): 2}, [StateId("q"), StateId("t")])
    held = Holders(roomy, roomy.initial)
    assert (held.of(q), held.of(t)) == ((), ())
    assert not deadlocked_robots(roomy, roomy.initial)


def test_algorithm2_on_queues_refuses_the_last_slot_of_a_circle() -> None:
    """Three robots in two queues of two: who would fill the circle is refused, the others may go."""
    system = System(
        [
            robot("r1", "q t"),
            robot("r2", "q t"),
            robot("r3", "t q"),
            robot("r4", "p t q"),
        ],
        {StateId("q"): 2, StateId("t"): 2},
        [StateId("q"), StateId("t")],
    )
    gate = make_gate("algorithm2", system)
    refused = gate.decide(system.initial, 3)
    assert refused.reason is Reason.DEADLOCK
    assert gate.decide(system.initial, 0).admitted


def test_banker_refuses_without_a_safe_walk() -> None:
    """r1's way home leads through b, where r2 stands."""
    system = System([robot("r1", "p a b"), robot("r2", "q b c", start=1), robot("r3", "u c a")])
    refused = make_gate("banker", system).decide(system.initial, 0)
    assert refused.reason is Reason.DEADLOCK
    assert make_gate("banker", system).decide(system.initial, 1).admitted


def test_digraph_and_graphml(tmp_path: Path) -> None:
    """One edge per move, coloured by its robot; the file reads back as the same graph."""
    system = instance("fig8")
    graph = digraph(system)
    assert graph.number_of_edges() == sum(len(path) - 1 for path in system.paths)
    assert {data["robot"] for _, _, data in graph.out_edges(StateId("s4"), data=True)} == {"r1", "r2"}
    write_graphml(system, tmp_path / "fig8.graphml")
    again = nx.read_graphml(tmp_path / "fig8.graphml")
    assert nx.utils.graphs_equal(nx.DiGraph(again), nx.DiGraph(graph)) or set(again.edges()) == set(
        graph.edges()
    )


@pytest.mark.parametrize(
    "name", [n for n in instance_names() if not n.startswith(("oneway", "round8", "roads"))]
)
def test_instances_keep_proposition1(name: str) -> None:
    """No two states are neighbours on the paths of two robots; on yards and streets many are."""
    assert proposition1(instance(name)) == []


def test_proposition1_names_what_breaks_it() -> None:
    """A and b are neighbours for both robots, in either direction."""
    system = System([robot("r1", "p a b"), robot("r2", "q b a")])
    (found,) = proposition1(system)
    assert found.states == ("a", "b")
    assert found.robots == ("r1", "r2")


def test_homes_decide_liveness() -> None:
    """Not without private states on closed paths, and not where a closed path passes another robot's end."""
    assert homes_decide_liveness(instance("oneway8"))
    assert not homes_decide_liveness(System([robot("r1", "a b"), robot("r2", "b c a", start=1)]))
    assert not homes_decide_liveness(System([robot("r1", "p a b"), robot("r2", "c a", closed=False)]))
