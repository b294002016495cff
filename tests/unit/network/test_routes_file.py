"""Route files: every way to write a loop, and every way to get it wrong."""

from __future__ import annotations

import gzip
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from roads import roads

from loopgate.errors import LoopgateError, NetworkError, NobodyGatedError, RouteError
from loopgate.network import RoadNetwork, VehicleType, make_loop, read_loops, read_sumo_config, write_loops
from loopgate.network.vehicle_type import vehicle_type

NET = roads(
    {"a": (100, 1), "b": (50, 1), "c": (100, 1)}, ["a_0>b_0", "b_0>a_0", "b_0>c_0", "c_0>a_0"], buses_only=[]
)


def routes(tmp_path: Path, inside: str, name: str = "x.rou.xml") -> Path:
    file = tmp_path / name
    file.write_text(f"<routes>{inside}</routes>", encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "text",
    [
        '<route id="r" edges="a b c"/>',
        '<route id="r" edges="a b c a"/>',  # as netedit draws it
        '<route id="r" edges="a b c" repeat="10"/>',
        '<route id="r" edges="a b c a b c"/>',
        '<vehicle id="r" depart="0"><route edges="a b c"/></vehicle>',
        '<flow id="r" begin="0" number="1"><route edges="a b c a"/></flow>',
        '<routeDistribution id="d"><route id="r" edges="a b c"/></routeDistribution>',
    ],
)
def test_ways_to_write_a_loop(tmp_path: Path, text: str) -> None:
    """All of them are one loop of three edges and 250 m."""
    found = read_loops(NET, routes(tmp_path, text))
    assert [(loop.id, loop.edges, loop.length_m) for loop in found.loops] == [("r", ("a", "b", "c"), 250.0)]


def test_gzipped(tmp_path: Path) -> None:
    """Gzip is recognised by content."""
    plain = routes(tmp_path, '<route id="r" edges="a b"/>')
    packed = tmp_path / "packed.rou.xml.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    assert read_loops(NET, packed).loops == read_loops(NET, plain).loops


def test_vehicles_keep_type_and_place(tmp_path: Path) -> None:
    """Types may stand anywhere in the file; departPos counts on the edge that departEdge numbers."""
    text = (
        '<route id="r" edges="a b c"/>'
        '<vehicle id="one" type="van" route="r" depart="0" departPos="20" departEdge="2"/>'
        '<vehicle id="two" route="r" depart="0" departPos="base"/>'
        '<vType id="van" length="7" minGap="1.5" color="red"/>'
    )
    found = read_loops(NET, routes(tmp_path, text))
    one, two = found.vehicles
    assert one.type == VehicleType(
        "van", 7.0, 1.5, attributes={"id": "van", "length": "7", "minGap": "1.5", "color": "red"}
    )
    assert (one.loop.id, one.depart_m, two.depart_m) == ("r", 170.0, None)
    assert found.longest_vehicle() == (7.0, 2.5)


def test_a_bus_may_use_bus_lanes(tmp_path: Path) -> None:
    """The class of the vehicle's type decides what is open; its default length is SUMO's for the class."""
    net = roads({"a": (100, 1)}, ["a_0>a_0"], buses_only=["a_0"])
    text = '<vType id="t" vClass="bus"/><vehicle id="v" type="t" depart="0"><route edges="a"/></vehicle>'
    assert read_loops(net, routes(tmp_path, text)).longest_vehicle() == (12.0, 2.5)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    """Ids with XML's own characters survive, and so does a note with hyphens."""
    loops = [make_loop(NET, 'a<b & "c"', ["a", "b"]), make_loop(NET, "r", ["c", "a", "b"])]
    file = tmp_path / "deep" / "x.rou.xml"
    write_loops(loops, file, note="made --so")
    assert read_loops(NET, file).loops == tuple(loops)


def test_sumo_configuration(tmp_path: Path) -> None:
    """Files are relative to the configuration; short option names count too."""
    routes(tmp_path, '<route id="r" edges="a b"/>', "one.rou.xml")
    routes(tmp_path, '<route id="s" edges="a b c"/>', "two.rou.xml")
    file = tmp_path / "x.sumocfg"
    file.write_text(
        '<configuration><input><n value="../n.net.xml"/><route-files value="one.rou.xml, two.rou.xml"/>'
        "</input></configuration>",
        encoding="utf-8",
    )
    assert read_sumo_config(file).net_file == tmp_path / ".." / "n.net.xml"
    assert [loop.id for loop in read_loops(NET, file).loops] == ["r", "s"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('<route id="r" edges="a c"/>', r"x\.rou\.xml: route r: edge a does not lead to edge c"),
        ('<route id="r" edges=""/>', "route r: it lists no edges"),
        ('<route id="r" edges="a b"/><route id="r" edges="a b c"/>', "route r: the id is used twice"),
        ("", "no routes in it"),
        ('<trip id="t" depart="0" from="a" to="b"/>', "trip t: it has no route"),
        ('<vehicle id="v" depart="0" route="x"/>', "vehicle v: its route x is in no route file"),
        ('<vType id="t" length="long"/><route id="r" edges="a b"/>', "vType t: length is 'long'; expected m"),
    ],
)
def test_bad_routes(tmp_path: Path, text: str, found: str) -> None:
    """One line that names file, route and edge."""
    with pytest.raises(RouteError, match=found) as error:
        read_loops(NET, routes(tmp_path, text))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (None, "there is no such file"),
        (b"", "the file is empty"),
        (b"not xml", "not XML"),
        (b"<routes><route", "not XML"),
        (b"<net/>", "the root element is <net>; a SUMO route file has <routes>"),
        (b"\x1f\x8b broken", "not XML"),
    ],
)
def test_bad_route_files(tmp_path: Path, content: bytes | None, found: str) -> None:
    """Files that are no route files."""
    file = tmp_path / "x.rou.xml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(RouteError, match=found):
        read_loops(NET, file)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (None, "there is no such file"),
        (b"", "the file is empty"),
        (b"{}", "not XML"),
        (b"<routes/>", "the root element is <routes>; a SUMO network has <net>"),
        (b'<net version="1.20"><a></net>', "not a SUMO network that can be read"),
        (b'<net version="1.20"><edge/></net>', "edge: it has no id; repair it in netedit or build it anew"),
        (b'<net version="1.20"></net>', "the network has no edges"),
        (b"<net></net>", "not a SUMO network that can be read .KeyError"),
    ],
)
def test_bad_networks(tmp_path: Path, content: bytes | None, found: str) -> None:
    """Files that are no networks."""
    file = tmp_path / "x.net.xml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(NetworkError, match=found) as error:
        RoadNetwork.open(file)
    assert "\n" not in str(error.value)


def test_a_folder_is_no_network(tmp_path: Path) -> None:
    """A folder is named as one."""
    with pytest.raises(NetworkError, match="a folder, not a SUMO network"):
        RoadNetwork.open(tmp_path)


def test_a_configuration_without_files(tmp_path: Path) -> None:
    """Missing parts of a configuration are named."""
    file = tmp_path / "x.sumocfg"
    file.write_text("<configuration/>", encoding="utf-8")
    with pytest.raises(LoopgateError, match="the configuration names no network"):
        RoadNetwork.open(file)
    file.write_text('<configuration><net-file value="n"/></configuration>', encoding="utf-8")
    with pytest.raises(NobodyGatedError, match="names no route files"):
        read_loops(NET, file)
    (tmp_path / "r.rou.xml").write_text('<routes><route id="r" edges="b c"/></routes>')
    file.write_text('<configuration><net-file value="n"/><route-files value="r.rou.xml"/></configuration>')
    with pytest.raises(NobodyGatedError, match="is gated: it has no vehicles"):
        read_loops(NET, file)


@pytest.mark.parametrize(
    ("attributes", "jointed"),
    [
        ({"vClass": "trailer"}, True),
        ({"vClass": "trailer", "guiShape": "truck"}, False),
        ({"guiShape": "truck/semitrailer"}, True),
        ({"guiShape": "bus/flexible"}, True),
        ({"vClass": "bus", "length": "18", "locomotiveLength": "9"}, True),
        ({"vClass": "bus"}, False),
        ({}, False),
    ],
)
def test_which_vehicles_bend(attributes: dict[str, str], jointed: bool) -> None:  # noqa: FBT001  a case
    """As SUMO draws them: by class, shape, or length of the first part."""
    assert vehicle_type(ET.Element("vType", {"id": "t", **attributes}), "file").jointed is jointed


OWN = """<routes>
    <vType id="car" color="red"><param key="has.rerouting.device" value="true"/></vType>
    <route id="r" edges="{edges}" repeat="5" cycleTime="60">
        <stop lane="a_0" duration="20" started="3"/></route>
    <vehicle id="a" type="car" route="r" depart="30" departPos="12" color="blue">
        <stop lane="b_0" duration="20"><param key="x" value="y"/></stop><param key="x" value="y"/>
    </vehicle>
    <vehicle id="b" type="car" route="r" depart="0" departPos="random" departSpeed="max"/>
    <flow id="f" type="car" route="r" begin="0" end="3600" number="5" arrivalPos="2"/>
    <person id="p" depart="0"><walk edges="A0B0"/></person>
</routes>"""


@pytest.mark.parametrize("root", ["trips", "additional"])
def test_other_roots_that_sumo_takes(root: str, tmp_path: Path) -> None:
    """Files of trips have one of their own, as SUMO's tools write them."""
    file = routes(tmp_path, '<route id="r" edges="a b c"/><vehicle id="v" route="r" depart="0"/>')
    file.write_text(file.read_text().replace("routes>", f"{root}>"))
    assert [one.id for one in read_loops(NET, file).vehicles] == ["v"]


def test_a_route_that_nobody_drives_may_be_broken(tmp_path: Path) -> None:
    """It is left out, with the reason; without vehicles each route is a loop, and a broken one is refused."""
    file = tmp_path / "x.rou.xml"
    broken = '<route id="r" edges="a b c"/><route id="bad" edges="a c"><stop edge="c" duration="1"/></route>'
    file.write_text(f'<routes>{broken}<vehicle id="v" route="r" depart="0"/></routes>')
    read = read_loops(NET, file)
    assert [loop.id for loop in read.loops] == ["r"]
    assert any("bad: edge a does not lead to edge c" in one and "left out" in one for one in read.left_out)
    file.write_text(f"<routes>{broken}</routes>")
    with pytest.raises(RouteError, match="bad: edge a does not lead to edge c"):
        read_loops(NET, file)


def test_a_type_may_stand_in_the_network(tmp_path: Path) -> None:
    """SUMO takes it from there; what the route file says goes first, and a name in neither is refused."""
    net = tmp_path / "n.net.xml"
    net.write_text(GRID.read_text().replace("</net>", '<vType id="van" length="6.5"/></net>'))
    file = tmp_path / "x.rou.xml"
    for own, length_m in (("", 6.5), ('<vType id="van" length="7"/>', 7.0)):
        file.write_text(f"<routes>{own}{ROUND}{VAN.format('van')}</routes>")
        assert read_loops(RoadNetwork.open(net), file).vehicles[0].type.length_m == length_m
    file.write_text(f"<routes>{ROUND}{VAN.format('truck')}</routes>")
    with pytest.raises(RouteError, match="its type 'truck' is no <vType>"):
        read_loops(RoadNetwork.open(net), file)


GRID = Path(__file__).parents[3] / "networks" / "grid5-priority.net.xml"
ROUND = '<route id="r" edges="A0A1 A1B1 B1B0 B0A0"/>'
VAN = '<vehicle id="v" route="r" depart="0" type="{}"/>'


def test_what_sumo_does_not_know_of_types_is_said(tmp_path: Path) -> None:
    """With the number of types that have it; an attribute of a model of car following is known."""
    kinds = '<vType id="a" bogus="3" stepping="1" carFollowModel="IDM"/><vType id="b" bogus="4" tau="1.5"/>'
    file = tmp_path / "x.rou.xml"
    file.write_text(
        f'<routes>{kinds}<route id="r" edges="a b c"/><vehicle id="v" route="r" depart="0"/></routes>'
    )
    said = [line for line in read_loops(NET, file).left_out if "vType" in line]
    said = [line.removeprefix(f"{file}: ") for line in said]
    assert said == [
        "SUMO has no attribute bogus of <vType> (2 times, first in vType a)",
    ]


def test_what_is_left_out_is_said_once_for_each_kind(tmp_path: Path) -> None:
    """With how often, where first, and what happens instead; what is done anyway needs no words."""
    file = tmp_path / "own.rou.xml"
    file.write_text(OWN.format(edges="a b c"), encoding="utf-8")
    read = read_loops(NET, file)
    said = {line.removeprefix(f"{file}: ") for line in read.left_out}
    assert said == {
        "repeat of <route> is left out (once, in route r): every loop is driven round and round",
        "started of <stop> is left out (once, in stop): it is what SUMO writes",
        "<param> is left out (once, in stop)",
        "departPos of <vehicle> is left out (once, in vehicle b): a vehicle departs where its place has room",
        "departSpeed of <vehicle> is left out (once, in vehicle b): vehicles start from rest",
        "arrivalPos of <flow> is left out (once, in flow f): nobody arrives on a closed loop",
    }
    assert [line.partition(" is left out")[0] for line in read.left_out_of_routes] == [
        f"{file}: repeat of <route>",
        f"{file}: started of <stop>",
    ]
    assert read.types["car"].parameters == {"has.rerouting.device": "true"}


def test_a_type_that_is_not_in_the_file_is_refused(tmp_path: Path) -> None:
    """It was an ordinary car before, whatever was meant."""
    file = tmp_path / "own.rou.xml"
    file.write_text(
        '<routes><vType id="car"/><route id="r" edges="a b c"/>'
        '<vehicle id="a" type="bus" route="r" depart="0"/></routes>',
        encoding="utf-8",
    )
    with pytest.raises(
        RouteError, match=r"vehicle a: its type 'bus' is no <vType> of the route files or .*; they define car"
    ):
        read_loops(NET, file)


def test_the_older_way_to_write_a_model_of_car_following_counts() -> None:
    """SUMO takes it, so its figures are looked at as those of attributes."""
    kind = ET.fromstring('<vType id="t"><carFollowing-IDM tau="0.4"/></vType>')
    assert vehicle_type(kind, "file").attributes == {"id": "t", "carFollowModel": "IDM", "tau": "0.4"}


@pytest.mark.parametrize("root", ["configuration", "sumoConfiguration"])
def test_both_names_of_a_configuration_are_read(root: str, tmp_path: Path) -> None:
    """SUMO's own scenarios have the second."""
    file = tmp_path / "x.sumocfg"
    file.write_text(f'<{root}><input><net-file value="n.net.xml"/></input></{root}>', encoding="utf-8")
    assert read_sumo_config(file).net_file == tmp_path / "n.net.xml"
