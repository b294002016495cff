"""A scenario: everything that determines a run, from a file, a mapping or the command line."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import tomli_w

from loopgate.errors import ScenarioError

__all__ = ["Scenario", "read_scenario"]

ABSTRACTIONS = ("segments", "queues")
LIGHTS = ("off", "keep", "obey")
ON_DEADLOCK = ("stop", "continue", "teleport")
LONGEST_GATED_STEP_S = 1.0
"""SUMO's drivers keep apart by tau, a second, and only if they look as often."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """Everything that determines a run. The same scenario and versions give the same events.

    Attributes
    ----------
    network
        A ``.net.xml`` or ``.net.xml.gz`` file, a ``.sumocfg``, or ``sumo:NAME`` for a network of the SUMO
        package.
    routes
        Route file or ``.sumocfg`` with the closed loops; empty to make random ones.
    traffic
        Route file or ``.sumocfg`` with ordinary vehicles, which drive by SUMO's rules beside those on loops;
        empty for none. If it names the configuration that is the network, the loops are random.
    loops
        How many random loops to make where there is no route file; 0 for one per vehicle, at most 40.
    loop_length_m
        Shortest and longest random loop [m].
    max_shared
        Largest share of a random loop's length in zones with others, 0 to 1; 1 for no bound.
    u_turns
        Whether vehicles on random loops may turn round at junctions.
    loops_seed
        Seed of the random loops.
    vehicles
        How many vehicles; 0 for one per loop.
    gate
        A gate's name, with options behind a colon; ``open`` leaves all to SUMO's right of way.
    abstraction
        ``segments`` or ``queues``.
    negotiation
        A negotiation's name, with options behind a colon; empty for ``oldest`` on segments and
        ``pressure``, which counts waiting too, on queues.
    lights
        ``off``, ``keep`` or ``obey``; empty for ``off`` under a gate and ``keep`` under ``open``.
    duration_s, warmup_s
        Simulated time that is measured, and before it begins [s].
    seed
        Seed of SUMO, of the starting places and of the negotiation.
    step_s
        Length of a simulation step [s]; under a gate at most 1.
    rho_m
        Safe radius of the segments abstraction [m].
    piece_m
        Longest piece into which the segments abstraction cuts private road [m].
    on_deadlock
        ``stop``, ``continue`` or ``teleport`` (the latter under ``open`` only).
    deadlock_after_s
        How long vehicles must have been standing in a circle [s].
    positions
        Whether SUMO records where every vehicle is at every step, and the audit checks it.
    """

    network: str
    routes: str = ""
    traffic: str = ""
    loops: int = 0
    loop_length_m: tuple[float, float] = (400.0, 2000.0)
    max_shared: float = 1.0
    u_turns: bool = False
    loops_seed: int = 1
    vehicles: int = 0
    gate: str = "certified"
    abstraction: str = "queues"
    negotiation: str = ""
    lights: str = ""
    duration_s: float = 3600.0
    warmup_s: float = 0.0
    seed: int = 1
    step_s: float = 1.0
    rho_m: float = 1.25
    piece_m: float = 100.0
    on_deadlock: str = "stop"
    deadlock_after_s: float = 60.0
    positions: bool = False

    def __post_init__(self) -> None:
        self._one_of("abstraction", ABSTRACTIONS)
        self._one_of("lights", ("", *LIGHTS))
        self._one_of("on_deadlock", ON_DEADLOCK)
        self._at_least("duration_s", 1.0)
        for field in ("loops", "vehicles", "warmup_s", "seed", "loops_seed", "deadlock_after_s"):
            self._at_least(field, 0)
        for field in ("step_s", "rho_m", "piece_m"):
            self._at_least(field, 0.01)
        if not self.network:
            msg = "network: missing; give a .net.xml file, a .sumocfg or sumo:NAME"
            raise ScenarioError(msg)
        if not 0.0 <= self.max_shared <= 1.0:
            msg = f"max_shared: {self.max_shared:g} is not between 0 and 1"
            raise ScenarioError(msg)
        low, high = self.loop_length_m
        if not 0 < low <= high:
            msg = f"loop_length_m: {low:g}:{high:g} is no range; expected 0 < shortest <= longest"
            raise ScenarioError(msg)
        if self.traffic and self.gated and self.abstraction != "queues":
            msg = (
                f"traffic: with gate {self.gate} it works on abstraction queues only; on {self.abstraction} "
                "nothing says where ordinary vehicles are in the way"
            )
            raise ScenarioError(msg)
        if self.gated and self.step_s > LONGEST_GATED_STEP_S:
            msg = (
                f"step_s: {self.step_s:g} s is too long under a gate, vehicles drive into each other; "
                f"take at most {LONGEST_GATED_STEP_S:g} s, or gate open"
            )
            raise ScenarioError(msg)
        if self.on_deadlock == "teleport" and self.gated:
            msg = "on_deadlock: teleport works with gate open only; no gated vehicle jumps past its gate"
            raise ScenarioError(msg)

    @property
    def gated(self) -> bool:
        """Whether a gate rules, and not SUMO's right of way."""
        return self.gate != "open"

    @property
    def rule_for_lights(self) -> str:
        """What happens to traffic lights: ``off``, ``keep`` or ``obey``."""
        return self.lights or ("off" if self.gated else "keep")

    @property
    def rule_for_negotiation(self) -> str:
        """Who goes first among those who may: a negotiation's name, with options behind a colon."""
        return self.negotiation or ("oldest" if self.abstraction == "segments" else "pressure")

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "scenario") -> Scenario:
        """Make a scenario from names and values; ``duration`` and the like may leave out their unit.

        Raises
        ------
        ScenarioError
            On unknown names and values of the wrong type; the text says which.
        """
        hints = get_type_hints(cls)
        fields = {field.name for field in dataclasses.fields(cls)}
        short = {name.rpartition("_")[0]: name for name in fields if name.endswith(("_s", "_m"))}
        short["step_length"] = "step_s"
        values: dict[str, Any] = {}
        for key, value in data.items():
            name = short.get(key, key)
            if name not in fields:
                msg = f"{source}: unknown key {key!r}; known are {', '.join(sorted(fields))}"
                raise ScenarioError(msg)
            values[name] = _convert(name, value, hints[name], source)
        if "network" not in values:
            msg = f"{source}: the key 'network' is missing"
            raise ScenarioError(msg)
        try:
            return cls(**values)
        except ScenarioError as error:
            msg = f"{source}: {error}"
            raise ScenarioError(msg) from error

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as names and plain values."""
        data = dataclasses.asdict(self)
        data["loop_length_m"] = list(self.loop_length_m)
        return data

    def write(self, file: Path) -> None:
        """Write the scenario as a TOML file that `read_scenario` reads back."""
        file.write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")

    def command(self, out: str) -> str:
        """Return the shell command that repeats the run into folder `out`."""
        default = Scenario(network=self.network)
        words = ["loopgate", "run", self.network]
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
        return " ".join([*words, "-o", out])

    def _one_of(self, field: str, choices: tuple[str, ...]) -> None:
        value = getattr(self, field)
        if value not in choices:
            msg = f"{field}: {value!r} is unknown; choose from {', '.join(c for c in choices if c)}"
            raise ScenarioError(msg)

    def _at_least(self, field: str, least: float) -> None:
        value = getattr(self, field)
        if not value >= least:
            msg = f"{field}: {value:g} is too small; expected at least {least:g}"
            raise ScenarioError(msg)


_OPTION = {
    "loop_length_m": "length",
    "duration_s": "duration",
    "warmup_s": "warmup",
    "step_s": "step_length",
    "rho_m": "rho",
    "piece_m": "piece",
    "deadlock_after_s": "deadlock_after",
}


def read_scenario(file: Path | str) -> Scenario:
    """Read a ``scenario.toml``; the paths in it are relative to its folder.

    Raises
    ------
    ScenarioError
        If it cannot be read or is no valid scenario; the text names the file and the key.
    """
    path = Path(file)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"{file}: cannot read the scenario ({error.strerror or error})"
        raise ScenarioError(msg) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        msg = f"{file}: not a TOML file ({error})"
        raise ScenarioError(msg) from error
    for key in ("network", "routes", "traffic"):
        name = data.get(key)
        if isinstance(name, str) and name and not name.startswith("sumo:"):
            data[key] = str(path.parent / name)
    return Scenario.from_dict(data, source=str(file))


def _convert(name: str, value: object, kind: Any, source: str) -> Any:  # noqa: ANN401  any field's type
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if kind is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if (kind is str or kind is bool) and isinstance(value, kind):
        return value
    if get_args(kind) == (float, float):
        pair = value.split(":") if isinstance(value, str) else value
        try:
            low, high = (float(v) for v in pair)  # type: ignore[attr-defined]  # checked by the except
        except (TypeError, ValueError):
            pass
        else:
            return (low, high)
        wanted = "two numbers, shortest and longest"
    else:
        wanted = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}[kind]
    msg = f"{source}: {name} is {value!r}; expected {wanted}"
    raise ScenarioError(msg)
