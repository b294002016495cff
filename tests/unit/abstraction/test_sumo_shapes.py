"""Places, crossings and loops as SUMO's shapes."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from roads import polygon

from loopgate.abstraction.itinerary import Crossing, DrawnLeg, Itinerary
from loopgate.abstraction.sumo_shapes import write_shapes
from loopgate.errors import ResultsError
from loopgate.model import StateId

SQUARE = polygon("a:b", [(0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0)])
FREE, FOE = Crossing("m>n", frozenset()), Crossing("n>m", frozenset({"x>y"}))


def place(name: str, begin_m: float, end_m: float, *crossings: Crossing) -> DrawnLeg:
    return DrawnLeg(StateId(name), begin_m, end_m, crossings)


WAY = Itinerary(SQUARE, (place("p", 10.0, 40.0, FREE), place("q", 50.0, 190.0, FOE)))


def written(file: Path, *ways: Itinerary) -> dict[str, ET.Element]:
    count = write_shapes(file, ways, {"p": 4})
    shapes = {shape.attrib["id"]: shape for shape in ET.parse(file).getroot()}
    assert len(shapes) == count
    return shapes


def figures(shape: ET.Element) -> dict[str, str]:
    return {param.attrib["key"]: param.attrib["value"] for param in shape}


def test_each_kind_of_shape(tmp_path: Path) -> None:
    """Loop and its beginning, two places, two crossings; names without what netedit refuses."""
    shapes = written(tmp_path / "x.add.xml", WAY)
    assert list(shapes) == [
        "loop_a_b",
        "start_a_b",
        "place_p",
        "place_q",
        "crossing_p_to_q",
        "crossing_q_to_p",
    ]
    assert figures(shapes["place_p"]) == {"place": "p", "capacity": "4", "length_m": "30.0", "loops": "a:b"}
    assert shapes["start_a_b"].attrib["x"] == "0.00"


def test_places_are_areas_along_their_lane(tmp_path: Path) -> None:
    """From 10 to 40 m, 1.2 m to each side."""
    shape = written(tmp_path / "x.add.xml", WAY)["place_p"].attrib["shape"]
    points = {tuple(map(float, point.split(","))) for point in shape.split()}
    assert points == {(10.0, -1.2), (10.0, 1.2), (40.0, 1.2), (40.0, -1.2)}


def test_conflicts_are_seen_and_named(tmp_path: Path) -> None:
    """A crossing with foes has another colour than one without; over the loop's beginning too."""
    shapes = written(tmp_path / "x.add.xml", WAY)
    free, foe = shapes["crossing_p_to_q"], shapes["crossing_q_to_p"]
    assert free.attrib["color"] != foe.attrib["color"]
    assert figures(foe) == {"movements": "n>m", "conflicts": "x>y"}
    assert foe.attrib["shape"] == "0.00,10.00 0.00,0.00 10.00,0.00"


def test_what_loops_share_is_drawn_once(tmp_path: Path) -> None:
    """Two loops on the same way: two lines, the places and crossings of one, both named."""
    shapes = written(tmp_path / "x.add.xml", WAY, Itinerary(replace(SQUARE, id="other"), WAY.legs))
    assert [name for name in shapes if name.startswith(("place", "crossing"))] == [
        *("place_p", "place_q", "crossing_p_to_q", "crossing_q_to_p"),
    ]
    assert figures(shapes["place_q"])["loops"] == "a:b other"


def test_loops_that_cannot_work_are_marked_where_they_fail(tmp_path: Path) -> None:
    """With the reason, at the end of the edge to blame."""
    file = tmp_path / "x.add.xml"
    write_shapes(file, [], {}, [(SQUARE, "ends in a wall", "a:b.e1")])
    mark = next(shape for shape in ET.parse(file).getroot() if shape.attrib["id"] == "refused_a_b")
    assert (mark.attrib["x"], mark.attrib["y"]) == ("50.00", "50.00")
    assert figures(mark)["reason"] == "ends in a wall"


def test_a_file_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    """It names the file."""
    (tmp_path / "folder").mkdir()
    with pytest.raises(ResultsError, match="folder: cannot be written"):
        written(tmp_path / "folder", WAY)
