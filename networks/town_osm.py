"""Makes town.osm: a small town as OpenStreetMap would hold it, so that the tutorial needs no network.

Seven streets east to west, six north to south, bent a little; a main road with lights, a one-way pair, a
residential quarter, a footpath that no car may use. It is nobody's town and free of anybody's rights.
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

FILE = Path(__file__).with_name("town.osm")
COLUMNS, ROWS = 6, 7
WEST, SOUTH = 13.0, 52.0
EAST_PER_M = 1 / (111_320 * math.cos(math.radians(SOUTH)))
NORTH_PER_M = 1 / 111_320
MAIN_ROW, MAIN_COLUMN = 3, 2


def node_id(column: int, row: int) -> int:
    """Return the number of a junction."""
    return 100 + 10 * row + column


def place(column: int, row: int) -> tuple[float, float]:
    """Return where a junction is [m]: blocks of 110 to 150 m, streets that bend."""
    x = 130.0 * column + 14.0 * math.sin(1.3 * row + column)
    y = 120.0 * row + 12.0 * math.cos(0.9 * column - row)
    return x, y


def way(root: ET.Element, number: int, nodes: list[int], **tags: str) -> None:
    """Add a way."""
    made = ET.SubElement(root, "way", id=str(number), version="1")
    for node in nodes:
        ET.SubElement(made, "nd", ref=str(node))
    for key, value in tags.items():
        ET.SubElement(made, "tag", k=key, v=value)


def main() -> None:
    """Write the file."""
    root = ET.Element("osm", version="0.6", generator="town_osm.py")
    for row in range(ROWS):
        for column in range(COLUMNS):
            x, y = place(column, row)
            made = ET.SubElement(
                root,
                "node",
                id=str(node_id(column, row)),
                version="1",
                lat=f"{SOUTH + y * NORTH_PER_M:.7f}",
                lon=f"{WEST + x * EAST_PER_M:.7f}",
            )
            if row == MAIN_ROW and column in {1, MAIN_COLUMN, 4}:
                ET.SubElement(made, "tag", k="highway", v="traffic_signals")
    for row in range(ROWS):
        kind = {"highway": "residential", "name": f"{row + 1}th Street"}
        if row == MAIN_ROW:
            kind = {"highway": "primary", "name": "Main Street", "maxspeed": "50", "lanes": "2"}
        elif row in {1, 5}:
            kind = {"highway": "tertiary", "name": f"{row + 1}th Street", "maxspeed": "50"}
        way(root, 1000 + row, [node_id(column, row) for column in range(COLUMNS)], **kind)
    for column in range(COLUMNS):
        kind = {"highway": "residential", "name": f"Avenue {'ABCDEF'[column]}"}
        if column == MAIN_COLUMN:
            kind = {"highway": "secondary", "name": "Station Avenue", "maxspeed": "50"}
        elif column in {3, 4}:
            kind |= {"oneway": "yes" if column == 3 else "-1"}  # noqa: PLR2004  a pair, one each way
        way(root, 2000 + column, [node_id(column, row) for row in range(ROWS)], **kind)
    way(root, 3000, [node_id(0, 0), node_id(1, 1), node_id(2, 2)], highway="footway", name="Garden Path")
    ET.indent(root)
    FILE.write_text(ET.tostring(root, encoding="unicode") + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
