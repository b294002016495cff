"""What loopgate does with each option of SUMO: docs/options.md, made from SUMO's schema and the code.

    python analysis/options.py

A test makes the page again, and lets SUMO say what it got.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import sumo

from loopgate.simulation.settings import UNDER_NO_GATE
from loopgate.simulation.sumo.devices import LEADING
from loopgate.simulation.sumo_options import HONOURED, QUIET, SWITCHED_OFF, UNDER_GATE
from loopgate.simulation.sumo_words import NEVER, REPLACED

PAGE = Path(__file__).resolve().parent.parent / "docs" / "options.md"
XSD = "{http://www.w3.org/2001/XMLSchema}"
SCHEMA = Path(sumo.SUMO_HOME) / "data" / "xsd" / "types" / "sumoConfigurationType.xsd"

HONOURED_, TOLD, REFUSED, LEFT = "honoured", "told and left out", "refused under a gate", "left to SUMO"
OUTPUTS = ("fcd-output", "tripinfo-output", "edgedata-output")
"""Outputs that the run folder has in its own form if the run asks for them."""

ROUND = "any-traffic.md#driving-in-circles"
CLOSED = (
    "on loops as [closures](standing.md), on queues; refused if some gated classes may pass; trips round it "
    "are ordinary"
)
REROUTERS = {
    "rerouter": {
        "id edges vTypes": (
            HONOURED_,
            "led beforehand; loopgate sets `vTypes` to ordinary ones",
        ),
        "probability": (HONOURED_, "drawn beforehand"),
        "off optional": (HONOURED_, "such a rerouter leads nobody"),
        "timeThreshold": (TOLD, "gated vehicles keep their way; trips are ordinary, with the reason"),
        "pos radius name visible": (LEFT, "for windows"),
    },
    "interval": {"begin end": (HONOURED_, "one that begins later makes trips ordinary, with the reason")},
    "destProbReroute": {"id probability": (HONOURED_, "a loop, a way drawn beforehand, or another way")},
    "routeProbReroute": {"id probability": (HONOURED_, "the same; with stops, trips are ordinary")},
    "viaProbReroute": {"id probability": (TOLD, "trips are ordinary, with the reason; loops are kept")},
    "closingReroute": {"id allow disallow": (HONOURED_, CLOSED), "until": (LEFT, "")},
    "closingLaneReroute": {"id allow disallow": (HONOURED_, CLOSED)},
    "parkingAreaReroute": {"id probability visible": (LEFT, "for ordinary vehicles")},
    "overtakingReroute": {"main siding minSaving defer": (LEFT, "for trains, which are ordinary")},
    "stationReroute": {"id minSaving": (LEFT, "for ordinary vehicles")},
}
"""What becomes of each attribute of rerouters."""


def rerouters() -> dict[str, list[str]]:
    """Return the attributes in SUMO's schema of rerouters, by element."""
    top = ET.parse(SCHEMA.parents[1] / "additional_file.xsd").getroot()  # noqa: S314  it comes with SUMO
    kind = next(one for one in top.iter(f"{XSD}complexType") if one.get("name") == "rerouterType")
    found: dict[str, list[str]] = {}

    def look(element: ET.Element, name: str) -> None:
        for one in element:
            if one.tag == f"{XSD}attribute":
                found.setdefault(name, []).append(one.get("name", ""))
            else:
                look(one, one.get("name", "") if one.tag == f"{XSD}element" else name)

    look(kind, "rerouter")
    return found


HEAD = """# Options of SUMO

What becomes of each option of a `.sumocfg`, and of `--sumo`. This page is made by `python analysis/options.py` from the schema that comes with SUMO. *Honoured*: loopgate reads it. *Left to SUMO*: SUMO gets it unchanged. *Told and left out*: a warning names it; the options of windows and of the terminal are left out without a word, as they change no vehicle. *Refused*: an error names it and the way out, unless the run has `--gate open`.
"""  # noqa: E501  a paragraph is a line


def options() -> dict[str, list[str]]:
    """Return the options in SUMO's schema, by topic, in its order."""
    found: dict[str, list[str]] = {}
    for topic in ET.parse(SCHEMA).getroot().iter(f"{XSD}complexType"):  # noqa: S314  it comes with SUMO
        name = topic.get("name", "")
        if name.endswith("TopicType"):
            found[name.removesuffix("TopicType").removeprefix("sumo")] = [
                one.get("name", "") for one in topic.iter(f"{XSD}element") if one.get("name")
            ]
    return found


def what_of(name: str) -> tuple[str, str]:
    """Return what becomes of an option, and why or how."""
    device, _, setting = name.removeprefix("device.").partition(".")
    leads = LEADING.get(device, "") if setting in {"probability", "explicit"} else ""
    quiet = " (no warning)" if name in QUIET else ""
    found = [
        *((TOLD, NEVER[one]) for one in [name] if one in {"remote-port", "num-clients"}),
        *((HONOURED_, HONOURED[one]) for one in [name] if one in HONOURED),
        *(
            (TOLD, f"{UNDER_NO_GATE[one].partition(';')[0]}; open has it")
            for one in [name]
            if one in SWITCHED_OFF
        ),
        *((REFUSED, UNDER_NO_GATE[one]) for one in [name] if one in UNDER_NO_GATE),
        *((TOLD, REPLACED[one] + quiet) for one in [name] if one in REPLACED),
        *((TOLD, UNDER_GATE[one]) for one in [name] if one in UNDER_GATE),
        *((LEFT, "told and left out where the run folder has it") for one in [name] if one in OUTPUTS),
        *((REFUSED, f"it would {leads}") for _ in [leads] if leads and setting == "explicit"),
        *((TOLD, f"it would {leads}; ordinary vehicles have it") for _ in [leads] if leads),
        *((REFUSED, NEVER[one]) for one in [name] if one == "random"),
    ]
    return found[0] if found else (LEFT, "")


def page() -> str:
    """Return the page."""
    text = HEAD
    count: dict[str, int] = {}
    for topic, names in options().items():
        rows: dict[tuple[str, str], list[str]] = {}
        for name in names:
            what = what_of(name)
            rows.setdefault(what, []).append(name)
            count[what[0]] = count.get(what[0], 0) + 1
        text += f"\n## {topic.replace('_', ' ').capitalize()}\n\n| options | handling | |\n|---|---|---|\n"
        for (what_, why), some in rows.items():
            text += f"| {', '.join(f'`{name}`' for name in some)} | {what_} | {why} |\n"
    text += f"\n## Rerouters\n\n[Driving in circles]({ROUND}).\n\n"
    text += "| element | attributes | handling | |\n|---|---|---|---|\n"
    for element, some_ in REROUTERS.items():
        for names_, (what_, why) in some_.items():
            listed = ", ".join(f"`{name}`" for name in names_.split())
            text += f"| `<{element}>` | {listed} | {what_} | {why} |\n"
    told = ", ".join(f"{number} {what}" for what, number in sorted(count.items()))
    return text + f"\nIn all {sum(count.values())} options: {told}.\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
