"""The road networks that ship in the SUMO package."""

import importlib.util
from pathlib import Path

from loopgate.errors import NetworkError
from loopgate.reading import meant

PACKAGED = "sumo:"
"""Prefix of the names of networks that ship in the SUMO package."""


def packaged_networks() -> dict[str, Path]:
    """Return names and files of the networks in the SUMO package (its folder ``tools/game``).

    Examples
    --------
    >>> from loopgate.network import packaged_networks
    >>> packaged_networks()["DRT"].name
    'osm.net.xml'
    """
    spec = importlib.util.find_spec("sumo")
    if spec is None or not spec.submodule_search_locations:
        return {}
    found: dict[str, Path] = {}
    for home in spec.submodule_search_locations:
        for file in sorted(Path(home, "tools", "game").glob("*/*.net.xml*")):
            found.setdefault(file.parent.name, file)
    return found


def packaged_network(name: str) -> Path:
    """Return the file of a network in the SUMO package, ``sumo:NAME``.

    Raises `NetworkError` if there is none of that name.
    """
    known = packaged_networks()
    try:
        return known[name.removeprefix(PACKAGED)]
    except KeyError:
        names = [PACKAGED + one for one in known]
        has = f"; there are {', '.join(names)}" if known else "; pip install eclipse-sumo"
        msg = f"{name}: no such network in the SUMO package{has}{meant(name, names)}"
        raise NetworkError(msg) from None
