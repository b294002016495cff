"""Certificates show what they claim, and a certificate that was tampered with does not pass."""

from __future__ import annotations

import random
from collections import Counter
from typing import Any

import pytest

from loopgate.errors import GateError
from loopgate.gates.certified import CertifiedGate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.theory.certificates import CertificateError, check_certificate
from loopgate.research.theory.instances import fig7, instance
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.random_systems import any_system


def _certificates(
    system: System, seed: int, *, steps: int = 30, promise: str = "auto"
) -> list[dict[str, Any]]:
    """Return all certificates along a random walk."""
    gate = CertifiedGate(system, promise=promise, budget=100_000)
    rng, here, found = random.Random(seed), system.initial, []
    for _ in range(steps):
        for robot in range(len(system.robots)):
            certificate = gate.certificate(here, robot)
            if certificate is not None:
                found.append(certificate)
        admitted = [i for i in range(len(system.robots)) if gate.decide(here, i).admitted]
        if not admitted:
            break
        robot = rng.choice(admitted)
        here = system.move(here, robot)
        gate.moved(here, robot)
    return found


@pytest.mark.parametrize("promise", ["auto", "somebody"])
def test_all_certificates_hold(promise: str) -> None:
    """Along walks in random systems, every certificate passes, and every enabled move has one."""
    kinds: Counter[str] = Counter()
    for seed in range(120):
        system = any_system(seed, robots=(3, 6))
        try:
            found = _certificates(system, seed, promise=promise)
        except GateError:
            continue
        for certificate in found:
            check_certificate(system, certificate)
            kinds[certificate["kind"]] += 1
    wanted = {"home", "round", "chain", "wait", "dead"} if promise == "auto" else {"rest", "wait"}
    assert wanted <= set(kinds)


def test_full_places_that_wait_for_one_another() -> None:
    """Full c wants into b, b has one slot and wants into c: r1 must not take that slot."""
    a, b, c = (StateId(s) for s in "abc")
    paths = {"r1": (a, b), "r2": (a, b), "r3": (b, c), "r4": (c, b), "r5": (c, b)}
    system = System(
        [Robot(RobotId(name), path) for name, path in paths.items()], dict.fromkeys((a, b, c), 2), [a, b, c]
    )
    gate = CertifiedGate(system, promise="somebody")
    assert [gate.decide(system.initial, i).admitted for i in (0, 2, 3)] == [False, False, True]
    certificate = gate.certificate(system.initial, 0)
    assert certificate is not None
    assert (certificate["kind"], sorted(certificate["places"])) == ("full", ["b", "c"])
    check_certificate(system, certificate)
    with pytest.raises(CertificateError, match="wait for one another"):
        check_certificate(system, {**certificate, "places": ["b"]})
    with pytest.raises(CertificateError, match="slot left"):
        check_certificate(system, {**certificate, "kind": "reserved", "place": "b"})


def _ring(narrow: int) -> System:
    """Return a ring of eight places that hold two, but for some that hold one; robots start in seven."""
    path = tuple(StateId(s) for s in "abcdefgh")
    robots = [Robot(RobotId(f"r{i}"), path, start=i) for i in range(7)]
    return System(robots, dict.fromkeys(path[: 8 - narrow], 2), path)


def test_a_slot_free_everywhere_is_shown() -> None:
    """Where one place holds one and nobody has a home; moves that do not lead there show nothing."""
    system = _ring(narrow=1)
    found = _certificates(system, 1, steps=40)
    assert {c["kind"] for c in found} >= {"room"}
    for certificate in found:
        check_certificate(system, certificate)
    long = next(c for c in found if c["kind"] == "room" and len(c["moves"]) > 1)
    with pytest.raises(CertificateError, match="no slot free in the end"):
        check_certificate(system, {**long, "moves": long["moves"][:1]})
    with pytest.raises(CertificateError, match="do not begin with"):
        check_certificate(system, {**long, "moves": long["moves"][1:]})
    with pytest.raises(CertificateError, match="not enough for everyone"):
        check_certificate(system, {**long, "kind": "chain"})


def test_the_chain_is_enough_only_without_a_crowd() -> None:
    """Three residents in four slots, through which one passes: no circle, and yet not for everyone."""
    a, b, c = (StateId(s) for s in "abc")
    for residents, enough in ((2, True), (3, False)):
        robots = [Robot(RobotId(f"r{n}"), (b, c), start=n % 2) for n in range(residents)]
        system = System(
            [*robots, Robot(RobotId("commuter"), (a, b, c))], dict.fromkeys((a, b, c), 2), (a, b, c)
        )
        gate = CertifiedGate(system, promise="everyone" if enough else "somebody")
        shown = gate.certificate(system.initial, 0)
        assert shown is not None
        shown = {**shown, "kind": "chain"}
        if enough:
            check_certificate(system, shown)
        else:
            with pytest.raises(CertificateError, match="not enough for everyone"):
                check_certificate(system, shown)


def test_deep_deadlocks_are_proved() -> None:
    """The first unsafe move of the Fig. 7 family is refused with a proof of dead cores, not with a circle."""
    for robots in (5, 8):
        system = _from_home(fig7(robots))
        found = [c for seed in range(20) for c in _certificates(system, seed, steps=60)]
        proofs = [c for c in found if c["kind"] == "dead"]
        assert proofs
        for certificate in proofs:
            check_certificate(system, certificate)


def _from_home(system: System) -> System:
    """Let every robot begin in a state of its own, one before where it began."""
    return System(
        Robot(robot.id, (StateId(f"{robot.id}_start"), *robot.path), closed=False) for robot in system.robots
    )


def _refusals(kind: str) -> tuple[System, list[dict[str, Any]]]:
    system = instance("unsound_n5")
    found = [c for seed in range(30) for c in _certificates(system, seed) if c["kind"] == kind]
    assert found
    return system, found


def test_a_refusal_is_the_oracles() -> None:
    """Moves refused with a proof are unsafe by the oracle."""
    system, found = _refusals("dead")
    oracle = Oracle(system)
    for certificate in found:
        here = system.configuration(certificate["positions"])
        assert not oracle.safe(here, system.robot_number(certificate["robot"]))


def test_a_proof_with_a_line_left_out_fails() -> None:
    """Leaving out what a line refers to, or turning a line into a claim, is noticed."""
    system, found = _refusals("dead")
    for certificate in found[:20]:
        proof = certificate["proof"]
        if len(proof) > 1:
            with pytest.raises(CertificateError):
                check_certificate(system, {**certificate, "proof": proof[1:]})
        for n, line in enumerate(proof):
            claim = {**{k: line[k] for k in ("at", "order")}, "moves": {}}
            if not (line.get("moves") or line.get("harmless")):
                continue  # nobody can move there, so the claim is true
            with pytest.raises(CertificateError):
                check_certificate(system, {**certificate, "proof": [*proof[:n], claim, *proof[n + 1 :]]})


@pytest.mark.parametrize("change", ["drop", "swap verdict", "foreign robot", "unfinished"])
def test_a_witness_that_was_changed_fails(change: str) -> None:
    """Moves left out, another verdict, another robot, an end not at home: none passes."""
    system = instance("unsound_n5")
    certificate = max(
        (c for c in _certificates(system, 1) if c["kind"] == "home"), key=lambda c: len(c["moves"])
    )
    check_certificate(system, certificate)
    changed = {
        "drop": {**certificate, "moves": certificate["moves"][:-1]},
        "swap verdict": {**certificate, "verdict": "refused"},
        "foreign robot": {
            **certificate,
            "robot": next(r.id for r in system.robots if r.id != certificate["robot"]),
        },
        "unfinished": {**certificate, "moves": certificate["moves"][:1]},
    }[change]
    with pytest.raises(CertificateError):
        check_certificate(system, changed)


def test_a_circle_has_to_come_back() -> None:
    """Two robots on one ring: the circle moves both and leads back; a part of it shows nothing."""
    ring = tuple(StateId(s) for s in "abcd")
    system = System([Robot(RobotId("r1"), ring, start=0), Robot(RobotId("r2"), ring, start=2)])
    certificate = _certificates(system, 1, steps=1)[0]
    assert certificate["kind"] == "round"
    check_certificate(system, certificate)
    with pytest.raises(CertificateError, match=r"does not lead back|not move in the circle"):
        check_certificate(system, {**certificate, "circle": certificate["circle"][:-1]})
    with pytest.raises(CertificateError, match="does not move in the circle"):
        check_certificate(system, {**certificate, "circle": []})
    with pytest.raises(CertificateError, match="go on for ever"):
        check_certificate(system, {**certificate, "verdict": "refused", "kind": "exhausted"})


def test_nonsense_is_refused_in_one_line() -> None:
    """Missing keys, unknown robots and impossible configurations are errors of the package's own."""
    system = instance("unsound_n5")
    good = _certificates(system, 1, steps=1)[0]
    for bad in (
        {},
        {**good, "robot": "nobody"},
        {**good, "positions": [99] * 5},
        {**good, "positions": good["positions"][:2]},
        {**good, "kind": "because"},
        {**good, "moves": 3},
    ):
        with pytest.raises(CertificateError):
            check_certificate(system, bad)
