"""The road network, read from a SUMO network file. Only this module uses sumolib.

SUMO crashes without a message on many networks in which they do not fit. Nets and connections are objects of
sumolib.
"""

from __future__ import annotations

import hashlib
import importlib.util
import xml.sax
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any
from xml.etree import ElementTree as ET

import sumolib
from sumolib.net.lane import SUMO_VEHICLE_CLASSES

from loopgate.cache import Cache, without_collection
from loopgate.errors import NetworkError
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.xml_file import check_root, included, open_xml
from loopgate.reading import meant, refusing, shown

Points = tuple[tuple[float, float], ...]
"""A polyline: (x, y) [m] in the network's coordinates."""
IGNORING = "ignoring"
"""The vehicle class that SUMO lets drive on every lane, also on one that is open to nobody."""


@dataclass(frozen=True, slots=True)
class Lane:
    """A lane of an edge, or an internal lane of a junction."""

    id: str
    edge: str
    index: int
    """SUMO's names: ``id`` is ``edge_index``; index 0 is the rightmost lane."""
    internal: bool
    """Whether the lane lies inside a junction."""
    length_m: float
    """SUMO's length of the lane; it can differ from the length of the drawn shape."""
    speed_mps: float
    width_m: float
    shape: Points
    """Centre line as drawn."""
    allowed: frozenset[str]
    """Vehicle classes that may use the lane."""
    two_way: bool = False
    """Whether a lane of the opposite edge lies on the same ground (SUMO's ``bidi``), as a track in a
    street."""
    heights: tuple[float, ...] = ()
    """Height of each point of the shape [m]; none where the network is flat."""
    to_left: frozenset[str] | None = None
    to_right: frozenset[str] | None = None
    """Vehicle classes that may change to the next lane on the left, and on the right; None for all."""

    def may_change(self, vclass: str, *, left: bool) -> bool:
        """Return whether vehicles of a class may change from this lane to the next on one side."""
        classes = self.to_left if left else self.to_right
        return classes is None or vclass in classes


@dataclass(frozen=True, slots=True)
class Edge:
    """A road between two junctions in one direction."""

    id: str
    from_junction: str
    to_junction: str
    """`from_junction` and `to_junction`: the junctions at the edge's beginning and end."""
    lanes: tuple[Lane, ...]
    """From right to left."""
    street: str = ""
    """Name of the street, empty where the network has none."""

    @property
    def length_m(self) -> float:
        """The length of the edge's lanes [m]."""
        return self.lanes[0].length_m

    def allows(self, vclass: str) -> bool:
        """Return whether a vehicle class may use at least one lane of the edge."""
        return any(vclass in lane.allowed for lane in self.lanes)


@dataclass(frozen=True, slots=True)
class Connection:
    """A movement over a junction, from one lane to another."""

    from_edge: str
    from_lane: int
    to_edge: str
    to_lane: int
    """`from_edge`, `from_lane`, `to_edge` and `to_lane`: edges and lane indices."""
    via: tuple[str, ...]
    """Ids of the internal lanes in driving order: one; two if vehicles can wait inside the junction; none in
    a network without internal lanes."""
    direction: str
    """SUMO's letter: ``s`` straight, ``l`` left, ``r`` right, ``L``, ``R`` partly, ``t`` U-turn."""
    junction: str
    link: int
    """Row of the junction's request matrix; -1 if there is none."""
    signal: tuple[str, int] | None
    """Name of the traffic light and index of the link; None without a light, as for trains that pass a level
    crossing."""

    @property
    def id(self) -> str:
        """The id ``fromlane>tolane``, unique in the network."""
        return f"{self.from_id}>{self.to_id}"

    @property
    def from_id(self) -> str:
        """The id of the lane before the junction."""
        return f"{self.from_edge}_{self.from_lane}"

    @property
    def to_id(self) -> str:
        """The id of the lane behind the junction."""
        return f"{self.to_edge}_{self.to_lane}"


RAIL_CROSSING = "rail_crossing"
"""SUMO's type of a junction where a railway passes a road on the level."""


@dataclass(frozen=True, slots=True)
class Junction:
    """A junction of the network, with its right of way."""

    id: str
    type: str
    """`id` and `type`: SUMO's name and type (``priority``, ``traffic_light``, ...)."""
    x: float
    y: float
    shape: Points
    foes: tuple[frozenset[int], ...]
    """``foes[i]`` are the links whose movements cross or merge with link ``i`` (the request matrix)."""
    yields_to: tuple[frozenset[int], ...]
    """``yields_to[i]`` are the links that link ``i`` has to let pass by right of way."""
    walked: frozenset[int] = frozenset()
    """The links that are pedestrian crossings."""

    @property
    def regulated(self) -> bool:
        """Whether the junction has right of way; without it, SUMO's drivers ignore vehicles inside."""
        return bool(self.foes)


PACKAGED = "sumo:"
"""Prefix of the names of networks that ship in the SUMO package."""


def packaged_networks() -> dict[str, Path]:
    """Return names and files of the networks in the SUMO package (its folder ``tools/game``).

    Examples
    --------
    >>> from loopgate.network import packaged_networks
    >>> packaged_networks()["DRT"].name
    'osm.net.xml'
    """
    spec = importlib.util.find_spec("sumo")
    if spec is None or not spec.submodule_search_locations:
        return {}
    found: dict[str, Path] = {}
    for home in spec.submodule_search_locations:
        for file in sorted(Path(home, "tools", "game").glob("*/*.net.xml*")):
            found.setdefault(file.parent.name, file)
    return found


def packaged_network(name: str) -> Path:
    """Return the file of a network in the SUMO package, ``sumo:NAME``.

    Raises `NetworkError` if there is none of that name.
    """
    known = packaged_networks()
    try:
        return known[name.removeprefix(PACKAGED)]
    except KeyError:
        names = [PACKAGED + one for one in known]
        has = f"; there are {', '.join(names)}" if known else "; pip install eclipse-sumo"
        msg = f"{name}: no such network in the SUMO package{has}{meant(name, names)}"
        raise NetworkError(msg) from None


_SAME_STREET = 0.2
"""Two directions of a street differ in length by at most this share."""


def both_ways(network: RoadNetwork, edges: Sequence[str], apart: Collection[str] = ()) -> list[list[str]]:
    """Return the edges by street: both directions together, or alone.

    An edge stands alone if its opposite is not among the edges, or if either of the two is in `apart`.
    """
    alone = set(apart)
    waiting: dict[tuple[str, str], list[str]] = {}
    streets: list[list[str]] = []
    for edge in edges:
        ends = network.edges[edge].from_junction, network.edges[edge].to_junction
        other = _opposite(network.edges[edge], waiting.get((ends[1], ends[0]), ()), network)
        if other is not None and alone & {edge, other}:
            streets.append([edge])
            waiting[ends[1], ends[0]].remove(other)
        elif other is None:
            streets.append([edge])
            waiting.setdefault(ends, []).append(edge)
        else:
            waiting[ends[1], ends[0]].remove(other)
            next(street for street in streets if street == [other]).append(edge)
    return streets


def _opposite(edge: Edge, others: Sequence[str], network: RoadNetwork) -> str | None:
    """Return the opposite edge between the same junctions, of about the same length."""
    for other in others:
        if abs(network.edges[other].length_m - edge.length_m) <= _SAME_STREET * edge.length_m:
            return other
    return None


def content_identity(path: Path) -> str:
    """Return the SHA-256 of a file and of the files that it names.

    Raises `OSError` if a file cannot be read.
    """
    digests = [hashlib.sha256(member.read_bytes()).hexdigest() for member in members(path)]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def members(path: Path) -> list[Path]:
    """Return the file and the files that it needs: named by a ``.sumocfg``, or included."""
    path = path.resolve()
    if not is_sumo_config(path):
        return [path] if ".net.xml" in path.name else [path, *included(path)]  # networks are large
    config = read_sumo_config(path)
    beside = [one.resolve() for one in (*config.route_files, *config.additional_files)]
    return [path, config.net_file.resolve(), *(one for file in beside for one in (file, *included(file)))]


_NEEDED: dict[str, tuple[str, ...]] = {
    "edge": ("id",),
    "lane": ("id", "index", "speed", "length", "shape"),
    "junction": ("id", "type", "x", "y"),
    "request": ("index", "response", "foes"),
    "phase": ("duration", "state"),
    "connection": ("from", "to", "fromLane", "toLane", "dir"),
}
_WHOLE = {"index", "fromLane", "toLane"}
_NUMBERS = {"x", "y", "length", "speed", "width"}
_DIMENSIONS = {2, 3}


def first_fault(stream: IO[bytes], file: Path) -> str:
    """Return the first invalid element or reference of the network; empty if there is none.

    Parameters
    ----------
    stream
        The file's content, which is read to its end.
    file
        Its name, for the message.
    """
    try:
        text = next(_faults(stream), "")
    except (ET.ParseError, ValueError, LookupError, OSError):
        return ""  # no XML: the reader has said so
    return f"{file}: {text}; repair it in netedit or build it anew with netconvert" if text else ""


def _faults(stream: IO[bytes]) -> Iterator[str]:
    lanes: Counter[str] = Counter()
    junctions: set[str] = set()
    ends: list[tuple[str, str]] = []
    links: list[tuple[str, str, str]] = []
    named: set[str] = set()
    over: list[tuple[str, str]] = []
    edge = ""
    for _, element in ET.iterparse(stream, events=("start",)):  # noqa: S314  read before, by the same parser
        get = element.get
        name = f"{element.tag} {shown(get('id') or get('from') or get('index') or '')[1:-1]}".strip()
        yield from (f"{name}: {text}" for text in _values(element))
        if element.tag == "edge":
            edge = get("id", "")
            ends += [(name, get(end, "")) for end in ("from", "to") if get("function", "normal") == "normal"]
        elif element.tag == "lane":
            lanes[edge] += 1
            named.add(get("id", ""))
        elif element.tag == "junction":
            junctions.add(get("id", ""))
        elif element.tag == "connection":
            links += [(name, get(end, ""), get(f"{end}Lane", "")) for end in ("from", "to")]
            over.append((name, get("via", "")))
        element.clear()
    yield from (f"{name}: there is no junction {shown(end)}" for name, end in ends if end not in junctions)
    for name, end, lane in links:
        if not 0 <= int(lane) < lanes[end]:
            yield f"{name}: there is no lane {shown(lane)} on an edge {shown(end)}"
    yield from (f"{name}: there is no lane {shown(via)}" for name, via in over if via and via not in named)


def _values(element: ET.Element) -> Iterator[str]:
    for attribute in _NEEDED.get(element.tag, ()):
        if attribute not in element.attrib:
            yield f"it has no {attribute}"
    if element.tag not in _NEEDED:
        return
    for attribute, text in element.attrib.items():
        if attribute in _WHOLE and not _is(int, text):
            yield f"{attribute} is {shown(text)}; expected a whole number"
        if attribute in _NUMBERS and not _is(float, text):
            yield f"{attribute} is {shown(text)}; expected a number"
        if attribute == "shape":
            for point in text.split():
                parts = point.split(",")
                if len(parts) not in _DIMENSIONS or not all(_is(float, part) for part in parts):
                    yield f"its shape has the point {shown(point)}; expected x,y or x,y,z"


def _is(kind: type[int | float], text: str) -> bool:
    try:
        kind(text)
    except ValueError:
        return False
    return True


def check_inside(
    net: Any,  # noqa: ANN401  sumolib has no types
    file: Path,
    waiting: Collection[tuple[str, int]],
    between: Collection[str],
) -> None:
    """Raise `NetworkError` if the lanes inside junctions do not fit.

    Parameters
    ----------
    waiting
        Requests with ``cont``, as junction and index: a vehicle may wait on the first of two internal lanes.
    between
        Junctions between two internal lanes, each named like the second.
    """
    _check_named(net, file)
    _check_led_over(net, file)
    _check_waiting(net, file, waiting)
    _check_between(net, file, between)
    _check_listed(net, file)


def lanes_over(net: Any, connection: Any, file: Path) -> tuple[str, ...]:  # noqa: ANN401  sumolib has no types
    """Return the internal lanes of a movement, through internal junctions too.

    Raises `NetworkError` if the last of them does not lead to the movement's end: SUMO crashes without a
    message on some of these networks.
    """
    chain: list[str] = []
    lane_id, outgoing = connection.getViaLaneID(), []
    while lane_id and lane_id not in chain:
        chain.append(lane_id)
        outgoing = net.getLane(lane_id).getOutgoing()
        lane_id = outgoing[0].getViaLaneID() if outgoing else ""
    to = connection.getTo()
    if chain and not any(one.getTo() is to for one in outgoing):
        leads = f"leads to {outgoing[0].getTo().getID()}" if outgoing else "leads nowhere"
        begin, _, lane = chain[-1].rpartition("_")
        msg = (
            f"{file}: connection {connection.getFrom().getID()} to {to.getID()}: its internal lane "
            f'{chain[-1]} {leads}; a <connection from="{begin}" fromLane="{lane}" to="{to.getID()}" .../> is '
            f"missing: build the network anew with netconvert"
        )
        raise NetworkError(msg)
    return tuple(chain)


def _check_named(net: Any, file: Path) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if no connection leads over the internal lanes of a junction that has some."""
    used = {c.getViaLaneID() for edge in net.getEdges() for some in edge.getOutgoing().values() for c in some}
    inside = {edge.getID() for edge in net.getEdges() if edge.getFunction() == "internal"}
    if inside and not any(used):
        msg = (
            f"{file}: no connection names the internal lane that it leads over (via), though there are "
            f"{len(inside)} internal edges, such as {min(inside)}: build the network anew with netconvert"
        )
        raise NetworkError(msg)


def _check_led_over(net: Any, file: Path) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if no connection leads over an internal lane, or a junction lists too few."""
    used = {c.getViaLaneID() for edge in net.getEdges() for some in edge.getOutgoing().values() for c in some}
    inside = sorted(edge.getID() for edge in net.getEdges() if edge.getFunction() == "internal")
    lanes = (lane.getID() for name in inside for lane in net.getEdge(name).getLanes())
    if lane := next((lane for lane in lanes if lane not in used), ""):
        what = f"no connection leads over the internal lane {lane}"
        msg = f"{file}: {what}: build the network anew with netconvert"
        raise NetworkError(msg)
    for node in net.getNodes():
        has, needs = sum(map(bool, node.getInternal())), len(node._prohibits)  # noqa: SLF001  they have no other name
        if node.getType() != "internal" and 0 < has < needs:
            what = f"junction {node.getID()}: {has} lanes in intLanes for {needs} requests"
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


def _check_waiting(net: Any, file: Path, waiting: Collection[tuple[str, int]]) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if there is no second internal lane for a movement that may wait on the first."""
    inside = [edge for edge in net.getEdges() if edge.getFunction() == "internal"]
    second = {c.getViaLaneID() for edge in inside for some in edge.getOutgoing().values() for c in some}
    for name, index in sorted(waiting):
        lanes = net.getNode(name).getInternal()
        lane = lanes[index] if index < len(lanes) else ""
        if lane and lane not in second:
            what = (
                f"junction {name}: request {index} has cont, but its movement only the internal lane {lane}"
            )
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


def _check_between(net: Any, file: Path, between: Collection[str]) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if there is no junction between the two internal lanes of a movement.

    SUMO crashes when a vehicle would wait there.
    """
    for first in (edge for edge in net.getEdges() if edge.getFunction() == "internal"):
        movements = (c for some in first.getOutgoing().values() for c in some)
        seconds = (c.getViaLaneID() for c in movements)
        if lane := next((lane for lane in seconds if lane and lane not in between), ""):
            what = f"there is no internal junction {lane} between edge {first.getID()} and lane {lane}"
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


def _check_listed(net: Any, file: Path) -> None:  # noqa: ANN401  sumolib has no types
    """Raise `NetworkError` if a junction with requests does not list a lane that leads over it."""
    for node in net.getNodes():
        if node.getType() == "internal" or not node._prohibits:  # noqa: SLF001 - it has no other name
            continue
        listed = set(node._incLanes)  # noqa: SLF001 - as above
        roads = [edge for edge in node.getIncoming() if edge.getFunction() == ""]
        lanes = (lane for edge in roads for lane in edge.getLanes() if lane.getOutgoing())
        if lane := next((lane.getID() for lane in lanes if lane.getID() not in listed), ""):
            what = f"junction {node.getID()}: incLanes lacks {lane}, from which a connection leads over it"
            msg = f"{file}: {what}: build the network anew with netconvert"
            raise NetworkError(msg)


_LARGEST_COORDINATE_M = 1e8
"""Larger than the Earth in any projection; squares of differences stay finite and exact to the millimetre
[m]."""
_LONGEST_LANE_M = 1e6
_SHORTEST_LANE_M = 1e-6
"""Far below what SUMO writes; shorter lanes would give directions that are no finite numbers [m]."""
_WIDEST_LANE_M = 1e3
_FASTEST_MPS = 1e4
_FEWEST_POINTS = 2


def check_sound(network: RoadNetwork) -> None:
    """Check lengths, speeds, widths and shapes of a network, and that connections lead from lane to lane.

    Raises `NetworkError` if something makes no sense; the text names the file and the lane, edge, junction or
    connection. O(size of the network).
    """
    file = network.file
    for lane in network.lanes.values():
        _within(file, f"lane {lane.id}: its length", lane.length_m, _LONGEST_LANE_M, least=_SHORTEST_LANE_M)
        _within(file, f"lane {lane.id}: its speed", lane.speed_mps, _FASTEST_MPS, or_zero=True)
        _within(file, f"lane {lane.id}: its width", lane.width_m, _WIDEST_LANE_M)
        _drawn(file, f"lane {lane.id}", lane.shape, _FEWEST_POINTS)
        for height in lane.heights:
            _within(
                file, f"lane {lane.id}: how high it lies", abs(height), _LARGEST_COORDINATE_M, or_zero=True
            )
    for edge in network.edges.values():
        if not edge.lanes:
            _fail(file, f"edge {edge.id}: it has no lanes")
        for end in (edge.from_junction, edge.to_junction):
            if end not in network.junctions:
                _fail(file, f"edge {edge.id}: its junction {end} is not in the network")
    for junction in network.junctions.values():
        _drawn(file, f"junction {junction.id}", ((junction.x, junction.y), *junction.shape), 1)
    for connection in network.connections:
        _leads(network, connection)


def _leads(network: RoadNetwork, connection: Connection) -> None:
    what = f"connection {connection.id}"
    for edge, lane in (
        (connection.from_edge, connection.from_lane),
        (connection.to_edge, connection.to_lane),
    ):
        if edge not in network.edges or not 0 <= lane < len(network.edges[edge].lanes):
            _fail(network.file, f"{what}: there is no lane {lane} on edge {edge}")
    for via in connection.via:
        if via not in network.lanes:
            _fail(network.file, f"{what}: it leads over lane {via}, which is not in the network")


def _within(
    file: Path, what: str, number: float, most: float, *, or_zero: bool = False, least: float = 0.0
) -> None:
    if not (least < number <= most or (or_zero and number == 0.0)):
        above = "from 0" if or_zero else f"above {least:g}"
        _fail(file, f"{what} is {number:g}; expected a number {above} and up to {most:g}")


def _drawn(file: Path, what: str, shape: Points, fewest: int) -> None:
    if len(shape) < fewest:
        _fail(file, f"{what}: its shape has {len(shape)} points; expected at least {fewest}")
    for x, y in shape:
        if not (abs(x) <= _LARGEST_COORDINATE_M and abs(y) <= _LARGEST_COORDINATE_M):
            _fail(file, f"{what}: it is drawn through {x:g},{y:g}; expected metres up to 1e8")


def _fail(file: Path, what: str) -> None:
    msg = f"{file}: {what}"
    raise NetworkError(msg)


VEHICLE_CLASSES: frozenset[str] = frozenset(SUMO_VEHICLE_CLASSES)
"""All that SUMO has."""

_ROUNDING_M = 0.1
_TRUE = frozenset({"1", "yes", "true", "on", "x", "t"})
"""What SUMO takes for it."""
_MOST_LINKS = 10_000  # many times what SUMO can work with


class RoadNetwork:
    """A SUMO road network: edges, lanes, junctions and movements. It cannot be changed.

    Attributes
    ----------
    name
        The path or ``sumo:NAME`` from which the network was read.
    edges
        Normal edges by id, in the file's order.
    lanes
        Lanes by id, the internal ones included.
    junctions
        Junctions by id.
    connections
        Movements between normal edges, in the file's order.
    content
        SHA-256 of the file; empty if there is none.

    Examples
    --------
    >>> from loopgate import RoadNetwork
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> network.edge("s1").lanes[0].length_m
    50.8
    >>> [connection.to_edge for connection in network.outgoing("s1")]
    ['p3a', 'l1']
    >>> (movement,) = network.between("s1", "l1")
    >>> movement.junction, network.allows(movement, "pedestrian")
    ('D1', True)
    >>> network.without(["l1"]).between("s1", "l1")
    ()
    """

    __slots__ = (
        *("connections", "content", "edges", "file", "junctions", "lanes", "name"),
        *("_between", "_outgoing"),
    )

    def __init__(
        self,
        *,
        name: str,
        file: Path,
        edges: Mapping[str, Edge],
        lanes: Mapping[str, Lane],
        junctions: Mapping[str, Junction],
        connections: tuple[Connection, ...],
        content: str = "",
    ) -> None:
        self.name = name
        self.file = file
        self.content = content
        self.edges = MappingProxyType(dict(edges))
        self.lanes = MappingProxyType(dict(lanes))
        self.junctions = MappingProxyType(dict(junctions))
        self.connections = connections
        outgoing: dict[str, list[Connection]] = {edge: [] for edge in edges}
        between: dict[tuple[str, str], list[Connection]] = {}
        for connection in connections:
            outgoing[connection.from_edge].append(connection)
            between.setdefault((connection.from_edge, connection.to_edge), []).append(connection)
        self._outgoing = {edge: tuple(found) for edge, found in outgoing.items()}
        self._between = {pair: tuple(found) for pair, found in between.items()}

    def __repr__(self) -> str:
        return f"<RoadNetwork {self.name}: {len(self.edges)} edges, {len(self.junctions)} junctions>"

    @classmethod
    def open(cls, name: str | Path) -> RoadNetwork:
        """Read a network from a file, or from the SUMO package.

        Raises `NetworkError` if the network is not found, or the file is no valid SUMO network.

        Parameters
        ----------
        name
            A ``.net.xml`` or ``.net.xml.gz`` file, a ``.sumocfg`` (its network), or ``sumo:NAME`` for a
            network in the SUMO package. The last few networks stay in memory.

        Examples
        --------
        >>> from loopgate import RoadNetwork
        >>> network = RoadNetwork.open("networks/ring3.net.xml")
        >>> edge = next(iter(network.edges.values()))
        >>> edge.lanes[0].length_m > 0
        True
        """
        text = str(name)
        file = packaged_network(text) if text.startswith(PACKAGED) else Path(text)
        if is_sumo_config(file):
            file = read_sumo_config(file).net_file
        check_root(file, root="net", what="network", error=NetworkError)
        with refusing(file, "network", NetworkError):
            content = content_identity(file)
        network = copy(_KEPT.get(content, lambda: _read(text, file, content)))
        network.name, network.file = text, file  # the same roads, as they are called this time
        return network

    def edge(self, edge: str) -> Edge:
        """Return the edge with an id; raise `NetworkError` if there is none."""
        try:
            return self.edges[edge]
        except KeyError:
            msg = f"{self.name}: the network has no edge {edge}"
            raise NetworkError(msg) from None

    def on_street(self, name: str) -> tuple[str, ...]:
        """Return the edges of a street by its name, in any case of letters; none where no street has it."""
        wanted = name.strip().casefold()
        return tuple(e.id for e in self.edges.values() if wanted and e.street.strip().casefold() == wanted)

    def names(self) -> dict[str, None]:
        """Return the names of all edges and streets, for "did you mean"."""
        return dict.fromkeys([*self.edges, *(edge.street for edge in self.edges.values() if edge.street)])

    def outgoing(self, edge: str) -> tuple[Connection, ...]:
        """Return the movements that lead from an edge over a junction."""
        return self._outgoing[edge]

    def between(self, from_edge: str, to_edge: str, vclass: str = "passenger") -> tuple[Connection, ...]:
        """Return the movements from one edge to the next that a vehicle class may use."""
        found = self._between.get((from_edge, to_edge), ())
        return tuple(connection for connection in found if self.allows(connection, vclass))

    def allows(self, connection: Connection, vclass: str = "passenger") -> bool:
        """Return whether a vehicle class may use a movement: both lanes and all lanes between them."""
        return (
            vclass in self.edges[connection.from_edge].lanes[connection.from_lane].allowed
            and vclass in self.edges[connection.to_edge].lanes[connection.to_lane].allowed
            and all(vclass in self.lanes[lane].allowed for lane in connection.via)
        )

    def is_walked(self, connection: Connection) -> bool:
        """Return whether pedestrians cross the way of a movement over its junction."""
        junction = self.junctions[connection.junction]
        return 0 <= connection.link < len(junction.foes) and not junction.walked.isdisjoint(
            junction.foes[connection.link]
        )

    def over_m(self, connection: Connection) -> float:
        """Return the length of a movement inside its junction [m]."""
        return sum(self.lanes[lane].length_m for lane in connection.via)

    def without(self, edges: Collection[str]) -> RoadNetwork:
        """Return a copy of the network without some edges."""
        closed = {lane.id: replace(lane, allowed=frozenset()) for e in edges for lane in self.edges[e].lanes}
        return RoadNetwork(
            name=self.name,
            file=self.file,
            edges={
                name: replace(edge, lanes=tuple(closed.get(lane.id, lane) for lane in edge.lanes))
                for name, edge in self.edges.items()
            },
            lanes={**self.lanes, **closed},
            junctions=self.junctions,
            connections=self.connections,
        )

    def is_regulated(self, lane: str) -> bool:
        """Return whether the junction at a lane's end has right of way; true inside junctions."""
        edge = self.edges.get(self.lanes[lane].edge)
        return edge is None or self.junctions[edge.to_junction].regulated

    def are_foes(self, one: Connection, other: Connection) -> bool:
        """Return whether two movements conflict by the request matrix of their junction."""
        if one.junction != other.junction or one.link < 0 or other.link < 0:
            return False
        rows = self.junctions[one.junction].foes  # none at junctions without right of way
        return one.link < len(rows) and other.link in rows[one.link]


_KEPT: Cache[RoadNetwork] = Cache(8)


def _read(name: str, file: Path, content: str) -> RoadNetwork:
    try:
        wrong = "not a SUMO network that can be read"
        with refusing(file, "network", NetworkError, wrong=wrong), without_collection():
            network = _records(_parse(file), name, file, content)
    except NetworkError as error:
        if not isinstance(error.__cause__, LookupError | AttributeError | TypeError | ValueError):
            raise  # it is no XML to look into
        with open_xml(file) as stream:
            fault = first_fault(stream, file)
        raise (NetworkError(fault) if fault else error) from error.__cause__
    if not network.edges:
        msg = f"{file}: the network has no edges"
        raise NetworkError(msg)
    check_sound(network)
    return network


def _points(shape: Any) -> Points:  # noqa: ANN401  sumolib has no types
    return tuple((float(p[0]), float(p[1])) for p in shape)


class _Reader(sumolib.net.NetReader):  # type: ignore[misc]  # sumolib has no types
    """Reads a network with sumolib, and also which movements may wait inside a junction, and where.

    Attributes
    ----------
    waiting
        Junction and index of each request with ``cont``.
    between
        Junctions between two internal lanes of a movement, by the second lane.
    changes
        For each lane with prohibited changes, the classes that may change to the left and to the right.
    """

    def __init__(self) -> None:
        super().__init__(withInternal=True)
        self.waiting: set[tuple[str, int]] = set()
        self.between: set[str] = set()
        self.changes: dict[str, tuple[frozenset[str] | None, frozenset[str] | None]] = {}
        self._junction = ""

    def startElement(self, name: str, attrs: Mapping[str, str]) -> None:  # noqa: N802  named by sumolib
        """Take the beginning of an element."""
        if name == "junction":  # SUMO also reads junctions that somebody has written by hand
            attrs = {**dict(attrs.items()), **{key: attrs.get(key, "") for key in _OF_JUNCTIONS}}
        super().startElement(name, attrs)
        if name == "junction":
            self._junction = attrs["id"]
            self.between.update([self._junction] if attrs.get("type") == "internal" else ())
        elif name == "lane" and ("changeLeft" in attrs or "changeRight" in attrs):
            self.changes[attrs["id"]] = _classes(attrs, "changeLeft"), _classes(attrs, "changeRight")
        elif name == "request" and attrs.get("cont", "0").lower() in _TRUE:
            self.waiting.add((self._junction, int(attrs["index"])))


_OF_JUNCTIONS = ("type", "incLanes", "intLanes")
"""Attributes of junctions that sumolib needs."""


def _classes(attrs: Mapping[str, str], name: str) -> frozenset[str] | None:
    """Return the vehicle classes that an attribute lists; None for all."""
    classes = frozenset(attrs[name].split()) if name in attrs else frozenset(("all",))
    return None if "all" in classes else classes | {IGNORING}


def _parse(file: Path) -> _Reader:
    reader = _Reader()
    with open_xml(file) as stream:
        xml.sax.parse(stream, reader)  # noqa: S317  expat refuses entities that grow without bounds
    return reader


def _records(reader: _Reader, name: str, file: Path, content: str) -> RoadNetwork:
    net = reader.getNet()
    classes: dict[frozenset[str], frozenset[str]] = {}  # a few sets, shared by thousands of lanes
    lanes: dict[str, Lane] = {}
    edges: dict[str, Edge] = {}
    normal: list[Any] = []
    for raw in net.getEdges(withInternal=True):
        function = raw.getFunction()
        if function not in {"", "internal"}:
            continue
        of_edge = []
        opposite = _opposite_lanes(raw)
        for index, lane in enumerate(raw.getLanes()):
            allowed = frozenset(lane.getPermissions()) | {IGNORING}
            to_left, to_right = reader.changes.get(f"{raw.getID()}_{index}", (None, None))
            of_edge.append(
                Lane(
                    id=f"{raw.getID()}_{index}",
                    edge=raw.getID(),
                    index=index,
                    internal=function == "internal",
                    length_m=float(lane.getLength()),
                    speed_mps=float(lane.getSpeed()),
                    width_m=float(lane.getWidth()),
                    shape=_points(lane.getShape()),
                    allowed=classes.setdefault(allowed, allowed),
                    heights=_heights(lane.getShape3D()),
                    two_way=any(_same(_points(lane.getShape())[::-1], shape) for shape in opposite),
                    to_left=to_left,
                    to_right=to_right,
                )
            )
        lanes.update((lane.id, lane) for lane in of_edge)
        if function == "":
            normal.append(raw)
            ends = raw.getFromNode().getID(), raw.getToNode().getID()
            edges[raw.getID()] = Edge(raw.getID(), *ends, tuple(of_edge), raw.getName() or "")
    links, walked = _links(net)
    connections = tuple(
        Connection(
            from_edge=raw.getID(),
            from_lane=index,
            to_edge=c.getTo().getID(),
            to_lane=c.getToLane().getIndex(),
            via=lanes_over(net, c, file),
            direction=c.getDirection(),
            junction=raw.getToNode().getID(),
            link=links.get(id(c), -1),
            signal=(c.getTLSID(), int(c.getTLLinkIndex()))
            if c.getTLSID() and c.getTLLinkIndex() >= 0
            else None,
        )
        for raw in normal
        for index, lane in enumerate(raw.getLanes())
        for c in lane.getOutgoing()
        if c.getTo().getID() in edges
    )
    check_inside(net, file, reader.waiting, reader.between)
    junctions = {node.getID(): _junction(node, walked) for node in net.getNodes()}
    return RoadNetwork(
        name=name,
        file=file,
        edges=edges,
        lanes=lanes,
        junctions=junctions,
        connections=connections,
        content=content,
    )


def _heights(shape: Any) -> tuple[float, ...]:  # noqa: ANN401  sumolib has no types
    heights = tuple(float(p[2]) for p in shape)
    return heights if any(heights) else ()


def _opposite_lanes(raw: Any) -> list[Points]:  # noqa: ANN401  sumolib has no types
    """Return the lane shapes of the edge that SUMO lists as the opposite direction in the same place."""
    opposite = raw.getBidi()
    return [_points(lane.getShape()) for lane in opposite.getLanes()] if opposite else []


def _same(one: Points, other: Points) -> bool:
    """Return whether two shapes are the same but for rounding."""
    return len(one) == len(other) and all(
        abs(x - u) + abs(y - v) < _ROUNDING_M for (x, y), (u, v) in zip(one, other, strict=True)
    )


def _junction(node: Any, walked: Mapping[str, frozenset[int]]) -> Junction:  # noqa: ANN401  sumolib has no types
    def rows(matrix: dict[int, str]) -> tuple[frozenset[int], ...]:
        size = max(matrix, default=-1) + 1
        if size > _MOST_LINKS or min(matrix, default=0) < 0:
            msg = f"junction {node.getID()}: a request has an index outside 0 to {_MOST_LINKS - 1}"
            raise ValueError(msg)
        # The strings are written with link 0 rightmost.
        return tuple(
            frozenset(j for j, bit in enumerate(reversed(matrix.get(i, ""))) if bit == "1")
            for i in range(size)
        )

    x, y = node.getCoord()
    return Junction(
        id=node.getID(),
        type=node.getType(),
        x=float(x),
        y=float(y),
        shape=_points(node.getShape() or ()),
        foes=rows(node._foes),  # noqa: SLF001  sumolib shows single bits only
        yields_to=rows(node._prohibits),  # noqa: SLF001
        walked=walked.get(node.getID(), frozenset()),
    )


def _links(net: Any) -> tuple[dict[int, int], dict[str, frozenset[int]]]:  # noqa: ANN401  sumolib has no types
    """Return the request index of each connection object, by identity, and by junction those of pedestrians.

    Links are numbered along the junction's incoming lanes, then along each lane's connections; sumolib's own
    `getJunctionIndex` counts the same way, from the start for every connection.
    """
    links: dict[int, int] = {}
    walked: dict[str, frozenset[int]] = {}
    for node in net.getNodes():
        number = 0
        for lane_id in node._incLanes:  # noqa: SLF001  no getter
            edge, _, index = lane_id.rpartition("_")
            if not edge or not net.hasEdge(edge):
                continue
            for c in net.getEdge(edge).getLane(int(index)).getOutgoing():
                if c.getTo().getFunction() == "walkingarea":
                    continue
                from_walk = c.getFrom().getFunction() == "walkingarea"
                if from_walk and c.getTo().getFunction() != "crossing":
                    continue
                links[id(c)] = number
                if from_walk:
                    walked[node.getID()] = walked.get(node.getID(), frozenset()) | {number}
                number += 1
    return links, walked
