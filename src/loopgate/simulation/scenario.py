"""A scenario: everything that determines a run, from a file, a mapping or the command line."""

from __future__ import annotations

import dataclasses
import inspect
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import tomli_w

from loopgate.errors import LoopgateError, ScenarioError
from loopgate.gates import check_gate
from loopgate.negotiation.registry import check_negotiation
from loopgate.plugins import in_file
from loopgate.reading import as_path, is_file, meant, read_toml, shown
from loopgate.simulation.sumo_words import own_words
from loopgate.simulation.values import Rule, amounts, checked, choice, flag, length_range, real, text, whole
from loopgate.vehicles.air import CENTRAL, AirSettings, read_decide

ABSTRACTIONS = ("segments", "queues")
LIGHTS = ("off", "keep", "obey")
SPACINGS = ("none", "hold", "advice")
STANDING = ("contain", "leave", "wait")
STARTS = ("random", "even")
DRIVERS = ("human", "machine")
ARRIVING = ("rolling", "standing")
ON_DEADLOCK = ("stop", "continue", "teleport")
LONGEST_GATED_STEP_S = 1.0
"""Longest step under a gate [s]: SUMO's drivers keep a headway of one second only if steps are no longer."""

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
    stops
        Additional files, separated by commas, with the bus stops and parking areas of the route files. SUMO
        loads all of their content, persons too.
    incidents
        TOML file of closures and breakdowns (`loopgate.network.incidents.read_incidents`); empty for none.
    standing
        ``contain``: no vehicle enters a blocked place (closed, or with a vehicle that stands long), and loops
        are led round it; ``leave``: also, vehicles without another way leave the road until it is free;
        ``wait``: vehicles wait. For gates that decide by the chain rule.
    starving_s
        Time without a grant, hardly driving, after which a vehicle counts as starving [s].
    traffic
        Route file or ``.sumocfg`` with ordinary vehicles, which drive by SUMO's rules; empty for none. If it
        names the configuration that is the network, the loops are random.
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
    gate
        A gate's name, with options behind a colon. ``open``: SUMO's right of way rules. ``file.py:Name``: a
        class or function of your own.
    abstraction
        ``segments`` or ``queues``.
    negotiation
        A negotiation's name, with options behind a colon; empty for ``oldest`` on segments and ``pressure``
        on queues.
    who
        The gated vehicles among trips: ``all``, ``loops`` for no trip, a vehicle type, or a file with names.
        The other trips are ordinary traffic. Empty for ``all``.
    serve_after_s
        Time without a grant after which the gate makes way for a vehicle [s]; 0 for never. For gates that
        promise by the chain rule that every vehicle goes on.
    decide
        ``central``: one program decides; ``vehicles``, with the options ``range`` [m], ``loss`` and ``delay``
        [s]: vehicles and posts at the road decide slots and the chain rule by messages; ``processes``: the
        same, with a process of its own for each vehicle.
    lights
        ``off``, ``keep`` or ``obey``; empty for ``off`` under a gate and ``keep`` under ``open``.
    spacing
        Even spacing of the vehicles on a loop. ``hold``: a vehicle too far ahead waits some seconds at gates.
        ``advice``: each vehicle is told its speed. ``none``: no spacing. Empty for ``hold`` in a gated run
        with `revisit_s`, otherwise ``none``.
    drivers
        ``human``: SUMO's drivers by their vehicle types. ``machine``: no dawdling, no spread of speeds, and a
        headway of half a second or a step, also under ``open``.
    arriving
        ``rolling``: where other vehicles cross, a refused vehicle slows down early, so that it is granted at
        speed; ``standing``: it brakes as late as it can. With ordinary traffic, and where vehicles decide,
        vehicles always arrive as with ``standing``.
    starts
        ``even``: more vehicles on loops with longer lap times, evenly spaced in time. ``random``: equally
        many vehicles on each loop, at random positions, unless the route file gives positions. Empty for
        ``even`` if the number of vehicles of each loop is given, otherwise ``random``.
    revisit_s
        Longest time between visits promised for each street [s]; 0 for no promise.
    weights
        File of lines ``EDGE WEIGHT``: streets to be seen WEIGHT times as often; empty for equal weights.
    districts
        File of polygons: the run gives the figures of each district; empty for none.
    duration_s, warmup_s
        Measured simulated time, and the time before it [s].
    seed
        Seed of SUMO, of the starting places and of the negotiation. A configuration's seed, step and duration
        hold if the scenario does not give its own.
    step_s
        Length of a simulation step [s]; under a gate at most 1.
    rho_m
        Safe radius of the segments abstraction [m].
    piece_m
        Longest piece into which the segments abstraction cuts private road [m].
    on_deadlock
        ``stop``, ``continue`` or ``teleport`` (the latter under ``open`` only).
    deadlock_after_s
        Time that vehicles must stand in a circle to count as a deadlock [s].
    positions
        Whether SUMO records the position of every vehicle at every step, for the audit.
    fcd, tripinfo, edgedata
        Whether SUMO writes these outputs into the run folder: ``fcd.xml.gz``, ``tripinfo.xml``,
        ``edgedata.xml``.
    sumo
        More options for SUMO, by their long names.

    Examples
    --------
    >>> from loopgate import Scenario
    >>> Scenario(network="sumo:DRT", loops=20, vehicles=60, gate="banker").command("out/drt")
    'loopgate run sumo:DRT --loops 20 --vehicles 60 --gate banker -o out/drt'
    """

    network: Annotated[str, text()]
    routes: Annotated[str, text()] = ""
    stops: Annotated[str, text()] = ""
    incidents: Annotated[str, text()] = ""
    standing: Annotated[str, choice(STANDING)] = "contain"
    starving_s: Annotated[float, real(1.0, _LONG_S)] = 600.0
    traffic: Annotated[str, text()] = ""
    loops: Annotated[int, whole(0, _MANY)] = 0
    loop_length_m: Annotated[tuple[float, float], length_range(1e6)] = (400.0, 2000.0)
    max_shared: Annotated[float, real(0.0, 1.0)] = 1.0
    u_turns: Annotated[bool, flag()] = False
    loops_seed: Annotated[int, whole(0, _LARGEST_SEED)] = 1
    vehicles: Annotated[int, whole(0, _MANY)] = 0
    vehicles_per_km: Annotated[float, real(0.0, 1e3)] = 0.0
    on_loops: Annotated[str, amounts(whole_only=True)] = ""
    types: Annotated[str, amounts(whole_only=False)] = ""
    gate: Annotated[str, text()] = "certified"
    abstraction: Annotated[str, choice(ABSTRACTIONS)] = "queues"
    negotiation: Annotated[str, text()] = ""
    who: Annotated[str, text()] = ""
    serve_after_s: Annotated[float, real(0.0, _LONG_S)] = SERVE_AFTER_S
    decide: Annotated[str, text()] = CENTRAL
    lights: Annotated[str, choice(("", *LIGHTS))] = ""
    spacing: Annotated[str, choice(("", *SPACINGS))] = ""
    drivers: Annotated[str, choice(DRIVERS)] = "human"
    arriving: Annotated[str, choice(ARRIVING)] = "standing"
    starts: Annotated[str, choice(("", *STARTS))] = ""
    revisit_s: Annotated[float, real(0.0, _LONG_S)] = 0.0
    weights: Annotated[str, text()] = ""
    districts: Annotated[str, text()] = ""
    duration_s: Annotated[float, real(1.0, _LONG_S)] = 3600.0
    warmup_s: Annotated[float, real(0.0, _LONG_S)] = 0.0
    seed: Annotated[int, whole(0, _LARGEST_SEED)] = 1
    step_s: Annotated[float, real(0.01, 10.0)] = 1.0
    rho_m: Annotated[float, real(0.01, 1e3)] = 1.25
    piece_m: Annotated[float, real(0.01, 1e6)] = 100.0
    on_deadlock: Annotated[str, choice(ON_DEADLOCK)] = "stop"
    deadlock_after_s: Annotated[float, real(0.0, _LONG_S)] = 60.0
    positions: Annotated[bool, flag()] = False
    fcd: Annotated[bool, flag()] = False
    tripinfo: Annotated[bool, flag()] = False
    edgedata: Annotated[bool, flag()] = False
    sumo: Annotated[str, text()] = ""

    def __post_init__(self) -> None:
        for name, rule in _rules().items():
            object.__setattr__(self, name, checked(name, getattr(self, name), rule))
        if not self.network:
            msg = "network: missing; give a .net.xml file, a .sumocfg or sumo:NAME"
            raise ScenarioError(msg)
        _check_names(self.gate, self.rule_for_negotiation)
        self._check_incidents()
        self._check_decide()
        if self.traffic and self.gated and self.abstraction != "queues":
            msg = (
                f"traffic: with gate {self.gate} it works on abstraction queues only; on {self.abstraction} "
                "the gate does not know where ordinary vehicles are in the way"
            )
            raise ScenarioError(msg)
        if sum(map(bool, (self.vehicles, self.vehicles_per_km, self.on_loops))) > 1:
            msg = "vehicles, vehicles_per_km, on_loops: each sets the number of vehicles; give one"
            raise ScenarioError(msg)
        if self.weights and not self.revisit_s:
            msg = "weights: they divide revisit_s, the longest time between visits; give revisit_s too"
            raise ScenarioError(msg)
        if self.spacing == "hold" and not self.gated:
            msg = "spacing: hold works under a gate only, where vehicles can be held; take advice, or a gate"
            raise ScenarioError(msg)
        if self.gated and self.step_s > LONGEST_GATED_STEP_S:
            msg = (
                f"step_s is {self.step_s}; expected at most {LONGEST_GATED_STEP_S:g} under a gate, or "
                "vehicles drive into each other; gate open takes longer ones"
            )
            raise ScenarioError(msg)
        own = dict(own_words(self.sumo))
        if (self.positions or self.fcd) and ((self.positions and self.fcd) or "fcd-output" in own):
            msg = "fcd: SUMO writes positions to one file only; give positions (positions.csv.gz) or fcd"
            raise ScenarioError(msg)
        if self.on_deadlock == "teleport" and self.gated:
            msg = "on_deadlock: teleport works with gate open only; no gated vehicle jumps past its gate"
            raise ScenarioError(msg)

    def _check_incidents(self) -> None:
        if self.incidents and self.gated and self.abstraction != "queues":
            msg = "incidents: they work on abstraction queues only, where vehicles are led round them"
            raise ScenarioError(msg)

    def _check_decide(self) -> None:
        if self.by_messages is None:
            return
        kind = self.gate.partition(":")[0], self.abstraction
        of_paper = kind == ("algorithm2", "segments") and not self.by_messages.processes
        wrong = {
            f"gate {self.gate} on {self.abstraction}": kind != ("certified", "queues") and not of_paper,
            "traffic": bool(self.traffic),
            "incidents": bool(self.incidents),
        }
        for what, there in wrong.items():
            if there:
                msg = (
                    "decide: vehicles works with gate certified on queues, or algorithm2 on segments (not as "
                    f"processes), without ordinary traffic and incidents; found {what}; take central"
                )
                raise ScenarioError(msg)

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
                words.append("--" + field.name.replace("_", "-"))
                continue
            if field.name == "loop_length_m":
                value = f"{value[0]:g}:{value[1]:g}"
            words += ["--" + _OPTION.get(field.name, field.name).replace("_", "-"), f"{value}"]
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


@lru_cache(maxsize=256)
def _check_names(gate: str, negotiation: str) -> None:
    """Check gate and negotiation as far as possible without roads; cached for sweeps."""
    check_gate(gate)
    check_negotiation(negotiation)


_OPTION = {
    "who": "gated",
    "loop_length_m": "length",
    "revisit_s": "revisit",
    "serve_after_s": "serve_after",
    "starving_s": "starving",
    "duration_s": "duration",
    "warmup_s": "warmup",
    "step_s": "step_length",
    "rho_m": "rho",
    "piece_m": "piece",
    "deadlock_after_s": "deadlock_after",
}


def read_scenario(file: Path | str) -> Scenario:
    """Read a scenario from a TOML file; paths in the file are relative to its folder.

    Raises
    ------
    ScenarioError
        If the file cannot be read or is no valid scenario; the message names the file and the key.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate import read_scenario
    >>> Path("mine.toml").write_text('network = "sumo:DRT"') > 0
    True
    >>> read_scenario("mine.toml").gate
    'certified'
    """
    path = as_path(file, "scenario file", ScenarioError)
    data = read_toml(path, "scenario", ScenarioError)
    for key in ("network", "routes", "incidents", "traffic", "weights", "districts", "who", "gated"):
        name = data.get(key)
        if not isinstance(name, str) or (key in {"who", "gated"} and not is_file(path.parent / name)):
            continue
        if name and not name.startswith("sumo:"):
            data[key] = str(path.parent / name)
    if isinstance(data.get("stops"), str) and data["stops"]:
        data["stops"] = ",".join(str(path.parent / name.strip()) for name in data["stops"].split(","))
    for key in ("gate", "negotiation"):
        where = in_file(data.get(key))
        if where is not None:
            data[key] = f"{path.parent / where.file}:{where.rest}"
    return Scenario.from_dict(data, source=str(file))
