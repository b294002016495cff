"""The states of a robot as parts of the loop of its vehicle."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from loopgate.model import StateId, System
from loopgate.network.loop import LanePosition, Loop

CLEARANCE_M = 1.0
"""Length of a state beyond the vehicles and gaps in it [m]: vehicles stop centimetres off a line, and a rear
leaves a state between two simulation steps."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """A stretch between two states in which a vehicle never waits (a movement over a junction)."""

    id: str
    """The movement's name; vehicles on the same movement follow each other."""
    foes: frozenset[str]
    """Movements that must not be under way at the same time. Symmetric."""
    overlaps: Mapping[str, tuple[float, float]] = field(default_factory=dict, hash=False)
    """For a foe, positions after the ``end_m`` of the leg before [m]: of the front from which a vehicle on
    this crossing can touch a vehicle on the foe, and of the rear beyond which it no longer can. A foe
    without an entry is in the way all along."""
    speed_mps: float = math.inf
    """Lowest speed limit on the crossing."""
    ahead_m: float = 0.0
    """Distance from the ``end_m`` of the leg before to its beginning [m]."""
    wait_m: float = -math.inf
    """The last position, after that ``end_m``, at which SUMO may let a vehicle wait for a vehicle with the
    right of way: inside the junction, or at its beginning; minus infinity if there is none [m]."""
    limits: tuple[tuple[float, float], ...] = ()
    """The speed limits before and on it: position after that ``end_m`` from which each holds [m], and limit
    [m/s]."""
    from_lane: str = ""
    to_lane: str = ""
    """`from_lane` and `to_lane`: the lanes before and after the crossing."""

    def soonest(self, to_m: float) -> tuple[float, float]:
        """Return the least time from the ``end_m`` of the leg before [s], and the lowest limit [m/s]."""
        time_s, least_mps = 0.0, self.speed_mps
        for (begin_m, limit_mps), (end_m, _) in pairwise((*self.limits, (math.inf, 0.0))):
            if begin_m < to_m:
                time_s += (min(end_m, to_m) - begin_m) / limit_mps
                least_mps = min(least_mps, limit_mps)
        return time_s, least_mps


@dataclass(frozen=True, slots=True)
class Guide:
    """A stop that makes a vehicle take the lanes of its loop.

    A vehicle with a stop on a lane drives to that lane. The stop is removed, usually before the vehicle has
    to brake for it, once the vehicle is on the lane, or has changed to another.
    """

    edge: str
    lane: int
    position_m: float
    """`edge`, `lane` and `position_m`: the stop."""
    from_m: float
    """Position after the ``end_m`` of the leg before [m]. Without `to_lane`, the stop is removed when the
    front is there; otherwise the vehicle may change lanes when its rear is there."""
    to_lane: int | None = None
    """The lane to change to, beside `lane`."""


NOWHERE = LanePosition("", 0, 0.0)
"""End of legs that are on no road."""


@dataclass(frozen=True, slots=True)
class DrawnLeg:
    """A state on a vehicle's loop, in arc length from the beginning of the loop."""

    state: StateId
    begin_m: float
    end_m: float
    """The part of the loop that is this state [m]; a refused vehicle stops with its front before ``end_m``.
    ``begin_m`` may be negative, or ``end_m`` beyond the loop's length, if the state lies across the loop's
    beginning. ``end_m`` lies on a normal lane, never inside a junction, where SUMO cannot hold a vehicle
    reliably, and at least 0.1 m before the lane's end. Moving it upstream only lengthens the state behind
    it."""
    crossings: tuple[Crossing, ...] = ()
    """The crossings between ``end_m`` and the next leg's ``begin_m``; empty where states touch."""
    line: LanePosition = NOWHERE
    """Position of ``end_m`` on the road, where a refused vehicle stops."""
    guides: tuple[Guide, ...] = ()
    """Stops that keep the vehicle on the lanes of its loop between ``end_m`` and the next leg, in order."""
    slot_m: float = 0.0
    """Length that the longest visitor takes with its gap [m]; 0 if vehicles do not queue here."""
    away: bool = False
    """Whether the leg is beyond the end of an open route: not on the road, and never full."""


@dataclass(frozen=True, slots=True)
class Itinerary:
    """A loop with its legs in driving order; leg ``k`` is position ``k`` of its robots' paths."""

    loop: Loop
    legs: tuple[DrawnLeg, ...] = ()
    """The legs in ascending order of ``begin_m``; none for vehicles without a gate."""
    keeps_lane: bool = False
    """Whether vehicles change lanes only where a `Guide` says so, and are on one lane in each state."""


@dataclass(frozen=True, slots=True)
class Abstraction:
    """A system, and the path of each of its robots on the road."""

    name: str
    """``segments`` or ``queues``."""
    system: System
    """Robots (vehicles), states and capacities, with the start positions."""
    itineraries: tuple[Itinerary, ...]
    """One itinerary per robot, in the system's order; robots on one loop share an itinerary."""
    starts_m: tuple[float, ...]
    """Start position of each robot's front, as arc length on its loop [m]. The whole vehicle is on one normal
    lane, within the leg of the robot's start position."""
    warnings: tuple[str, ...] = field(default=())
    """Warnings for the user about a network that does not suit this abstraction."""
    later: tuple[Itinerary, ...] = ()
    """The itineraries of vehicles that join later."""
    room: Mapping[str, int] = field(default_factory=dict, hash=False)
    """Capacity of each state that a robot or vehicle visits, by name; empty on segments."""
