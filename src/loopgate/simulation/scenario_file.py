"""Reads scenarios from TOML files."""

from __future__ import annotations

from pathlib import Path

from loopgate.errors import ScenarioError
from loopgate.plugins import in_file
from loopgate.reading import as_path, is_file, read_toml
from loopgate.simulation.scenario import Scenario


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
