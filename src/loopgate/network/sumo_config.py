"""SUMO configurations: which network and which route files they name."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from loopgate.errors import RouteError
from loopgate.network.xml_file import read_xml

__all__ = ["SumoConfig", "is_sumo_config", "read_sumo_config"]


@dataclass(frozen=True, slots=True)
class SumoConfig:
    """The files that a ``.sumocfg`` names, as paths that can be opened.

    Attributes
    ----------
    file
        The configuration itself.
    net_file
        The network.
    route_files, additional_files
        Possibly none.
    """

    file: Path
    net_file: Path
    route_files: tuple[Path, ...]
    additional_files: tuple[Path, ...]


def is_sumo_config(name: str | Path) -> bool:
    """Return whether the name says that it is a SUMO configuration."""
    return Path(name).name.endswith((".sumocfg", ".sumocfg.xml"))


def read_sumo_config(file: Path | str) -> SumoConfig:
    """Read a SUMO configuration; the files it names are relative to its folder.

    Raises
    ------
    RouteError
        If it cannot be read or names no network.
    """
    path = Path(file)
    top = read_xml(path, root="configuration", what="configuration", error=RouteError)
    # SUMO accepts an option at any depth, under its long name or its short one.
    value = {element.tag: element.get("value", element.get("v", "")) for element in top.iter()}

    def files(*options: str) -> tuple[Path, ...]:
        names = next((value[option] for option in options if value.get(option)), "")
        return tuple(path.parent / name.strip() for name in names.split(",") if name.strip())

    nets = files("net-file", "net", "n")
    if not nets:
        msg = f'{path}: the configuration names no network; expected <net-file value="..."/>'
        raise RouteError(msg)
    return SumoConfig(
        file=path,
        net_file=nets[0],
        route_files=files("route-files", "routes", "r"),
        additional_files=files("additional-files", "additional", "a"),
    )
