"""The road network, read from a SUMO network file. Only this module uses sumolib."""

from __future__ import annotations

import xml.sax
from collections.abc import Collection, Mapping
from copy import copy
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import sumolib
from sumolib.net.lane import SUMO_VEHICLE_CLASSES

from loopgate.cache import Cache, without_collection
from loopgate.errors import NetworkError
from loopgate.network.content import content_identity
from loopgate.network.diagnosis import first_fault
from loopgate.network.inside import check_inside, lanes_over
from loopgate.network.packaged import PACKAGED, packaged_network
from loopgate.network.records import Connection, Edge, Junction, Lane, Points
from loopgate.network.soundness import check_sound
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.xml_file import check_root, open_xml
from loopgate.reading import refusing

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
    """

    def __init__(self) -> None:
        super().__init__(withInternal=True)
        self.waiting: set[tuple[str, int]] = set()
        self.between: set[str] = set()
        self._junction = ""

    def startElement(self, name: str, attrs: Mapping[str, str]) -> None:  # noqa: N802  named by sumolib
        """Take the beginning of an element."""
        super().startElement(name, attrs)
        if name == "junction":
            self._junction = attrs["id"]
            self.between.update([self._junction] if attrs.get("type") == "internal" else ())
        elif name == "request" and attrs.get("cont", "0").lower() in _TRUE:
            self.waiting.add((self._junction, int(attrs["index"])))


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
            allowed = frozenset(lane.getPermissions())
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
                )
            )
        lanes.update((lane.id, lane) for lane in of_edge)
        if function == "":
            normal.append(raw)
            ends = raw.getFromNode().getID(), raw.getToNode().getID()
            edges[raw.getID()] = Edge(raw.getID(), *ends, tuple(of_edge), raw.getName() or "")
    links = _links(net)
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
            signal=(c.getTLSID(), int(c.getTLLinkIndex())) if c.getTLSID() else None,
        )
        for raw in normal
        for index, lane in enumerate(raw.getLanes())
        for c in lane.getOutgoing()
        if c.getTo().getID() in edges
    )
    check_inside(net, file, reader.waiting, reader.between)
    junctions = {node.getID(): _junction(node) for node in net.getNodes()}
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


def _junction(node: Any) -> Junction:  # noqa: ANN401  sumolib has no types
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
    )


def _links(net: Any) -> dict[int, int]:  # noqa: ANN401  sumolib has no types
    """Return the request index of each connection object, by identity.

    Links are numbered along the junction's incoming lanes, then along each lane's connections; sumolib's own
    `getJunctionIndex` counts the same way, from the start for every connection.
    """
    links: dict[int, int] = {}
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
                number += 1
    return links
