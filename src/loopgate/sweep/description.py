"""Sweep files: a grid of scenarios, with a stable key for each point.

The format (TOML)::

    name = "grid"                 # optional, the results go to out/NAME; default: the file's name
    scenario = "base.toml"        # optional scenario file, below [base]

    [base]                        # any scenario key; paths are relative to this file
    network = "../networks/grid5.net.xml"
    duration_s = 600

    [grid]                        # every combination is a run
    vehicles = [20, 40, 80]
    gate = ["open", "certified"]
    seed = { from = 0, to = 4 }   # whole numbers, both ends included

    [[exclude]]                   # leaves out the points of the grid that agree in all these keys
    gate = "open"
    vehicles = [80]

    [[include]]                   # adds points; keys it does not set run over the grid
    gate = "open"
    vehicles = 160
    duration_s = 60
"""

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from loopgate.errors import SweepError
from loopgate.gates import name_gate
from loopgate.negotiation.registry import name_negotiation
from loopgate.plugins import in_file
from loopgate.reading import as_path, check_keys, is_file, is_plain, of_kind, read_toml, refusing, shown
from loopgate.sweep.files import NamedFile, file_identity

FILE_KEYS = ("network", "routes", "incidents", "traffic", "weights", "districts")
"""Scenario keys whose value may be a file; these files travel with the run."""

_NAMERS: Mapping[str, Callable[[object], str]] = {"gate": name_gate, "negotiation": name_negotiation}
"""Scenario keys whose value may lead into a Python file, which travels too; and what names their things."""

_KEYS = {"name", "scenario", "base", "grid", "include", "exclude"}
_SCENARIO = "the name of a scenario file; keys that all runs share stand below [base]"
_KEY_LENGTH = 16
_LONGEST_NAME = 100
_MOST_RUNS = 100_000


@dataclass(frozen=True, slots=True)
class Point:
    """One run of a sweep: its scenario, and the files that the scenario names."""

    key: str
    """Hash of the scenario and of the content of its files; their location does not count."""
    scenario: Mapping[str, Any]
    """Scenario keys and values as given; files by the path or name as written."""
    hashes: Mapping[str, str]
    """Identity of the content of each file that the scenario names, by key."""
    files: Mapping[str, Path]
    """Path of each file that the scenario names, by key."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """A set of runs: a base scenario, and the axes along which it varies.

    Parameters
    ----------
    base
        Scenario keys and values common to all runs. Gates and negotiations may be classes or functions that
        make them, as in `loopgate.run`, if a Python file holds them.
    grid
        The values of each axis; every combination is a run. Without a grid only the includes are runs;
        without includes too, the base is the only run.
    include, exclude
        Runs to add, and runs of the grid to leave out; a list means any of its values.
    folder
        Folder to which paths are relative; a file that is not there is looked for in the working directory.

    Examples
    --------
    >>> from loopgate import Sweep
    >>> base = {"network": "sumo:DRT", "loops": 20}
    >>> sweep = Sweep("gates", base, {"gate": ["open", "certified"], "vehicles": [20, 40], "seed": [1, 2, 3]})
    >>> len(sweep.points())
    12
    """

    name: str
    base: Mapping[str, Any]
    grid: Mapping[str, Sequence[Any]]
    include: Sequence[Mapping[str, Any]] = ()
    exclude: Sequence[Mapping[str, Any]] = ()
    folder: Path = field(default_factory=Path)

    def __post_init__(self) -> None:
        name = of_kind(str, self.name, "name", SweepError, "the name of a folder")
        object.__setattr__(self, "folder", as_path(self.folder, "folder", SweepError))
        plain = 0 < len(name.encode(errors="replace")) <= _LONGEST_NAME and is_plain(name)
        if not plain or name.startswith(".") or set(name) & set("/\\"):
            msg = f"name is {shown(name)}; expected the name of a folder, up to {_LONGEST_NAME} bytes long"
            raise SweepError(msg)
        object.__setattr__(self, "base", _plain(self.base, "base"))
        axes = _plain(self.grid, "grid")
        grid = {axis: _axis(values, f"grid: {axis}") for axis, values in axes.items()}
        object.__setattr__(self, "grid", grid)
        for part in ("include", "exclude"):
            rules: object = getattr(self, part)
            if not isinstance(rules, list | tuple):
                msg = f"{part} is {shown(rules)}; expected a list of tables"
                raise SweepError(msg)
            object.__setattr__(self, part, [_plain(rule, part) for rule in rules])

    def __repr__(self) -> str:
        axes = " x ".join(f"{len(values)} {name}" for name, values in self.grid.items())
        return f"<Sweep {self.name}: {axes}>"

    def points(self) -> list[Point]:
        """Return all runs of the sweep in order: the grid, then the includes. Equal runs appear once.

        Raises `SweepError` if there are no runs or more than a hundred thousand, a file is missing, a number
        is not finite, or an exclude names an axis that is not in the grid.
        """
        with refusing(self.name, "sweep", SweepError):
            return self._points()

    def _points(self) -> list[Point]:
        for rule in self.exclude:
            unknown = [axis for axis in rule if axis not in self.grid]
            if unknown:
                axes = ", ".join(self.grid) or "no axes"
                msg = f"{self.name}: exclude names {unknown[0]}, which is no axis of the grid; it has {axes}"
                raise SweepError(msg)
        extended = [{**self.grid, **{k: _values(v) for k, v in rule.items()}} for rule in self.include]
        size = sum(math.prod(map(len, axes.values())) for axes in (self.grid, *extended))
        if size > _MOST_RUNS:
            msg = f"{self.name}: it asks for {size} runs, at most {_MOST_RUNS} make a sweep; split it up"
            raise SweepError(msg)
        excluded = [{axis: _values(value) for axis, value in rule.items()} for rule in self.exclude]
        chosen = [
            point
            for point in (_combine(self.grid) if self.grid or not self.include else [])
            if not any(all(point[axis] in values for axis, values in rule.items()) for rule in excluded)
        ]
        for extra in extended:
            chosen += _combine(extra)
        identities: dict[str, NamedFile] = {}
        points = {p.key: p for p in (self._point({**self.base, **values}, identities) for values in chosen)}
        if not points:
            msg = (
                f"{self.name}: the sweep has no runs; every point of the grid is excluded or an axis is empty"
            )
            raise SweepError(msg)
        return list(points.values())

    def _point(self, scenario: Mapping[str, Any], identities: dict[str, NamedFile]) -> Point:
        hashes, files = {}, {}
        identity = dict(scenario)
        for key in FILE_KEYS:
            if not scenario.get(key) or not isinstance(scenario[key], str):
                continue
            value = str(scenario[key])
            if value not in identities:
                identities[value] = file_identity(value, key, self.folder)
            found = identities[value]
            hashes[key] = identity[key] = found.identity
            if found.path is not None:
                files[key] = found.path
        for key in _NAMERS:
            where = in_file(scenario.get(key))
            if where is not None:
                found = identities.setdefault(where.file, file_identity(where.file, key, self.folder))
                identity[key] = f"{found.identity}:{where.rest}"
                files[key] = cast("Path", found.path)
        text = json.dumps(_canonical(identity), sort_keys=True, separators=(",", ":"), allow_nan=False)
        key = hashlib.sha256(text.encode()).hexdigest()[:_KEY_LENGTH]
        return Point(key, scenario, hashes, files)


def with_files(scenario: Mapping[str, Any], places: Mapping[str, str | Path]) -> dict[str, Any]:
    """Return the scenario with its files where they are: `places` has them by key."""
    local = dict(scenario)
    for key, place in places.items():
        where = in_file(scenario[key]) if key in _NAMERS else None
        local[key] = str(place) if where is None else f"{place}:{where.rest}"
    return local


def read_sweep(file: Path | str) -> Sweep:
    """Read the description of a sweep from a TOML file.

    Raises `SweepError` if the file cannot be read, is not TOML, or has an unknown key or an invalid value;
    the message names file and key.

    Examples
    --------
    >>> from loopgate import read_sweep
    >>> sweep = read_sweep("analysis/first_sweep.toml")
    >>> len(sweep.points())
    18
    """
    path = as_path(file, "sweep file", SweepError)
    with refusing(path, "sweep", SweepError):
        return _described(path, read_toml(path, "file", SweepError))


def _described(path: Path, data: Mapping[str, Any]) -> Sweep:
    strange = [key for key in data if key not in _KEYS]
    if strange:
        from loopgate.simulation.scenario import keys  # noqa: PLC0415  only for the way out of an error

        if strange[0] in keys():
            table = "[grid]" if isinstance(data[strange[0]], list) else "[base]"
            msg = f"{path}: {strange[0]} is a key of a scenario; write it below {table}"
            raise SweepError(msg)
    check_keys(data, _KEYS, path, SweepError)
    base = dict(_table(data.get("base", {}), f"{path}: base"))
    if "scenario" in data:
        what = f"{path}: scenario"
        scenario = path.parent / of_kind(str, data["scenario"], what, SweepError, _SCENARIO)
        inherited = read_toml(scenario, "file", SweepError)
        for key in FILE_KEYS:  # relative to the file that names them
            if isinstance(inherited.get(key), str) and is_file(scenario.parent / inherited[key]):
                inherited[key] = str(scenario.parent / inherited[key])
        base = {**inherited, **base}
    grid = _table(data.get("grid", {}), f"{path}: grid")
    parts = {
        "include": _tables(data.get("include", []), f"{path}: include"),
        "exclude": _tables(data.get("exclude", []), f"{path}: exclude"),
    }
    name = of_kind(str, data.get("name", path.stem), f"{path}: name", SweepError)
    try:
        return Sweep(name=name, base=base, grid=grid, folder=path.parent, **parts)
    except SweepError as error:
        msg = f"{path}: {error}"
        raise SweepError(msg) from error


def _plain(values: object, part: str) -> dict[str, Any]:
    """Return scenario keys with times in seconds, paths as text, and names for gates that are classes.

    Raises `SweepError` if they are no table; the text begins with the `part` of the sweep.
    """
    from loopgate.simulation.scenario import keys, plain_value  # noqa: PLC0415  help needs no scenario

    if not isinstance(values, Mapping):
        msg = f"{part} is {shown(values)}; expected a table of scenario keys"
        raise SweepError(msg)
    fields, plain = keys(), dict(values)

    for key, value in plain.items():
        field = fields.get(key, "")
        plain[key] = (
            [plain_value(field, one) for one in value]
            if isinstance(value, list | tuple)
            else plain_value(field, value)
        )
    for key, namer in _NAMERS.items():
        value = plain.get(key)
        if isinstance(value, list | tuple):
            plain[key] = [one if isinstance(one, str) else _checked(namer(one)) for one in value]
        elif value is not None and not isinstance(value, str):
            plain[key] = _checked(namer(value))
    return plain


def _checked(name: str) -> str:
    if in_file(name) is None and name.startswith("here."):
        msg = (
            f"{name.removeprefix('here.')}: it stands in no Python file, so other processes cannot have it; "
            "write it to one, and give its class or file.py:NAME"
        )
        raise SweepError(msg)
    return name


def _axis(values: object, what: str) -> list[Any]:
    if isinstance(values, dict):
        ends = [values.get(end) for end in ("from", "to")]
        if set(values) != {"from", "to"} or not all(type(end) is int for end in ends):
            msg = (
                f"{what} is {shown(values)}; a range is {{ from = 0, to = 4 }}, whole numbers, both included"
            )
            raise SweepError(msg)
        if values["to"] - values["from"] >= _MOST_RUNS:
            msg = f"{what} is {shown(values)}; a range has at most {_MOST_RUNS} numbers"
            raise SweepError(msg)
        return list(range(values["from"], values["to"] + 1))
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        msg = f"{what} is {shown(values)}; expected a list of values, or a range {{ from = 0, to = 4 }}"
        raise SweepError(msg)
    plain = getattr(values, "tolist", None)  # of arrays and columns: numbers of Python
    return list(plain() if callable(plain) else values)


def _table(value: object, what: str) -> Mapping[str, Any]:
    return of_kind(dict, value, what, SweepError, "a table of scenario keys")


def _tables(value: object, what: str) -> list[Mapping[str, Any]]:
    if not isinstance(value, list):
        msg = f"{what} is {shown(value)}; write it as [[{what.rsplit(' ', 1)[-1]}]]"
        raise SweepError(msg)
    return [_table(entry, what) for entry in value]


def _combine(axes: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _values(value: object) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _canonical(value: object) -> object:
    """Return the value with 10.0 written as 10, so that both spellings are one run."""
    if isinstance(value, Mapping):
        return {str(key): _canonical(entry) for key, entry in value.items()}
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [_canonical(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        msg = f"{value} stands where a finite number is expected"
        raise SweepError(msg)
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value if isinstance(value, bool | int | float | str | None) else str(value)
