"""Refuses what in additional files would lead vehicles under a gate off their loops, or take them out."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import ScenarioError
from loopgate.network import Loop
from loopgate.network.additional import read_additional

_CLOSES = ("closingReroute", "closingLaneReroute")
_LEADS = ("destProbReroute", "routeProbReroute")


def refuse_what_leads_off(files: Iterable[Path], loops: Iterable[Loop]) -> None:
    """Refuse closed roads on loops, and rerouters and calibrators on them that are for vehicles of all types.

    Raises
    ------
    ScenarioError
        If there is one; the text names it, the loop and the way out.
    """
    by_edge = {edge: loop.id for loop in loops for edge in loop.edges}
    for file in files:
        for element in read_additional(file).iter():
            for edge, does in _does(element):
                if edge in by_edge:
                    what = f"{file}: {element.tag} {element.get('id', '')}"
                    msg = f"{what} {does.format(edge=edge, loop=by_edge[edge])}, or --gate open"
                    raise ScenarioError(msg)


def _does(element: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield edges, and what is done there to vehicles that no gate can work with."""
    edge = element.get("edge") or element.get("lane", "").rpartition("_")[0]
    if element.tag == "calibrator" and not element.get("vTypes"):
        yield edge, "takes vehicles out on {edge}, which is on loop {loop}; give it vTypes of others"
    if element.tag != "rerouter":
        return
    for closed in (one for tag in _CLOSES for one in element.iter(tag)):
        name = closed.get("id", "")
        at = name if closed.tag == "closingReroute" else name.rpartition("_")[0]
        yield at, "closes {edge}, which is on loop {loop}; let loops avoid it (loopgate loops --avoid)"
    if not element.get("vTypes") and any(next(element.iter(tag), None) is not None for tag in _LEADS):
        for at in element.get("edges", "").replace(",", " ").split():
            yield at, "leads vehicles off loop {loop} at {edge}; give it vTypes of others"
