"""How long each movement had green: SUMO writes it down while it runs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.network.loop import Loop
from loopgate.network.xml_file import write_xml

GREENS = "greens.xml"
_REQUEST = "greens.add.xml"


def ask_for_greens(loops: Iterable[Loop], folder: Path) -> tuple[Path, ...]:
    """Write the additional file that lets SUMO write the greens of the lights on some loops; none without."""
    lights = sorted({turn.signal[0] for loop in loops for turn in loop.movements if turn.signal})
    if not lights:
        return ()
    top = ET.Element("additional")
    for light in lights:  # SUMO takes `dest` for a name in the folder of this file
        ET.SubElement(top, "timedEvent", type="SaveTLSSwitchTimes", source=light, dest=GREENS)
    write_xml(top, folder / _REQUEST)
    return (folder / _REQUEST,)


def take_greens(folder: Path, begin_s: float, end_s: float) -> dict[tuple[str, str], float]:
    """Return the green time of each movement in a period [lane s], by its two edges; both files then go.

    Each lane of the movement counts, and each green that has ended: SUMO writes it then.
    """
    found: dict[tuple[str, str], float] = defaultdict(float)
    file = folder / GREENS
    if file.exists():
        for _, one in ET.iterparse(file):  # noqa: S314  SUMO has just written it
            if one.tag == "tlsSwitch":
                edges = (one.get("fromLane", "").rpartition("_")[0], one.get("toLane", "").rpartition("_")[0])
                since_s, until_s = float(one.get("begin", "0")), float(one.get("end", "0"))
                found[edges] += max(0.0, min(until_s, end_s) - max(since_s, begin_s))
    for name in (GREENS, _REQUEST):
        (folder / name).unlink(missing_ok=True)
    return dict(found)
