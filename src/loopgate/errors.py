"""Errors that a user can act on.

Every error the package raises on purpose derives from `LoopgateError`; its text is one line that says
which file, robot, state or edge is concerned, what was found, and what was expected or how to go on.
The command line prints that line and exits with code 2.
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
"""Control characters, line ends, and halves of characters, which no encoding can write."""


_LONGEST = 2_000
"""Longest message, in characters; beyond, its middle is left out: it lists names without end."""


class LoopgateError(Exception):
    """The base class of all errors that loopgate raises on purpose; the message is always one line.

    Examples
    --------
    >>> from loopgate import LoopgateError, RoadNetwork
    >>> try:
    ...     RoadNetwork.open("networks/nowhere.net.xml")
    ... except LoopgateError as error:
    ...     print(error)
    networks/nowhere.net.xml: there is no such file; expected a SUMO network
    """

    def __str__(self) -> str:
        text = UNPRINTABLE.sub(_printable, super().__str__())
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 4 :]}"


def _printable(found: re.Match[str]) -> str:
    return " " if found[0].isspace() else ascii(found[0])[1:-1]


class SystemModelError(LoopgateError):
    """A system of robots and states that breaks a rule of the model."""


class SystemFileError(SystemModelError):
    """A system file that cannot be read, or describes no valid system."""


class IllegalMoveError(LoopgateError):
    """A requested move that the model does not allow in that configuration."""


class GateError(LoopgateError):
    """An unknown gate, or a bad gate option."""


class PluginError(LoopgateError):
    """A user's own gate or negotiation that failed or gave an invalid answer."""


class UnsafeStartError(GateError):
    """A start from which the gate cannot keep its promise."""


class NetworkError(LoopgateError):
    """A road network that cannot be found, read or used."""


class RouteError(LoopgateError):
    """A route that is not a closed loop, or that a vehicle cannot drive in the network."""


class ScenarioError(LoopgateError):
    """A scenario whose parts do not fit together."""


class NobodyGatedError(ScenarioError):
    """A scenario in which no vehicle can be gated; it can run under the gate ``open``."""


class LoopRefusal(NamedTuple):
    """The reason why an abstraction cannot work with a loop."""

    reason: str
    """The end of a sentence that begins with the name of the loop."""
    edge: str | None = None
    """The edge that is the cause, if one is."""


class RefusedLoopError(ScenarioError):
    """Loops that cannot be cut into places where vehicles queue.

    Attributes
    ----------
    loop
        The name of the first refused loop.
    refused
        The reasons by the names of the loops; the message lists all.
    """

    def __init__(self, refused: Mapping[str, LoopRefusal]) -> None:
        self.loop = next(iter(refused))
        every = "; ".join(f"loop {name} {why.reason}" for name, why in refused.items())
        super().__init__(f"abstraction queues: {every}")
        self.refused = refused


class TooManyVehiclesError(ScenarioError):
    """More vehicles than the places of their loops can hold at the start.

    Attributes
    ----------
    vehicles, loops
        Numbers of vehicles and loops.
    fitting
        Number of vehicles that find a place, counted from the first.
    name
        The first vehicle that finds no place.
    """

    def __init__(self, *, vehicles: int, loops: int, fitting: int, name: str) -> None:
        super().__init__(
            f"abstraction queues: {vehicles} vehicles are too many for {loops} loops; "
            f"the first {fitting} can start so that each vehicle can move ({name} finds no place): "
            f"take at most {fitting}, or more or longer loops"
        )
        self.vehicles = vehicles
        self.loops = loops
        self.fitting = fitting
        self.name = name


class TrafficError(LoopgateError):
    """A call that SUMO refused, or a SUMO that has stopped."""


class ClosedLaneError(TrafficError):
    """A stop on a lane that is closed to the vehicle, which SUMO refuses."""


class SecondSimulationError(TrafficError):
    """A second simulation in a process in which libsumo already runs a simulation."""

    def __init__(self, owner: str) -> None:
        super().__init__(
            f"libsumo has one simulation at a time in a process, and {owner} is under way in this one: start "
            f"it after that has ended, in a process of its own (loopgate sweep, or multiprocessing with "
            f"spawn), or by traci (backend='traci', --traci)"
        )


class AnalysisError(LoopgateError):
    """A table or a period that an analysis function cannot work on."""


class ResultsError(LoopgateError):
    """A folder or file of results that cannot be read or written."""


class SweepError(LoopgateError):
    """A sweep with an invalid description, executor or results folder."""
