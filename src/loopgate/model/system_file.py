"""Systems as JSON files.

The format::

    {"robots": [{"id": "r1", "path": ["s1", "s2"], "closed": true, "start": 0}, ...],
     "capacity": {"s3": 2}, "fifo": ["s3"], "note": "free text"}

``closed`` (default true), ``start`` (default 0), ``capacity``, ``fifo`` and ``note`` are optional.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loopgate.errors import SystemFileError, SystemModelError
from loopgate.model.system import Robot, RobotId, StateId, System
from loopgate.reading import check_keys, is_plain, of_kind, read_json, refusing, shown

_SYSTEM_KEYS = {"robots", "capacity", "fifo", "note"}
_ROBOT_KEYS = {"id", "path", "closed", "start"}


def read_system(file: Path | str) -> System:
    """Read a system of robots and states from a JSON file.

    Raises `SystemFileError` if the file cannot be read, is no JSON, or describes no valid system; the text
    names the file and the robot or state concerned.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate import read_system
    >>> text = '{"robots": [{"id": "a", "path": ["s1", "s2"]}, {"id": "b", "path": ["s2", "s3"]}]}'
    >>> Path("two.json").write_text(text) > 0
    True
    >>> read_system("two.json").states
    ('s1', 's2', 's3')
    """
    data = read_json(file, "system file", SystemFileError)
    with refusing(file, "system file", SystemFileError):
        return system_from_dict(data)


def write_system(system: System, file: Path | str, *, note: str = "") -> None:
    """Write a system as a JSON file, which `read_system` can read; make its folder if needed.

    Raises `SystemFileError` if the file cannot be written.

    Examples
    --------
    >>> from loopgate import Robot, System, read_system
    >>> from loopgate.model import write_system
    >>> system = System([Robot("a", ("s1", "s2")), Robot("b", ("s2", "s3"))])
    >>> write_system(system, "systems/two.json", note="made by hand")
    >>> read_system("systems/two.json").robots == system.robots
    True
    """
    data = system_to_dict(system)
    if note:
        data = {"note": note, **data}
    path = Path(file)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        msg = f"{file}: cannot write the system file ({error.strerror or error})"
        raise SystemFileError(msg) from error


def system_to_dict(system: System) -> dict[str, Any]:
    """Return a system as the JSON object of a system file.

    Examples
    --------
    >>> from loopgate import Robot, System
    >>> from loopgate.model import system_to_dict
    >>> system_to_dict(System([Robot("a", ("s1", "s2"))], {"s2": 2}))
    {'robots': [{'id': 'a', 'path': ['s1', 's2'], 'closed': True, 'start': 0}], 'capacity': {'s2': 2}}
    """
    data: dict[str, Any] = {
        "robots": [
            {"id": robot.id, "path": list(robot.path), "closed": robot.closed, "start": robot.start}
            for robot in system.robots
        ]
    }
    if system.capacity:
        data["capacity"] = dict(system.capacity)
    if system.fifo:
        data["fifo"] = sorted(system.fifo)
    return data


def system_from_dict(data: object) -> System:
    """Make a system from the JSON object of a system file.

    Raises `SystemModelError` if keys are unknown or missing, values have the wrong type, or the model refuses
    the system.

    Examples
    --------
    >>> from loopgate.model import system_from_dict
    >>> robots = [{"id": "a", "path": ["s1", "s2"]}, {"id": "b", "path": ["s2", "s3"]}]
    >>> system_from_dict({"robots": robots, "capacity": {"s2": 2}}).room
    (1, 2, 1)
    """
    top = _keys(data, "the system", allowed=_SYSTEM_KEYS, needed={"robots"})
    robots = [_robot(entry, number) for number, entry in enumerate(_list(top["robots"], "robots"))]
    capacity = {
        StateId(state): of_kind(int, room, f"state {state}: its capacity", SystemModelError)
        for state, room in of_kind(dict, top.get("capacity", {}), "capacity", SystemModelError).items()
    }
    fifo = [StateId(_text(s, "fifo: an entry")) for s in _list(top.get("fifo", []), "fifo")]
    return System(robots, capacity, fifo)


def _robot(entry: object, number: int) -> Robot:
    what = f"robot number {number + 1}"
    if isinstance(entry, dict) and isinstance(entry.get("id"), str):
        what = f"robot {entry['id']}"
    fields = _keys(entry, what, allowed=_ROBOT_KEYS, needed={"id", "path"})
    return Robot(
        id=RobotId(_text(fields["id"], f"{what}: its id")),
        path=tuple(StateId(_text(s, f"{what}: a state")) for s in _list(fields["path"], f"{what}: its path")),
        closed=of_kind(bool, fields.get("closed", True), f"{what}: closed", SystemModelError),
        start=of_kind(int, fields.get("start", 0), f"{what}: its start", SystemModelError),
    )


def _keys(data: object, what: str, *, allowed: set[str], needed: set[str]) -> Mapping[str, Any]:
    fields: dict[str, Any] = of_kind(dict, data, what, SystemModelError)
    check_keys(fields, allowed, what, SystemModelError)
    for key in sorted(needed - fields.keys()):
        msg = f"{what}: the key {key!r} is missing"
        raise SystemModelError(msg)
    return fields


def _list(data: object, what: str) -> list[Any]:
    return of_kind(list, data, what, SystemModelError)


def _text(data: object, what: str) -> str:
    if not isinstance(data, str) or not data or not is_plain(data):
        msg = f"{what} is {shown(data)}; expected a non-empty string without control characters"
        raise SystemModelError(msg)
    return data
