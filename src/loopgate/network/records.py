"""Light records of a road network: lanes, edges, movements, junctions."""

from dataclasses import dataclass

Points = tuple[tuple[float, float], ...]
"""A polyline: (x, y) [m] in the network's coordinates."""


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
    """Name of the traffic light and index of the link; None without a light."""

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

    @property
    def regulated(self) -> bool:
        """Whether the junction has right of way; without it, SUMO's drivers ignore vehicles inside."""
        return bool(self.foes)
