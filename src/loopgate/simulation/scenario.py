"""A scenario: everything that determines a run, from a file, a mapping or the command line."""

from __future__ import annotations

import dataclasses
import inspect
import numbers
import operator
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple, NoReturn, get_type_hints

import tomli_w

from loopgate.errors import LoopgateError, ScenarioError
from loopgate.gates import check_gate
from loopgate.negotiation.registry import check_negotiation
from loopgate.plugins import in_file
from loopgate.reading import as_path, is_file, is_plain, meant, read_toml, shown
from loopgate.simulation.sumo_words import OUTPUTS, own_words
from loopgate.vehicles.air import CENTRAL, AirSettings, read_decide

_LARGEST_AMOUNT = 1e6

_LONGEST_TEXT = 4096
"""Most characters of a text; a path can be this long."""


@dataclass(frozen=True, slots=True)
class Rule:
    """The rule for one kind of value.

    Attributes
    ----------
    expected
        The allowed values, in words for messages.
    accept
        Returns a value in the form in which the scenario has it; raises TypeError or ValueError if the value
        is not allowed.
    words
        The words of a choice; empty for other kinds of value.
    """

    expected: str
    accept: Callable[[object], object]
    words: tuple[str, ...] = ()


class Option(NamedTuple):
    """What the command line says of a field: its heading, its help, and the name of its value."""

    group: str
    help: str
    metavar: str | None = None


def checked(key: str, value: object, rule: Rule) -> object:
    """Return a value in the form in which the scenario has it; refuse a value that is not allowed.

    Raises
    ------
    ScenarioError
        If the key does not allow the value. The text lists the values that it allows.
    """
    try:
        return rule.accept(value)
    except (TypeError, ValueError, OverflowError) as error:
        msg = f"{key} is {shown(value)}; expected {rule.expected}"
        raise ScenarioError(msg) from error


def real(least: float, most: float) -> Rule:
    """Return the rule for a finite number within two bounds."""
    return Rule(f"a number from {least:g} to {most:g}", lambda value: _number(value, least, most))


def begin_time() -> Rule:
    """Return the rule for when a simulation begins [s]; -1 is for a scenario that does not say it."""
    least = real(0.0, _LONG_S)
    return Rule(least.expected, lambda value: -1.0 if value == -1.0 else least.accept(value))


def whole(least: int, most: int) -> Rule:
    """Return the rule for a whole number within two bounds."""

    def accept(value: object) -> int:
        _of_type(value, numbers.Integral)
        number = operator.index(value)  # type: ignore[arg-type]  # numpy's whole numbers have one too
        return number if least <= number <= most else _refuse()

    return Rule(f"a whole number from {least} to {most}", accept)


def length_range(most: float) -> Rule:
    """Return the rule for two lengths [m] above 0, the shorter first, also written ``400:2000``."""

    def accept(value: object) -> tuple[float, float]:
        pair = [float(part) for part in value.split(":")] if isinstance(value, str) else value
        if not isinstance(pair, list | tuple):
            raise TypeError
        low, high = (_number(part, 0.0, most) for part in pair)
        return (low, high) if 0.0 < low <= high else _refuse()

    return Rule(f"two numbers, shortest and longest, above 0 and up to {most:g}", accept)


def some_of(words: Sequence[str]) -> Rule:
    """Return the rule for some of these words, with commas between or as a list."""

    def accept(value: object) -> str:
        given = value.split(",") if isinstance(value, str) else value
        if not isinstance(given, list | tuple):
            raise TypeError
        chosen = [str(one).strip() for one in given if str(one).strip()]
        return ",".join(dict.fromkeys(chosen)) if set(chosen) <= set(words) else _refuse()

    return Rule(f"some of {', '.join(words)}, with commas between", accept)


def text() -> Rule:
    """Return the rule for a text without control characters, which can be a file name; a path becomes one."""

    def accept(value: object) -> str:
        value = os.fspath(value) if isinstance(value, os.PathLike) else value
        if not isinstance(value, str):
            raise TypeError
        return value if len(value) <= _LONGEST_TEXT and is_plain(value) else _refuse()

    return Rule(f"a text of at most {_LONGEST_TEXT} characters, none of them control characters", accept)


def amounts(*, whole_only: bool) -> Rule:
    """Return the rule for positive amounts by name, as a table or ``one=2,other=0.5``."""
    kind = "whole numbers" if whole_only else "numbers"

    def accept(value: object) -> str:
        if isinstance(value, Mapping):
            value = ",".join(f"{name}={amount}" for name, amount in value.items())
        read = parse_amounts(str(text().accept(value)))
        if not all(0.0 < x <= _LARGEST_AMOUNT and not (whole_only and x % 1) for x in read.values()):
            _refuse()
        return ",".join(f"{name}={amount:g}" for name, amount in read.items())

    return Rule(f"names with {kind} above 0: one=2,other=3", accept)


def parse_amounts(words: str) -> dict[str, float]:
    """Return amounts by name, in order; raise `ValueError` if the text is invalid."""
    read: dict[str, float] = {}
    for word in filter(None, words.split(",")):
        name, _, amount = word.rpartition("=")
        if not name.strip() or name.strip() in read:
            _refuse()
        read[name.strip()] = float(amount)
    return read


def choice(words: tuple[str, ...]) -> Rule:
    """Return the rule for a choice of words; the empty word stands for a default."""
    named = tuple(filter(None, words))
    accept: Callable[[object], object] = lambda value: value if value in words else _refuse()  # noqa: E731
    return Rule(f"one of {', '.join(named)}", accept, named)


def flag() -> Rule:
    """Return the rule for yes or no."""
    return Rule("true or false", lambda value: value if isinstance(value, bool) else _refuse())


def _number(value: object, least: float, most: float) -> float:
    _of_type(value, numbers.Real)
    number = float(value)  # type: ignore[arg-type]  # numpy's numbers too
    return number if least <= number <= most else _refuse()


def _of_type(value: object, kind: type) -> None:
    if not isinstance(value, kind) or isinstance(value, bool):
        raise TypeError


def _refuse() -> NoReturn:
    raise ValueError


LONGEST_GATED_STEP_S = 1.0
"""Longest step under a gate [s]: SUMO's drivers keep a headway of one second only if steps are no longer."""


def check(scenario: Scenario) -> None:
    """Raise `ScenarioError` if settings of a scenario contradict each other; the text names them."""
    _check_names(scenario.gate, scenario.rule_for_negotiation)
    _check_incidents(scenario)
    _check_decide(scenario)
    if scenario.traffic and scenario.gated and scenario.abstraction != "queues":
        msg = (
            f"traffic: with gate {scenario.gate} it works on abstraction queues only; on "
            f"{scenario.abstraction} the gate does not know where ordinary vehicles are in the way"
        )
        raise ScenarioError(msg)
    if sum(map(bool, (scenario.vehicles, scenario.vehicles_per_km, scenario.on_loops))) > 1:
        msg = "vehicles, vehicles_per_km, on_loops: each sets the number of vehicles; give one"
        raise ScenarioError(msg)
    if scenario.weights and not scenario.revisit_s:
        msg = "weights: they divide revisit_s, the longest time between visits; give revisit_s too"
        raise ScenarioError(msg)
    if scenario.spacing == "hold" and not scenario.gated:
        msg = "spacing: hold works under a gate only, where vehicles can be held; take advice, or a gate"
        raise ScenarioError(msg)
    if scenario.gated and scenario.step_s > LONGEST_GATED_STEP_S:
        msg = (
            f"step_s is {scenario.step_s}; expected at most {LONGEST_GATED_STEP_S:g} under a gate, or "
            "vehicles drive into each other; gate open takes longer ones"
        )
        raise ScenarioError(msg)
    own = dict(own_words(scenario.sumo))
    twice = [name for name in scenario.wanted_outputs if f"{name}-output" in own]
    if scenario.positions and ("fcd" in scenario.wanted_outputs or "fcd-output" in own):
        twice.append("fcd")
    if twice:
        msg = f"outputs: SUMO writes {twice[0]} to one file only; ask for it once: positions, outputs or sumo"
        raise ScenarioError(msg)
    if scenario.on_deadlock == "teleport" and scenario.gated:
        msg = "on_deadlock: teleport works with gate open only; no gated vehicle jumps past its gate"
        raise ScenarioError(msg)


def _check_incidents(scenario: Scenario) -> None:
    if scenario.incidents and scenario.gated and scenario.abstraction != "queues":
        msg = "incidents: they work on abstraction queues only, where vehicles are led round them"
        raise ScenarioError(msg)


def _check_decide(scenario: Scenario) -> None:
    if scenario.by_messages is None:
        return
    kind = scenario.gate.partition(":")[0], scenario.abstraction
    of_paper = kind == ("algorithm2", "segments") and not scenario.by_messages.processes
    wrong = {
        f"gate {scenario.gate} on {scenario.abstraction}": kind != ("certified", "queues") and not of_paper,
        "traffic": bool(scenario.traffic),
        "incidents": bool(scenario.incidents),
    }
    for what, there in wrong.items():
        if there:
            msg = (
                "decide: vehicles works with gate certified on queues, or algorithm2 on segments (not as "
                f"processes), without ordinary traffic and incidents; found {what}; take central"
            )
            raise ScenarioError(msg)


@lru_cache(maxsize=256)
def _check_names(gate: str, negotiation: str) -> None:
    """Check gate and negotiation as far as possible without roads; cached for sweeps."""
    check_gate(gate)
    check_negotiation(negotiation)


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
        Vehicle types of the route file, or SUMO's vehicle classes, with their shares: ``bus=1,passenger=4``.
        Empty for the types of the loops in the route file, or cars.
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
    move_stops
        Whether a stop at which a vehicle would be in others' way is moved to the nearest position where it is
        not. Otherwise the vehicle is ordinary traffic, or refused if it is on a loop.
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
        Time of standing from which vehicles are looked at: they may be in a deadlock [s].
    starving_s
        Time without a grant, hardly driving, after which a vehicle counts as starving [s].
    positions
        Whether SUMO records the position of every vehicle at every step, for the audit.
    outputs
        What SUMO writes into the run folder, by the names of SUMO's options: ``fcd,tripinfo`` for
        ``fcd.xml.gz`` and ``tripinfo.xml``; also edgedata, lanedata, summary, statistic, queue, stop,
        lanechange, emission and collision.
    begin_s
        When the simulation begins [s]; -1: as a configuration says, otherwise when the first trip departs, or
        at 0.
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
    routes: Annotated[str, text(), Option("Loops", "Route file or .sumocfg with closed loops.")] = ""
    loops: Annotated[
        int, whole(0, _MANY), Option("Loops", "Number of random loops, if there is no --routes.")
    ] = 0
    loop_length_m: Annotated[
        tuple[float, float], length_range(1e6), Option("Loops", "Length of random loops [m].", "MIN:MAX")
    ] = (400.0, 2000.0)
    max_shared: Annotated[
        float,
        real(0.0, 1.0),
        Option("Loops", "Largest share of a random loop in zones with other loops, 0 to 1."),
    ] = 1.0
    u_turns: Annotated[
        bool, flag(), Option("Loops", "Let vehicles on random loops turn round at junctions.")
    ] = False
    loops_seed: Annotated[int, whole(0, _LARGEST_SEED), Option("Loops", "Seed of the random loops.")] = 1
    # Vehicles
    vehicles: Annotated[
        int, whole(0, _MANY), Option("Vehicles", "Number of vehicles. Default: one per loop.")
    ] = 0
    vehicles_per_km: Annotated[
        float,
        real(0.0, 1e3),
        Option("Vehicles", "Number of vehicles per kilometre of loop, in place of --vehicles."),
    ] = 0.0
    on_loops: Annotated[
        str,
        amounts(whole_only=True),
        Option("Vehicles", "Number of vehicles on each loop, in place of --vehicles: loop0=3,loop4=1."),
    ] = ""
    types: Annotated[
        str,
        amounts(whole_only=False),
        Option(
            "Vehicles",
            "Vehicle types and their shares: bus=1,passenger=4. Types of the route file, or SUMO's classes.",
        ),
    ] = ""
    drivers: Annotated[
        str,
        choice(DRIVERS),
        Option("Vehicles", "human (default): as the vehicle types say; machine: no dawdling, short headway."),
    ] = "human"
    starts: Annotated[
        str,
        choice(("", *STARTS)),
        Option(
            "Vehicles",
            "Start positions: random (default), or even (more vehicles on longer laps, evenly spaced).",
        ),
    ] = ""
    stops: Annotated[
        str, text(), Option("Vehicles", "Additional files with the stops that route files name: FILE,FILE.")
    ] = ""
    move_stops: Annotated[
        bool,
        flag(),
        Option("Vehicles", "Move stops where vehicles would be in others' way to the nearest position."),
    ] = False
    traffic: Annotated[
        str,
        text(),
        Option("Vehicles", "Route file or .sumocfg with ordinary vehicles, which keep SUMO's rules."),
    ] = ""
    # Gate
    gate: Annotated[
        str,
        text(),
        Option("Gate", "Gate: name or name:option=value. Under 'open' SUMO's right of way rules."),
    ] = "certified"
    who: Annotated[
        str,
        text(),
        Option(
            "Gate",
            "Vehicles under the gate, if trips are read: all (default), loops, a vType, or a file of names.",
        ),
    ] = ""
    abstraction: Annotated[
        str, choice(ABSTRACTIONS), Option("Gate", "Cut roads into queues (places) or segments (the paper).")
    ] = "queues"
    negotiation: Annotated[
        str,
        text(),
        Option(
            "Gate", "Order of requests: oldest (default on segments), pressure (default on queues), random."
        ),
    ] = ""
    decide: Annotated[
        str,
        text(),
        Option(
            "Gate",
            "Who decides slots and the chain rule: central (default), "
            "vehicles:range=150,loss=0.1,delay=0.2, or processes (of the same options): one for each "
            "vehicle.",
            "WHO",
        ),
    ] = CENTRAL
    serve_after_s: Annotated[
        float,
        real(0.0, _LONG_S),
        Option("Gate", "Serve a vehicle that has waited this long for a grant [s]; 0: never."),
    ] = SERVE_AFTER_S
    lights: Annotated[
        str,
        choice(("", *LIGHTS)),
        Option(
            "Gate",
            "Traffic lights: off (default with a gate), keep (default for open), obey (grants into green).",
        ),
    ] = ""
    spacing: Annotated[
        str,
        choice(("", *SPACINGS)),
        Option(
            "Gate", "Even spacing on loops: none, hold (at gates; default with --revisit), advice (speeds)."
        ),
    ] = ""
    incidents: Annotated[str, text(), Option("Gate", "TOML file of closures and breakdowns.")] = ""
    standing: Annotated[
        str,
        choice(STANDING),
        Option("Gate", "If a vehicle stands long: contain (default) leads loops round it; wait does not."),
    ] = "contain"
    rho_m: Annotated[
        float, real(0.01, 1e3), Option("Gate", "Safe radius of the segments abstraction [m].")
    ] = 1.25
    piece_m: Annotated[
        float, real(0.01, 1e6), Option("Gate", "Longest private piece of the segments abstraction [m].")
    ] = 100.0
    # Watching
    revisit_s: Annotated[
        float,
        real(0.0, _LONG_S),
        Option("Watching", "Name the streets that went unseen for longer than this [s]."),
    ] = 0.0
    weights: Annotated[
        str,
        text(),
        Option("Watching", "File of streets to visit more often: lines EDGE WEIGHT (with --revisit)."),
    ] = ""
    districts: Annotated[
        str,
        text(),
        Option("Watching", "XML file of polygons: the run says how well each district was watched."),
    ] = ""
    on_deadlock: Annotated[
        str, choice(ON_DEADLOCK), Option("Watching", "Stop the run at a deadlock, or continue.")
    ] = "stop"
    deadlock_after_s: Annotated[
        float,
        real(0.0, _LONG_S),
        Option("Watching", "Time of standing after which vehicles may be in a deadlock [s]."),
    ] = 40.0
    starving_s: Annotated[
        float,
        real(1.0, _LONG_S),
        Option("Watching", "Name vehicles that get no grant for this long while others do [s]."),
    ] = 600.0
    # Output
    positions: Annotated[
        bool,
        flag(),
        Option(
            "Output",
            "Record the position of every vehicle at every step; the audit then checks crossings and bodies.",
        ),
    ] = False
    outputs: Annotated[
        str,
        some_of(OUTPUTS),
        Option("Output", f"SUMO writes these into the run folder: {', '.join(OUTPUTS)}.", "NAME,NAME"),
    ] = ""
    # SUMO
    begin_s: Annotated[
        float,
        begin_time(),
        Option("SUMO", "When the simulation begins. Default: as the .sumocfg says, or with the first trip."),
    ] = -1.0
    duration_s: Annotated[float, real(1.0, _LONG_S), Option("SUMO", "Measured simulated time [s].")] = 3600.0
    warmup_s: Annotated[
        float, real(0.0, _LONG_S), Option("SUMO", "Simulated time before the measured time [s].")
    ] = 0.0
    seed: Annotated[
        int, whole(0, _LARGEST_SEED), Option("SUMO", "Seed of SUMO, start positions and negotiation.")
    ] = 1
    step_s: Annotated[float, real(0.01, 10.0), Option("SUMO", "Simulation step [s].")] = 1.0
    sumo: Annotated[
        str, text(), Option("SUMO", "More options for SUMO: '--lanechange-output lc.xml ...'.", "OPTIONS")
    ] = ""

    def __post_init__(self) -> None:
        for name, rule in _rules().items():
            object.__setattr__(self, name, checked(name, getattr(self, name), rule))
        if not self.network:
            msg = "network: missing; give a .net.xml file, a .sumocfg or sumo:NAME"
            raise ScenarioError(msg)
        check(self)

    @property
    def wanted_outputs(self) -> tuple[str, ...]:
        """The outputs that SUMO writes into the run folder, by their names in SUMO's options."""
        return tuple(filter(None, self.outputs.split(",")))

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
        """Make a scenario from a mapping; keys may leave out their unit, as in ``duration = "10min"``.

        Raises
        ------
        ScenarioError
            On unknown names and values that the key may not have; the text says which.
        """
        given: object = data
        if not isinstance(given, Mapping):
            msg = f"{source} is {shown(data)}; expected names and values"
            raise ScenarioError(msg)
        fields = keys()
        values: dict[str, Any] = {}
        for key, value in data.items():
            name = fields.get(key, "")
            if not name:
                there = f"known are {', '.join(sorted(set(fields.values())))}{meant(key, list(fields))}"
                msg = f"{source}: unknown key {shown(key)}; {there}"
                raise ScenarioError(msg)
            values[name] = plain_value(name, value)
        if "network" not in values:
            msg = f"{source}: the key 'network' is missing"
            raise ScenarioError(msg)
        configured: dict[str, Any] = {}
        try:
            if isinstance(values["network"], str) and is_file(values["network"]):
                from loopgate.simulation.sumo_options import from_configuration  # noqa: PLC0415  reads roads

                configured = from_configuration(values["network"], values.get("begin_s", -1.0))
            return cls(**(configured | values))
        except LoopgateError as error:
            key = str(error).partition(" ")[0]
            by_file = key in configured and key not in values
            where = f"{values['network']}: {_CONFIGURED.get(key, key)}: " if by_file else ""
            msg = f"{source}: {where}{error}"
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


@cache
def keys() -> Mapping[str, str]:
    """Return the field of each key that a file may have: its name, also without its unit."""
    fields = [field.name for field in dataclasses.fields(Scenario)]
    short = {name.rpartition("_")[0]: name for name in fields if name.endswith(("_s", "_m"))}
    return {name: name for name in fields} | short | {"step_length": "step_s", "gated": "who"}


def plain_value(field: str, value: object) -> object:
    """Return a time that is written as on the command line in seconds, a path as text; else the value."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, str) and field.endswith("_s"):
        from loopgate.network.clock import time_of_day, with_units  # noqa: PLC0415  help needs no networks

        with suppress(ValueError):
            return time_of_day(value) if field == "begin_s" else with_units(value)
    return value


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


def options() -> dict[str, dict[str, Option]]:
    """Return the options of the command line by heading and field, each in the order of use."""
    hints = get_type_hints(Scenario, include_extras=True)
    found: dict[str, dict[str, Option]] = {}
    for field in dataclasses.fields(Scenario):
        for said in hints[field.name].__metadata__[1:]:
            found.setdefault(said.group, {})[field.name] = said
    return found


def kinds() -> dict[str, tuple[type, Rule]]:
    """Return the type and the rule of each field, from its annotation."""
    plain = get_type_hints(Scenario)
    return {name: (plain[name], rule) for name, rule in _rules().items()}


_OPTION = {"outputs": "write", "who": "gated", "loop_length_m": "length", "step_s": "step-length"}


_CONFIGURED = {"step_s": "step-length", "duration_s": "end"}
"""The option of a configuration that sets a key, where it has another name."""


def option_name(field: str) -> str:
    """Return the name of a field's option on the command line, without ``--``.

    >>> option_name("serve_after_s")
    'serve-after'
    """
    return _OPTION.get(field) or field.removesuffix("_s").removesuffix("_m").replace("_", "-")


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
