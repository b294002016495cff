"""Finds elements of additional files that would reroute or remove gated vehicles."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import ScenarioError
from loopgate.network import Loop, VehicleDemand
from loopgate.network.additional import read_additional

_CLOSES = ("closingReroute", "closingLaneReroute")
_LEADS = ("destProbReroute", "routeProbReroute")


def refuse_what_leads_off(files: Iterable[Path], loops: Iterable[Loop]) -> None:
    """Refuse closed roads, rerouters and calibrators on loops that affect all vehicles.

    Raises
    ------
    ScenarioError
        If there is such an element; the text names it, the loop and the way out.
    """
    by_edge = {edge: loop.id for loop in loops for edge in loop.edges}
    for file in files:
        for element in read_additional(file).iter():
            for edge, does in _does(element):
                if edge in by_edge:
                    what = f"{file}: {element.tag} {element.get('id', '')}"
                    msg = f"{what} {does.format(edge=edge, loop=by_edge[edge])}, or --gate open"
                    raise ScenarioError(msg)


def led_off(files: Iterable[Path], vehicles: Iterable[VehicleDemand]) -> dict[str, str]:
    """Return the trips that a rerouter may lead off their paths, with the reason, by name.

    A rerouter acts where a vehicle enters one of its edges. It may give the vehicle another destination or
    route, or lead it round a closed edge farther on.
    """
    trips = [v for v in vehicles if not v.loop.closed]
    rerouters = [one for file in files for one in read_additional(file).iter("rerouter")] if trips else []
    found: dict[str, str] = {}
    for rerouter in rerouters:
        at, types = _words(rerouter, "edges"), _words(rerouter, "vTypes")
        leads = next(_inside(rerouter, _LEADS), None) is not None
        closes = {_closed(one) for one in _inside(rerouter, _CLOSES)}
        for vehicle in (v for v in trips if not types or v.type.id in types):
            way = vehicle.loop.edges[vehicle.edge :]
            first = next((k for k, edge in enumerate(way) if edge in at), None)
            if first is None:
                continue
            shut = next((edge for edge in way[first:] if edge in closes), "")
            if leads or shut:
                does = f"leads it off its way at {way[first]}" if leads else f"closes {shut} on its way"
                found.setdefault(vehicle.id, f"rerouter {rerouter.get('id', '')} {does}")
    return found


def _words(element: ET.Element, name: str) -> list[str]:
    return element.get(name, "").replace(",", " ").split()


def _inside(element: ET.Element, tags: Iterable[str]) -> Iterator[ET.Element]:
    return (one for tag in tags for one in element.iter(tag))


def _closed(one: ET.Element) -> str:
    """Return the edge that is closed, wholly or by lane."""
    name = one.get("id", "")
    return name if one.tag == "closingReroute" else name.rpartition("_")[0]


def _does(element: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield edges, and the effect there on vehicles that no gate can work with."""
    edge = element.get("edge") or element.get("lane", "").rpartition("_")[0]
    if element.tag == "calibrator" and not element.get("vTypes"):
        yield edge, "takes vehicles out on {edge}, which is on loop {loop}; give it vTypes of others"
    if element.tag != "rerouter":
        return
    for closed in _inside(element, _CLOSES):
        yield (
            _closed(closed),
            "closes {edge}, which is on loop {loop}; let loops avoid it (loopgate loops --avoid)",
        )
    if not element.get("vTypes") and next(_inside(element, _LEADS), None) is not None:
        for at in _words(element, "edges"):
            yield at, "leads vehicles off loop {loop} at {edge}; give it vTypes of others"
