"""The air: settings as they are written, and messages that come, are lost, or are too far."""

from __future__ import annotations

from random import Random

import pytest

from loopgate.errors import ScenarioError
from loopgate.simulation.scenario import Scenario
from loopgate.vehicles.air import Air, AirSettings, read_decide


def test_settings_are_read() -> None:
    """Each option, and none."""
    assert read_decide("central") is None
    assert read_decide("vehicles") == AirSettings(150.0, 0.0, 0.1)
    assert read_decide("vehicles:range=80,loss=0.2,delay=0") == AirSettings(80.0, 0.2, 0.0)


@pytest.mark.parametrize(
    ("spec", "what"),
    [
        ("all", "decide is 'all'; expected central, vehicles:.* or processes"),
        ("vehicles:", "unknown option ''"),
        ("vehicles:speed=3", "unknown option 'speed'; its options are range, loss, delay"),
        ("vehicles:loss=1", "loss is '1'; expected a share from 0 to 0.95"),
        ("vehicles:delay=nan", "delay is 'nan'; expected seconds"),
        ("vehicles:range", "range is ''; expected metres"),
    ],
)
def test_what_is_none_is_refused(spec: str, what: str) -> None:
    """In one line that says what was found and what is expected."""
    with pytest.raises(ScenarioError, match=what):
        read_decide(spec)


@pytest.mark.parametrize(
    "more",
    [
        *({"gate": "open"}, {"abstraction": "segments"}, {"traffic": "some.rou.xml"}, {"gate": "banker"}),
        {"gate": "algorithm2"},
        {"gate": "algorithm2", "abstraction": "segments", "decide": "processes"},
    ],
)
def test_a_scenario_refuses_what_vehicles_cannot_decide(more: dict[str, str]) -> None:
    """Nothing that is asked for is ignored in silence."""
    with pytest.raises(ScenarioError, match="decide: vehicles works with gate certified on queues"):
        Scenario.from_dict({"network": "some.net.xml", "loops": 3, "decide": "vehicles"} | more)


def test_messages_come_after_each_stretch_or_not_at_all() -> None:
    """Two stretches take two delays; a stretch beyond the range ends it; all are counted."""
    air: Air[str] = Air(AirSettings(range_m=50.0, delay_s=1.0), Random(1))
    air.send(0.0, "far", [30.0, 60.0])
    air.send(0.0, "near", [30.0, 40.0])
    found = air.next(10.0)
    assert found is not None
    assert found[1] == "near"
    assert 1.0 <= found[0] <= 3.0
    assert air.next(10.0) is None
    assert (air.transmissions, air.beyond, air.lost, air.longest_m) == (4, 1, 0, 40.0)


def test_of_messages_sent_together_all_come_if_one_is_heard() -> None:
    """Their ends are joined by wire; where nobody hears, none comes."""
    air: Air[str] = Air(AirSettings(range_m=50.0, delay_s=1.0), Random(1))
    air.send_together(0.0, [("near", [30.0]), ("far", [60.0])])
    came = [air.next(2.0), air.next(2.0)]
    assert {one[1] for one in came if one} == {"near", "far"}
    air.send_together(2.0, [("far", [60.0]), ("farther", [70.0])])
    assert air.next(9.0) is None


def test_so_many_are_lost() -> None:
    """The share of transmissions that is asked for."""
    air: Air[int] = Air(AirSettings(loss=0.3, delay_s=0.0), Random(1))
    for n in range(1000):
        air.send(0.0, n, [1.0])
    assert 250 < air.lost < 350
