"""Names of files, texts of XML, and values of GeoJSON that come from outside."""

import json
import xml.etree.ElementTree as ET

import numpy as np

from loopgate.export.formats import feature, file_names, geojson, gpx, kml


def test_names_become_files_of_their_own() -> None:
    """No way out of the folder, none twice on a disk that knows no capitals, none empty."""
    names = file_names(["a/../b", "../../etc", "Loop", "loop", "", "..", "Straße 1"])
    assert list(names.values()) == ["a-..-b", "etc", "Loop", "loop-2", "loop-3", "loop-4", "Straße-1"]


def test_what_is_no_number_is_nothing() -> None:
    """JSON knows neither NaN nor infinity."""
    line = np.array([[13.0, 52.0], [13.1, 52.1]])
    made = json.loads(geojson([feature(line, a=np.nan, b=np.inf, c=np.int64(3), d=np.float64(0.123456))]))
    assert made["features"][0]["properties"] == {"a": None, "b": None, "c": 3, "d": 0.1235}


def test_any_name_can_stand_in_xml() -> None:
    """Markup stays text; characters that XML cannot hold are replaced."""
    name, line = 'a<b>&"\x00\x0b', np.array([[13.0, 52.0], [13.1, 52.1]])
    turns = [(line[0], f"turn left into {name}", name)]
    for text in (gpx(name, line, turns), kml(name, line, turns)):
        words = "".join(ET.fromstring(text).itertext())
        assert 'a<b>&"\ufffd\ufffd' in words
