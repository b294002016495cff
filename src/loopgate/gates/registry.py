"""Gates by name, found through the entry-point group ``loopgate.gates``.

A package of yours adds a gate with two lines in its pyproject.toml::

    [project.entry-points."loopgate.gates"]
    mine = "my_package.my_gate:MyGate"

and it works wherever a gate is named: ``loopgate run --gate mine``, ``mine:option=3``. Without a package,
``my_gate.py:MyGate`` names a class or function in a file.
"""

from collections.abc import Callable, Mapping
from importlib.metadata import entry_points

from loopgate.errors import GateError
from loopgate.gates.base import Gate, TimedGate
from loopgate.gates.following import check_methods
from loopgate.model import System
from loopgate.plugins import Plugins, blaming, is_ours
from loopgate.reading import of_kind, shown

_GATES = Plugins("gate", "loopgate.gates", GateError, "a System and its options")


def gate_names() -> list[str]:
    """Return the names of all installed gates, sorted.

    Examples
    --------
    >>> from loopgate.gates import gate_names
    >>> "certified" in gate_names()
    True
    """
    return sorted({point.name for point in entry_points(group=_GATES.group)})


def name_gate(gate: object) -> str:
    """Return the name of a gate class, or of a function that makes a gate from a `System`.

    A name is returned as it is. Raises `GateError` for anything else.

    Examples
    --------
    >>> from loopgate.gates import name_gate
    >>> from loopgate.gates.banker import BankerGate
    >>> name_gate(BankerGate)
    'banker'
    """
    if isinstance(gate, Gate) and not isinstance(gate, type):
        msg = f"gate {type(gate).__name__}: a run makes its gate for its own system; give the class"
        raise GateError(msg)
    return _GATES.name_of(gate)


def check_gate(spec: str) -> None:
    """Check the name and the options of a gate before a system exists.

    For every gate the names and types of options are checked. A gate with a static method ``check_options``
    checks their values too.

    Raises `GateError` if the gate or an option is unknown, or an option has an invalid value.

    Examples
    --------
    >>> from loopgate import LoopgateError
    >>> from loopgate.gates import check_gate
    >>> check_gate("certified:promise=everyone")
    >>> try:
    ...     check_gate("certified:speed=fast")
    ... except LoopgateError as error:
    ...     print(error)
    gate certified: unknown option 'speed'; its options are promise, budget, patience, budget_ms
    """

    def check(factory: Callable[..., object], options: Mapping[str, object]) -> None:
        checks = getattr(factory, "check_options", None)
        if checks is not None:
            checks(**options)

    _GATES.make(spec, check)


def make_gate(gate: object, system: System, clock: Callable[[], float] | None = None) -> Gate:
    """Make a gate for a system, by the gate's name.

    Raises `GateError` if the gate or an option is unknown, or the gate refuses the system's start. Raises
    `PluginError` if a user's own gate fails, or has methods with other parameters than `Gate`.

    Parameters
    ----------
    gate
        A name (``name`` or ``name:option=value,...``), or a class or function that makes a gate.
    clock
        Function that returns the time [s], for gates with a limit on time; without it there is no limit.

    Examples
    --------
    >>> from loopgate import Robot, System, make_gate
    >>> system = System([Robot("a", ("s1", "s2")), Robot("b", ("s2", "s3"))])
    >>> gate = make_gate("collision", system)
    >>> decision = gate.decide(system.initial, 0)
    >>> decision.admitted, str(decision.reason)
    (False, 'occupied')
    """
    spec = name_gate(gate)
    of_kind(System, system, f"gate {spec}: system", GateError, "a System")
    made: object = _GATES.make(spec, lambda f, o: f(system, **o))
    if not isinstance(made, Gate) or isinstance(made, type):
        msg = f"gate {spec}: it makes {shown(made)}, which is no gate; expected the methods decide and moved"
        raise GateError(msg)
    if not is_ours(made):
        check_methods(made, spec)
    if clock is not None and isinstance(made, TimedGate):
        with blaming(f"gate {spec}: use_clock", "it to take a clock"):
            made.use_clock(clock)
    return made
