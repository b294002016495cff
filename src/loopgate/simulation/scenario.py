"""A scenario: everything that determines a run, from a file, a mapping or the command line."""

from __future__ import annotations

import dataclasses
import inspect
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import tomli_w

from loopgate.errors import LoopgateError, ScenarioError
from loopgate.reading import is_file, meant, shown
from loopgate.simulation.scenario_checks import check
from loopgate.simulation.values import Rule, amounts, checked, choice, flag, length_range, real, text, whole
from loopgate.vehicles.air import CENTRAL, AirSettings, read_decide

ABSTRACTIONS = ("segments", "queues")
LIGHTS = ("off", "keep", "obey")
SPACINGS = ("none", "hold", "advice")
STANDING = ("contain", "wait")
STARTS = ("random", "even")
DRIVERS = ("human", "machine")
ON_DEADLOCK = ("stop", "continue", "teleport")
SERVE_AFTER_S = 60.0
"""Default of `Scenario.serve_after_s` [s]."""

_MANY = 1_000_000
_LONG_S = 1e8  # three years
_LARGEST_SEED = 2**31 - 1  # SUMO's


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """All settings of a run. The same scenario and software versions give the same events.

    The annotation of each field gives its values. Any other value is refused, from a file, the command line
    or Python. So is a gate or negotiation that is not installed or has no such option.

    Attributes
    ----------
    network
        A ``.net.xml`` or ``.net.xml.gz`` file, a ``.sumocfg``, or ``sumo:NAME`` for a network of the SUMO
        package.
    routes
        Route file or ``.sumocfg`` with the closed loops; empty to make random ones.
    loops
        Number of random loops if there is no route file; 0 for a loop per vehicle, at most 40.
    loop_length_m
        Shortest and longest random loop [m].
    max_shared
        Largest share of a random loop's length in zones with other loops, 0 to 1; 1 for no bound.
    u_turns
        Whether vehicles on random loops may turn round at junctions.
    loops_seed
        Seed of the random loops.
    vehicles
        Number of vehicles; 0 for a vehicle per loop.
    vehicles_per_km
        Instead of `vehicles`: number for each kilometre of a loop, at least one per loop; 0 if not used.
    on_loops
        Instead of `vehicles`: number on each loop, ``loop0=3,loop4=1``; the other loops have none.
    types
        Vehicle types of the route file, or SUMO's vehicle classes, with their shares: ``bus=1,car=4``. Empty
        for the types of the loops in the route file, or cars.
    drivers
        ``human``: SUMO's drivers by their vehicle types. ``machine``: no dawdling, no spread of speeds, and a
        headway of half a second or a step, also under ``open``.
    starts
        ``even``: more vehicles on loops with longer lap times, evenly spaced in time. ``random``: equally
        many vehicles on each loop, at random positions, unless the route file gives positions. Empty for
        ``even`` if the number of vehicles of each loop is given, otherwise ``random``.
    stops
        Additional files, separated by commas, with the bus stops and parking areas of the route files. SUMO
        loads all of their content, persons too.
    traffic
        Route file or ``.sumocfg`` with ordinary vehicles, which drive by SUMO's rules; empty for none. If it
        names the configuration that is the network, the loops are random.
    gate
        A gate's name, with options behind a colon. ``open``: SUMO's right of way rules. ``file.py:Name``: a
        class or function of your own.
    who
        The gated vehicles among trips: ``all``, ``loops`` for no trip, a vehicle type, or a file with names.
        The other trips are ordinary traffic. Empty for ``all``.
    abstraction
        ``segments`` or ``queues``.
    negotiation
        A negotiation's name, with options behind a colon; empty for ``oldest`` on segments and ``pressure``
        on queues.
    decide
        ``central``: one program decides; ``vehicles``, with the options ``range`` [m], ``loss`` and ``delay``
        [s]: vehicles and posts at the road decide slots and the chain rule by messages; ``processes``: the
        same, with a process of its own for each vehicle.
    serve_after_s
        Time without a grant after which the gate makes way for a vehicle [s]; 0 for never. For gates that
        promise by the chain rule that every vehicle goes on.
    lights
        ``off``, ``keep`` or ``obey``; empty for ``off`` under a gate and ``keep`` under ``open``.
    spacing
        Even spacing of the vehicles on a loop. ``hold``: a vehicle too far ahead waits some seconds at gates.
        ``advice``: each vehicle is told its speed. ``none``: no spacing. Empty for ``hold`` in a gated run
        with `revisit_s`, otherwise ``none``.
    incidents
        TOML file of closures and breakdowns (`loopgate.network.incidents.read_incidents`); empty for none.
    standing
        ``contain``: no vehicle enters a blocked place (closed, or with a vehicle that stands long), and loops
        are led round it; ``wait``: vehicles wait. For gates that decide by the chain rule.
    rho_m
        Safe radius of the segments abstraction [m].
    piece_m
        Longest piece into which the segments abstraction cuts private road [m].
    revisit_s
        Longest time between visits promised for each street [s]; 0 for no promise.
    weights
        File of lines ``EDGE WEIGHT``: streets to be seen WEIGHT times as often; empty for equal weights.
    districts
        File of polygons: the run gives the figures of each district; empty for none.
    on_deadlock
        ``stop``, ``continue`` or ``teleport`` (the latter under ``open`` only).
    deadlock_after_s
        Time that vehicles must stand in a circle to count as a deadlock [s].
    starving_s
        Time without a grant, hardly driving, after which a vehicle counts as starving [s].
    positions
        Whether SUMO records the position of every vehicle at every step, for the audit.
    fcd, tripinfo, edgedata
        Whether SUMO writes these outputs into the run folder: ``fcd.xml.gz``, ``tripinfo.xml``,
        ``edgedata.xml``.
    duration_s, warmup_s
        Measured simulated time, and the time before it [s].
    seed
        Seed of SUMO, of the starting places and of the negotiation. A configuration's seed, step and duration
        hold if the scenario does not give its own.
    step_s
        Length of a simulation step [s]; under a gate at most 1.
    sumo
        More options for SUMO, by their long names.

    Examples
    --------
    >>> from loopgate import Scenario
    >>> Scenario(network="sumo:DRT", loops=20, vehicles=60, gate="banker").command("out/drt")
    'loopgate run sumo:DRT --loops 20 --vehicles 60 --gate banker -o out/drt'
    """

    network: Annotated[str, text()]
    # Loops
    routes: Annotated[str, text()] = ""
    loops: Annotated[int, whole(0, _MANY)] = 0
    loop_length_m: Annotated[tuple[float, float], length_range(1e6)] = (400.0, 2000.0)
    max_shared: Annotated[float, real(0.0, 1.0)] = 1.0
    u_turns: Annotated[bool, flag()] = False
    loops_seed: Annotated[int, whole(0, _LARGEST_SEED)] = 1
    # Vehicles
    vehicles: Annotated[int, whole(0, _MANY)] = 0
    vehicles_per_km: Annotated[float, real(0.0, 1e3)] = 0.0
    on_loops: Annotated[str, amounts(whole_only=True)] = ""
    types: Annotated[str, amounts(whole_only=False)] = ""
    drivers: Annotated[str, choice(DRIVERS)] = "human"
    starts: Annotated[str, choice(("", *STARTS))] = ""
    stops: Annotated[str, text()] = ""
    traffic: Annotated[str, text()] = ""
    # Gate
    gate: Annotated[str, text()] = "certified"
    who: Annotated[str, text()] = ""
    abstraction: Annotated[str, choice(ABSTRACTIONS)] = "queues"
    negotiation: Annotated[str, text()] = ""
    decide: Annotated[str, text()] = CENTRAL
    serve_after_s: Annotated[float, real(0.0, _LONG_S)] = SERVE_AFTER_S
    lights: Annotated[str, choice(("", *LIGHTS))] = ""
    spacing: Annotated[str, choice(("", *SPACINGS))] = ""
    incidents: Annotated[str, text()] = ""
    standing: Annotated[str, choice(STANDING)] = "contain"
    rho_m: Annotated[float, real(0.01, 1e3)] = 1.25
    piece_m: Annotated[float, real(0.01, 1e6)] = 100.0
    # Watching
    revisit_s: Annotated[float, real(0.0, _LONG_S)] = 0.0
    weights: Annotated[str, text()] = ""
    districts: Annotated[str, text()] = ""
    on_deadlock: Annotated[str, choice(ON_DEADLOCK)] = "stop"
    deadlock_after_s: Annotated[float, real(0.0, _LONG_S)] = 60.0
    starving_s: Annotated[float, real(1.0, _LONG_S)] = 600.0
    # Output
    positions: Annotated[bool, flag()] = False
    fcd: Annotated[bool, flag()] = False
    tripinfo: Annotated[bool, flag()] = False
    edgedata: Annotated[bool, flag()] = False
    # SUMO
    duration_s: Annotated[float, real(1.0, _LONG_S)] = 3600.0
    warmup_s: Annotated[float, real(0.0, _LONG_S)] = 0.0
    seed: Annotated[int, whole(0, _LARGEST_SEED)] = 1
    step_s: Annotated[float, real(0.01, 10.0)] = 1.0
    sumo: Annotated[str, text()] = ""

    def __post_init__(self) -> None:
        for name, rule in _rules().items():
            object.__setattr__(self, name, checked(name, getattr(self, name), rule))
        if not self.network:
            msg = "network: missing; give a .net.xml file, a .sumocfg or sumo:NAME"
            raise ScenarioError(msg)
        check(self)

    @property
    def by_messages(self) -> AirSettings | None:
        """The radio settings if vehicles decide by messages; None if one central program decides."""
        return read_decide(self.decide)

    @property
    def stop_files(self) -> tuple[Path, ...]:
        """The paths of the additional files with stopping places (key `stops`), one by one."""
        return tuple(Path(name.strip()) for name in self.stops.split(",") if name.strip())

    @property
    def gated(self) -> bool:
        """Whether a gate admits moves; False if only SUMO's right of way rules."""
        return self.gate != "open"

    @property
    def rule_for_lights(self) -> str:
        """The treatment of traffic lights: ``off``, ``keep`` or ``obey``."""
        return self.lights or ("off" if self.gated else "keep")

    @property
    def rule_for_gated(self) -> str:
        """The choice of gated vehicles among trips: ``all``, ``loops``, a vehicle type or a file."""
        return self.who or "all"

    @property
    def rule_for_spacing(self) -> str:
        """The method that spaces the vehicles of a loop evenly: ``none``, ``hold`` or ``advice``."""
        return self.spacing or ("hold" if self.gated and self.revisit_s else "none")

    @property
    def counts_vehicles(self) -> bool:
        """Whether the scenario, not the route file, sets the number or types of vehicles."""
        return bool(self.vehicles or self.vehicles_per_km or self.on_loops or self.types)

    @property
    def rule_for_starts(self) -> str:
        """The start positions of vehicles on their loops: ``random`` or ``even``."""
        return self.starts or ("even" if self.vehicles_per_km or self.on_loops else "random")

    @property
    def rule_for_negotiation(self) -> str:
        """The name of the negotiation, which orders simultaneous requests, with its options."""
        return self.negotiation or ("oldest" if self.abstraction == "segments" else "pressure")

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "scenario") -> Scenario:
        """Make a scenario from a mapping; keys may leave out their unit, as in ``duration``.

        Raises
        ------
        ScenarioError
            On unknown names and values that the key may not have; the text says which.
        """
        given: object = data
        if not isinstance(given, Mapping):
            msg = f"{source} is {shown(data)}; expected names and values"
            raise ScenarioError(msg)
        fields = {field.name for field in dataclasses.fields(cls)}
        short = {name.rpartition("_")[0]: name for name in fields if name.endswith(("_s", "_m"))}
        short |= {"step_length": "step_s", "gated": "who"}
        values: dict[str, Any] = {}
        for key, value in data.items():
            name = short.get(key, key)
            if name not in fields:
                there = f"known are {', '.join(sorted(fields))}{meant(key, [*fields, *short])}"
                msg = f"{source}: unknown key {shown(key)}; {there}"
                raise ScenarioError(msg)
            values[name] = value
        if "network" not in values:
            msg = f"{source}: the key 'network' is missing"
            raise ScenarioError(msg)
        try:
            if isinstance(values["network"], str) and is_file(values["network"]):
                from loopgate.simulation.sumo_options import from_configuration  # noqa: PLC0415  reads roads

                values = from_configuration(values["network"]) | values
            return cls(**values)
        except LoopgateError as error:
            msg = f"{source}: {error}"
            raise ScenarioError(msg) from error

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as a mapping of names to plain values."""
        data = dataclasses.asdict(self)
        data["loop_length_m"] = list(self.loop_length_m)
        return data

    def __repr__(self) -> str:
        given = (
            f"{field.name}={getattr(self, field.name)!r}"
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        )
        return f"Scenario({', '.join(given)})"

    def write(self, file: Path) -> None:
        """Write the scenario as a TOML file, which `read_scenario` can read."""
        file.write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")

    def command(self, out: str) -> str:
        """Return the shell command that repeats the run into folder `out`."""
        default = Scenario(network=self.network)
        network = f"./{self.network}" if self.network.startswith("-") else self.network
        words = ["loopgate", "run", network]
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name == "network" or value == getattr(default, field.name):
                continue
            if value is True:
                words.append(f"--{option_name(field.name)}")
                continue
            if field.name == "loop_length_m":
                value = f"{value[0]:g}:{value[1]:g}"
            words += [f"--{option_name(field.name)}", f"{value}"]
        return shlex.join([*words, "-o", out])


def _plain_signature() -> inspect.Signature:
    """Return the signature for `help`: plain types, without the rules of `Annotated`."""
    types, given = get_type_hints(Scenario), inspect.signature(Scenario)
    plain = [one.replace(annotation=types[name]) for name, one in given.parameters.items()]
    return inspect.Signature(plain)


setattr(Scenario, "__signature__", _plain_signature())  # noqa: B010  mypy knows no such attribute


@cache
def _rules() -> Mapping[str, Rule]:
    """Return the rule of each field, from its annotation."""
    hints = get_type_hints(Scenario, include_extras=True)
    return {field.name: hints[field.name].__metadata__[0] for field in dataclasses.fields(Scenario)}


def kinds() -> dict[str, tuple[type, Rule]]:
    """Return the type and the rule of each field, from its annotation."""
    plain = get_type_hints(Scenario)
    return {name: (plain[name], rule) for name, rule in _rules().items()}


_OPTION = {"who": "gated", "loop_length_m": "length", "step_s": "step-length"}


def option_name(field: str) -> str:
    """Return the name of a field's option on the command line, without ``--``.

    >>> option_name("serve_after_s")
    'serve-after'
    """
    return _OPTION.get(field) or field.removesuffix("_s").removesuffix("_m").replace("_", "-")
