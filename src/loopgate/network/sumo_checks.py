"""What SUMO refuses of vehicles and types, found before a run: names, departures and words of attributes."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import as_number
from loopgate.network.colour import check_colour
from loopgate.network.ungated import SUDDEN
from loopgate.network.vehicle_demand import depart_s, read_flow
from loopgate.reading import counted, shown

_NO_NAME = re.compile(r"[\s|\\'\";,<>&]")
"""What SUMO allows in no name of a vehicle, flow or type: it writes names into its files as they are."""

_WORDS: dict[str, frozenset[str]] = {
    "departLane": frozenset({"random", "free", "allowed", "best", "best_prob", "first"}),
    "departSpeed": frozenset({"random", "max", "desired", "speedLimit", "last", "avg"}),
    "departPos": frozenset({"random", "random_free", "random_location", "free", "base", "last", "stop"})
    | {"splitFront"},
    "departEdge": frozenset({"random"}),
    "arrivalLane": frozenset({"current", "first", "random"}),
    "arrivalPos": frozenset({"random", "max", "center"}),
    "arrivalSpeed": frozenset({"current"}),
    "personNumber": frozenset(),
    "containerNumber": frozenset(),
}
"""The words that each of these attributes may have in place of a number."""

_WHOLE = frozenset({"departLane", "departEdge", "arrivalLane", "personNumber", "containerNumber"})
_POSITIONS = frozenset({"departPos", "arrivalPos"})
"""`_WHOLE` and `_POSITIONS`: attributes whose number is a whole one, and any one; of the others it is at
least 0."""

_NUMBER = re.compile(r"0|[1-9][0-9]{0,17}")
"""The number of a flow's vehicle, as SUMO writes it."""

Elements = Sequence[tuple[Path, ET.Element]]
"""Elements with their files."""


def check_fleet(fleet: Elements) -> None:
    """Check vehicles, trips and flows as SUMO does when it loads them.

    Raises `RouteError` if a name is missing or no name, two vehicles have one name, or SUMO does not know a
    departure or a word. The text names the file and element of the first fault.
    """
    wrong = [problem for source, one in fleet for problem in _wrong_name(source, one)] or [
        *_twice(fleet),
        *(problem for source, one in fleet for problem in _wrong_words(source, one)),
    ]
    if wrong:
        more = f"; and {counted(len(wrong) - 1, 'fault')} more" if len(wrong) > 1 else ""
        msg = f"{wrong[0]}{more}"
        raise RouteError(msg)


def check_type_names(tops: Elements) -> None:
    """Check the names of types, and of their distributions, which SUMO takes as one kind of name.

    SUMO's own types, such as ``DEFAULT_VEHTYPE``, may be redefined once.

    Raises `RouteError` if a name is missing, no name, or used twice.

    Parameters
    ----------
    tops
        The topmost elements of the files.
    """
    first: dict[str, tuple[Path, str]] = {}
    kinds = ("vType", "vTypeDistribution")
    for source, element in ((source, one) for source, top in tops for tag in kinds for one in top.iter(tag)):
        name = element.get("id", "")
        if element.get("refId"):
            continue  # it names a type that is defined elsewhere
        for problem in _wrong_name(source, element):
            raise RouteError(problem)
        if name in first:
            other, tag = first[name]
            msg = f"{source}: {element.tag} {name}: {_used_twice(tag, other, source)}"
            raise RouteError(msg)
        first[name] = source, element.tag


def _wrong_name(source: Path, element: ET.Element) -> Iterator[str]:
    """Yield why the name of an element is none for SUMO, if it is so."""
    name = element.get("id", "")
    found = _NO_NAME.search(name)
    if not name:
        said = " ".join(f"{key}={shown(value)}" for key, value in element.attrib.items() if key != "id")
        yield f"{source}: a <{element.tag}{f' {said}' if said else ''}> has no id; give it one"
    elif found:
        yield (
            f"{source}: {element.tag} {shown(name)}: SUMO allows no {shown(found[0])} in the id of a "
            f"{element.tag}; rename it"
        )


def _used_twice(tag: str, other: Path, source: Path) -> str:
    """Return that a name is used by an element of another file too, or by another of the same file."""
    also = f"by another {tag}" if other == source else f"by a {tag} in {other}"
    return f"the id is used twice (also {also}); rename one"


def _twice(fleet: Elements) -> Iterator[str]:
    """Yield each name that two vehicles have, those of flows included.

    SUMO tells a flow from a vehicle of the same name, since its vehicles have numbers. But it names the ways
    of both after them, unless they drive a route that has a name of its own.
    """
    vehicles: dict[str, tuple[Path, ET.Element]] = {}
    flows: dict[str, tuple[Path, ET.Element]] = {}
    for source, one in fleet:
        name, mine = one.get("id", ""), flows if one.tag == "flow" else vehicles
        others = vehicles if one.tag == "flow" else flows
        also = mine.get(name)
        if also is None and name in others and not (one.get("route") and others[name][1].get("route")):
            also = others[name]
        if also is not None:
            yield (f"{source}: {one.tag} {name}: {_used_twice(also[1].tag, also[0], source)}")
        mine.setdefault(name, (source, one))
    yield from _as_of_flows(vehicles, flows)


def _as_of_flows(
    vehicles: Mapping[str, tuple[Path, ET.Element]], flows: Mapping[str, tuple[Path, ET.Element]]
) -> Iterator[str]:
    """Yield each vehicle that has the name of a flow's vehicle."""
    for name, (source, one) in vehicles.items():
        flow, _, number = name.rpartition(".")
        if flow in flows and _NUMBER.fullmatch(number):
            other, element = flows[flow]
            if int(number) < _sure_number(element):
                where = "" if other == source else f" in {other}"
                yield (
                    f"{source}: {one.tag} {name}: a vehicle of flow {flow}{where} has this name too; "
                    f"rename one"
                )


def _sure_number(element: ET.Element) -> float:
    """Return how many vehicles of a flow surely depart in a run that is long enough."""
    try:
        flow = read_flow(element, "")
    except RouteError:
        return 0.0  # `_wrong_words` says so
    drawn = flow.rate_per_s is not None or flow.probability is not None
    if drawn or (flow.number is None and flow.end_s is None):
        return float(flow.number or 0) if flow.end_s is None else 0.0  # the run itself looks at who departs
    return flow.expected(-math.inf, math.inf)


def _wrong_words(source: Path, element: ET.Element) -> Iterator[str]:
    """Yield what SUMO does not take of a vehicle's or flow's attributes."""
    what = f"{source}: {element.tag} {element.get('id', '')}"
    try:
        if element.tag != "flow" and element.get("depart") not in SUDDEN:
            depart_s(element, what)
        elif element.tag == "flow":
            read_flow(element, what)
        check_colour(element, what)
    except RouteError as error:
        yield str(error)
    for name, words in _WORDS.items():
        text = element.get(name)
        if text is not None and text not in words and not _fits(name, text):
            number = "a whole number" if name in _WHOLE else "a number"
            number += "" if name in _POSITIONS else " from 0 on"
            expected = ", ".join([*sorted(words), number]) if words else number
            yield f"{what}: {name} is {shown(text)}; expected {'one of ' if words else ''}{expected}"


def _fits(attribute: str, text: str) -> bool:
    """Return whether a text is a number that an attribute may have."""
    if attribute in _WHOLE:
        return text.strip().isascii() and text.strip().isdecimal()
    number = as_number(text)
    return not math.isnan(number) if attribute in _POSITIONS else number >= 0.0
