"""Gates and negotiations of any kind as the ledger asks them."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from random import Random

import pytest

from loopgate.control.ledger import Ledger
from loopgate.control.places import Place, Vehicle, path_of
from loopgate.control.refusal import Refusal
from loopgate.errors import PluginError
from loopgate.gates import Decision, Reason, make_gate
from loopgate.gates.base import refusal
from loopgate.model import Configuration, Robot, RobotId, StateId, System
from loopgate.negotiation.base import Request, View
from loopgate.negotiation.pressure import Pressure
from loopgate.simulation.asked_gate import AskedGate, Deciding, Negotiated

RING = tuple(StateId(name) for name in "abcd")


def ring(slots: int, starts: Sequence[int]) -> System:
    """Return robots that drive round four places, all first in line."""
    robots = [Robot(RobotId(f"v{n}"), RING, start=at) for n, at in enumerate(starts)]
    return System(robots, dict.fromkeys(RING, slots), RING)


def stand(ledger: Ledger, system: System) -> list[Vehicle]:
    """Let the robots of a system be vehicles of a ledger, and all ask."""
    path = path_of(
        [Place(str(name), room) for name, room in zip(system.states, system.room, strict=True)], closed=True
    )
    found = [ledger.take_in(str(robot.id), path, robot.start) for robot in system.robots]
    for vehicle in found:
        ledger.ask(vehicle)
    return found


def ask_again(ledger: Ledger) -> list[str]:
    """Let all ask that do not; return who goes in the next answer."""
    for vehicle in ledger.vehicles.values():
        ledger.ask(vehicle)
    return [vehicle.name for vehicle in ledger.answer()]


class Stubborn:
    """A gate of the user's that refuses one robot, and notes what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[Configuration, int]] = []
        self.asked: list[Configuration] = []

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Refuse robot 0."""
        self.asked.append(configuration)
        if robot == 0:
            return refusal(Reason.DEADLOCK, blockers=(1,))
        return Decision(admitted=True, reason=Reason.FREE, messages=2)

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Note a move."""
        self.told.append((configuration, robot))


def test_a_gate_of_the_users_decides_and_is_told_of_each_move() -> None:
    system = ring(2, [0, 2])
    gate = Stubborn()
    deciding = Deciding(system, gate, Pressure(Random(0)), 60.0)
    ledger = deciding.ledger([], step_s=1.0)
    first, second = stand(ledger, system)
    assert ledger.answer() == [second]
    assert (first.reason, ledger.refusals) == ("deadlock", {"deadlock": 1})
    assert [(told.positions, robot) for told, robot in gate.told] == [((0, 3), 1)]
    asked = deciding.asked
    assert asked is not None
    assert asked.blockers(first) == ["v1"]
    assert asked.messages == 2
    assert asked.times[""].count == 2
    ledger.answer()
    assert asked.times[""].count == 3  # once more, since one has moved
    ledger.answer()
    assert asked.times[""].count == 3
    assert gate.asked[-1].positions == (0, 3)
    assert ask_again(ledger) == ["v1"]


def test_what_a_gate_refuses_keeps_nothing_for_itself() -> None:
    system = ring(2, [0, 2])
    ledger = Deciding(system, Stubborn(), Pressure(Random(0)), 60.0).ledger([], step_s=1.0)
    first, _ = stand(ledger, system)
    ledger.answer(0.0)
    ledger.answer(100.0)
    assert first.blocked_s == 100.0
    assert first.leg.after is not None
    assert first.leg.after.place.kept_for is None


def test_the_chain_rule_alone_is_asked_by_the_ledger_itself() -> None:
    system = ring(2, [0, 2])
    orders = Pressure(Random(0), crowded=0.5, patience=7.0)
    for promise, serve_after_s in (("everyone", 60.0), ("somebody", inf)):
        deciding = Deciding(system, make_gate(f"certified:promise={promise}", system), orders, 60.0)
        ledger = deciding.ledger([], step_s=1.0)
        assert (deciding.asked, ledger.pressing) == (None, None)
        assert ledger.keeping.serve_after_s == serve_after_s


class Last:
    """A negotiation that lets the last request go, and looks at what it is shown."""

    def __init__(self) -> None:
        self.seen: list[tuple[list[int], int, int]] = []

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Let one go."""
        del now_s
        wanted = requests[-1].wanted
        self.seen.append(([r.robot for r in requests], view.held(wanted), view.room(wanted)))
        return requests[-1:]


def test_a_negotiation_orders_those_that_no_rule_refuses_and_those_left_out_ask_again() -> None:
    system = ring(3, [0, 2, 3])
    orders = Last()
    ledger = Deciding(system, make_gate("certified", system), orders, 60.0).ledger([], step_s=1.0)
    vehicles = stand(ledger, system)
    vehicles[1].stop_m = -inf  # it stops before its line
    gone = ledger.answer()
    assert len(gone) == 1
    assert vehicles[1].reason == "stop"
    left = next(vehicle for vehicle in (vehicles[0], vehicles[2]) if vehicle not in gone)
    assert left.reason == "reserve"
    robots, held, room = orders.seen[0]
    assert sorted(robots) == [0, 2]
    assert held + room == 3
    assert ledger.answer() == [left]


def test_one_that_must_move_next_goes_whatever_a_negotiation_says() -> None:
    system = ring(3, [0, 2, 3])
    negotiated = Negotiated(system, Last())
    ledger = Ledger([])
    first, second, third = stand(ledger, system)
    second.mover = True
    assert negotiated.order([first, second, third], 0.0) == [second, third]


class Broken(Last):
    """A negotiation whose order is none."""

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return a stranger."""
        del requests, view, now_s
        return [Request(99, 0, 1, 0.0)]


def test_what_a_users_negotiation_or_gate_does_wrong_is_told_by_name() -> None:
    system = ring(3, [0, 2])
    ledger = Deciding(system, make_gate("certified", system), Broken(), 60.0).ledger([], step_s=1.0)
    stand(ledger, system)
    with pytest.raises(PluginError, match="Broken: order returned"):
        ledger.answer()
    asked = AskedGate(system, Stubborn())
    assert isinstance(asked.allows(stand(Ledger([]), system)[0], 0.0), Refusal)
