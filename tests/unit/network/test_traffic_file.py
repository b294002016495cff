"""Ordinary traffic is only looked into: names, and that there is some."""

from pathlib import Path

import pytest

from loopgate.errors import RouteError
from loopgate.network.traffic_file import Names, flows_in, read_traffic
from loopgate.network.vehicle_demand import Flow

ROUTES = """<routes>
    <vType id="bus" length="12"/>
    <trip id="a" depart="0" from="e" to="f"/>
    <flow id="b" begin="0" end="9" period="3" from="e" to="f"/>
    <vehicle id="c" depart="2"><route edges="e f"/></vehicle>
</routes>"""


def test_a_route_file(tmp_path: Path) -> None:
    """Vehicles, trips and flows count; their routes need not close."""
    file = tmp_path / "t.rou.xml"
    file.write_text(ROUTES)
    found = read_traffic(file)
    assert found.ids == {"a", "b", "c"}
    assert found.options() == ["--route-files", str(file)]
    found.check_names({"v1", "v2"})
    with pytest.raises(RouteError, match="vehicle c: a vehicle on a loop has that name too"):
        found.check_names({"v1", "c"})
    with pytest.raises(RouteError, match=r"vehicle b\.4: a vehicle on a loop has that name too"):
        found.check_names({"a.1", "c.4", "b.x", "b.4"})


def test_names_of_flows() -> None:
    """Its vehicles have the flow's name and a number; nobody knows how many are drawn at random."""
    names = Names(
        frozenset({"a", "b", "c"}), {"b": Flow(end_s=9.0, period_s=3.0), "c": Flow(probability=0.5)}
    )
    assert [name in names for name in ("a", "b", "b.1", "c.70", "a.0", "b.x", "d.0")] == [
        *4 * [True],
        *3 * [False],
    ]
    assert set(names.departing(8.0)) == {"a", "b.0", "b.1", "b.2", "c"}


@pytest.mark.parametrize(
    ("departs", "absent_at_s"), [("7:00:00", (0, 25199)), ("90.5", (0, 90)), ("90.5", (91, 200))]
)
def test_traffic_of_another_time_is_named(tmp_path: Path, departs: str, absent_at_s: tuple[int, int]) -> None:
    """Nobody of the morning is there at midnight; who departs at any time, or for long, may be."""
    file = tmp_path / "t.rou.xml"
    flows = {"": True, '<flow id="b" begin="30000"/>': True, '<flow id="b" begin="0" end="99999"/>': False}
    flows['<trip id="b" depart="triggered"/>'] = False
    for more, absent in flows.items():
        file.write_text(f'<routes><trip id="a" depart="{departs}"/>{more}</routes>')
        found = read_traffic(file)
        assert bool(found.absent(*absent_at_s)) == absent
        assert not found.absent(0, 25201)
    file.write_text(f'<routes><trip id="a" depart="{departs}"/></routes>')
    (said,) = read_traffic(file).absent(*absent_at_s)
    assert f"no vehicle departs from {absent_at_s[0]} to {absent_at_s[1]} s" in said


def test_a_configuration(tmp_path: Path) -> None:
    """Its route files and what they need besides."""
    (tmp_path / "t.rou.xml").write_text(ROUTES)
    config = tmp_path / "t.sumocfg"
    config.write_text(
        '<configuration><net-file value="n.net.xml"/><route-files value="t.rou.xml"/>'
        '<additional-files value="types.add.xml"/></configuration>'
    )
    found = read_traffic(config)
    assert found.ids == {"a", "b", "c"}
    assert found.additional_files == (tmp_path / "types.add.xml",)


def test_a_file_without_vehicles(tmp_path: Path) -> None:
    """Asking for traffic and getting none would be a surprise."""
    file = tmp_path / "t.rou.xml"
    file.write_text('<routes><route id="r" edges="e f"/></routes>')
    with pytest.raises(RouteError, match="no vehicles in it"):
        read_traffic(file)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<include/>", "it has an <include> without href"),
        ('<include href="a.xml"/>', "it includes 'a.xml', and that includes it again"),
        ('<include href="b.xml"/>', "b.xml: it includes 'a.xml', and that includes it again"),
    ],
)
def test_includes_on_which_sumo_ends_by_a_signal(tmp_path: Path, text: str, says: str) -> None:
    """In files that are SUMO's to read: without a name, or without end."""
    (tmp_path / "a.xml").write_text(f"<routes>{text}</routes>")
    (tmp_path / "b.xml").write_text('<routes><include href="a.xml"/></routes>')
    with pytest.raises(RouteError, match=says):
        flows_in([tmp_path / "a.xml"])


def test_flows_of_files_that_are_included_count(tmp_path: Path) -> None:
    """What cannot be read is for SUMO to judge, as an encoding that is none, or a file that is not there."""
    (tmp_path / "a.xml").write_text('<routes><include href="b.xml"/><include href="c.xml"/></routes>')
    (tmp_path / "b.xml").write_text('<routes><flow id="f" begin="0" end="9" number="7"/></routes>')
    (tmp_path / "e.xml").write_text('<?xml version="1.0" encoding="hex"?><routes/>')
    assert [name for name, _ in flows_in([tmp_path / "a.xml", tmp_path / "e.xml"])] == ["f"]
