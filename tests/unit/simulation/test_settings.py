"""What vehicle types and steps a gate takes."""

from __future__ import annotations

import re

import pytest

from loopgate.errors import ScenarioError
from loopgate.network import RoadNetwork, VehicleType, find_loops
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import check_types, unforeseen, why_ignoring, why_unsafe


@pytest.mark.parametrize(
    ("step_s", "attributes"),
    [
        (1.0, {}),
        (1.0, {"carFollowModel": "Krauss", "tau": "1.0", "actionStepLength": "1"}),
        (1.0, {"carFollowModel": "KraussOrig1", "actionStepLength": "0.5"}),
        (1.0, {"carFollowModel": "Daniel1", "tau": "2", "sigma": "0"}),
        (0.5, {"tau": "0.5", "actionStepLength": "0.5"}),
        (0.1, {"jmIgnoreJunctionFoeProb": "0", "jmDriveAfterRedTime": "-1", "jmDriveRedSpeed": "3"}),
        (1.0, {"jmDriveAfterYellowTime": "5", "jmIgnoreFoeProb": "1", "jmIgnoreFoeSpeed": "9"}),
        (1.0, {"carFollowModel": "IDM"}),
        (1.0, {"carFollowModel": "EIDM", "decel": "3"}),
        (1.0, {"carFollowModel": "ACC", "decel": "0.8"}),
    ],
)
def test_what_keeps_clear_is_taken(step_s: float, attributes: dict[str, str]) -> None:
    """Types that were measured clean, and what SUMO makes of a type that says nothing."""
    check_types(
        {VehicleType("bus", attributes=attributes): 13.9}, step_s=step_s, obeys=True, source="r.rou.xml"
    )


@pytest.mark.parametrize(
    ("step_s", "attributes", "words"),
    [
        (1.0, {"carFollowModel": "CACC"}, "carFollowModel CACC does not keep clear .*; use one of Krauss, "),
        (1.0, {"carFollowModel": "Nobody"}, "carFollowModel Nobody"),
        (1.0, {"tau": "0.9"}, "tau 0.9 is below the step of 1 s: .* --step-length 0.9"),
        (1.0, {"actionStepLength": "2"}, "actionStepLength 2 is above the step of 1 s"),
        (0.5, {"actionStepLength": "1"}, "actionStepLength 1 is above the step of 0.5 s"),
        (1.0, {"jmIgnoreJunctionFoeProb": "0.1"}, "jmIgnoreJunctionFoeProb lets it drive into"),
        (
            1.0,
            {"jmDriveAfterRedTime": "3"},
            "jmDriveAfterRedTime lets it drive at red where lights are obeyed",
        ),
        (1.0, {"sigma": "?", "tau": "0.25"}, "tau 0.25"),
        (
            1.0,
            {"carFollowModel": "IDM", "decel": "1.5"},
            "carFollowModel IDM with decel 1.5 .*; give decel 2",
        ),
        (1.0, {"carFollowModel": "EIDM", "decel": "2"}, "carFollowModel EIDM with decel 2 .*; give decel 3"),
    ],
)
def test_what_comes_too_near_is_refused(step_s: float, attributes: dict[str, str], words: str) -> None:
    """By file, type and attribute, in one line with the way out."""
    kinds = {VehicleType("car"): 13.9, VehicleType("bus", attributes=attributes): 20.0}
    with pytest.raises(ScenarioError, match=f"^r.rou.xml: vType bus: {words}.*, or --gate open$"):
        check_types(kinds, step_s=step_s, obeys=True, source="r.rou.xml")


@pytest.mark.parametrize("aware", ["0.9", "?"])
def test_who_sees_badly_is_refused(aware: str) -> None:
    """Such drivers misjudge how far others are away; SUMO's own value is 1."""
    for value, words in (
        (aware, f"initialAwareness {re.escape(aware)} lets it brake too late"),
        ("1.00", ""),
    ):
        parameters = {"device.driverstate.initialAwareness": value}
        kind = VehicleType("bus", parameters=parameters)
        for why in (why_ignoring(parameters), why_unsafe(kind, 1.0, 13.9, obeys=False)):
            assert bool(why) == bool(words)
            assert re.search(words, why)


def test_who_drives_at_red_is_taken_where_no_light_counts() -> None:
    """With lights off, nobody relies on a driver who stops at red."""
    kinds = {VehicleType("bus", attributes={"jmDriveAfterRedTime": "3"}): 13.9}
    check_types(kinds, step_s=1.0, obeys=False, source="r.rou.xml")


def test_long_steps_are_for_no_gate() -> None:
    """Above a second SUMO's vehicles drive into each other, whatever a gate does."""
    with pytest.raises(ScenarioError, match=r"step_s is 1.5; expected at most 1 under a gate"):
        Scenario(network="n", step_s=1.5)
    assert Scenario(network="n", step_s=1.5, gate="open").step_s == 1.5


@pytest.fixture(scope="module")
def bs3d() -> RoadNetwork:
    return RoadNetwork.open("sumo:bs3d")


@pytest.mark.parametrize(
    ("attributes", "words"),
    [
        ({}, ""),
        ({"carFollowModel": "Daniel1", "accel": "3.5", "maxSpeed": "50", "speedFactor": "1.5"}, ""),
        ({"speedFactor": "normc(1,0.1,0.2,2)", "tau": "2", "decel": "9", "sigma": "0"}, ""),
        ({"accel": "8", "length": "18"}, ""),
        ({"maxSpeed": "3"}, ""),
        ({"speedFactor": "0.5", "speedDev": "0.4"}, ""),
        ({"sigma": "1"}, "sigma 1"),
        ({"carFollowModel": "IDM"}, "carFollowModel IDM"),
        ({"desiredMaxSpeed": "4"}, "desiredMaxSpeed 4 where"),
        ({"jmSigmaMinor": "1"}, "accel 2.6 with jmSigmaMinor 1"),
        ({"jmStoplineGap": "1", "jmStoplineGapMinor": "9"}, ""),
        ({"jmStoplineGap": "2"}, "jmStoplineGap 2 where lights are obeyed"),
    ],
)
def test_of_whom_nothing_is_foreseen(bs3d: RoadNetwork, attributes: dict[str, str], words: str) -> None:
    """One warning for the type that is not as SUMO's cars are, none for those that are."""
    loops = find_loops(bs3d, 4).loops
    users = [(loop, VehicleType("car")) for loop in loops]
    found = unforeseen(bs3d, [*users, (loops[0], VehicleType("odd", attributes=attributes))], obeys=True)
    assert list(found) == ["odd"] * bool(words)
    if words:
        assert re.match(f"vType odd: {words}.*: nothing is foreseen of them on crossings", found["odd"])


def test_classes_with_dynamics_of_their_own(bs3d: RoadNetwork) -> None:
    """SUMO gives bicycles a desired speed that it does not tell; it tells all of buses and motorcycles."""
    (loop,) = find_loops(bs3d, 1).loops
    usual = [(loop, VehicleType(kind, vclass=kind)) for kind in ("bus", "motorcycle")]
    early = (loop, VehicleType("early", attributes={"jmStoplineGap": "5"}))
    assert not unforeseen(bs3d, [*usual, early], obeys=False)
    found = unforeseen(bs3d, [(loop, VehicleType("b", vclass="bicycle"))], obeys=False)
    assert "vClass bicycle" in found["b"]
