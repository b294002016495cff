"""SUMO configurations: their network, route files and options."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from loopgate.errors import RouteError
from loopgate.network.xml_file import read_xml

_NETS = ("net-file", "net", "n")
_ROUTES = ("route-files", "routes", "r")
_ADDITIONAL = ("additional-files", "additional", "a")
_LONG = {
    "H": "human-readable-time",
    "b": "begin",
    "e": "end",
    "l": "log",
    "v": "verbose",
    "W": "no-warnings",
    "S": "start",
    "Q": "quit-on-end",
}
"""Long names of options that are looked at."""

_ON = frozenset({"1", "yes", "true", "on", "x", "t"})
"""What SUMO reads as true."""


@dataclass(frozen=True, slots=True)
class SumoConfig:
    """The files that a ``.sumocfg`` names, with paths that can be opened."""

    file: Path
    net_file: Path
    route_files: tuple[Path, ...]
    additional_files: tuple[Path, ...]
    """`route_files` and `additional_files`: possibly none."""
    options: Mapping[str, str] = field(default_factory=dict, hash=False)
    """All other options of the configuration, by name, unchanged."""

    def is_true(self, option: str) -> bool:
        """Return whether the configuration sets an option that is either true or false to true."""
        return self.options.get(option, "").lower() in _ON


def is_sumo_config(name: str | Path) -> bool:
    """Return whether a file name is that of a SUMO configuration.

    >>> [is_sumo_config(name) for name in ("a.sumocfg", "a.sumo.cfg", "a.net.xml")]
    [True, True, False]
    """
    return Path(name).name.endswith((".sumocfg", ".sumo.cfg", ".sumocfg.xml", ".sumo.cfg.xml"))


def read_sumo_config(file: Path | str) -> SumoConfig:
    """Read a SUMO configuration (``.sumocfg``); file names in it are relative to its folder.

    Raises `RouteError` if the file cannot be read or names no network.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate.network import read_sumo_config
    >>> text = '<configuration><net-file value="town.net.xml"/><end value="3600"/></configuration>'
    >>> Path("town.sumocfg").write_text(text) > 0
    True
    >>> config = read_sumo_config("town.sumocfg")
    >>> config.net_file.name, config.options["end"]
    ('town.net.xml', '3600')
    """
    path = Path(file)
    top = read_xml(path, root="configuration", what="configuration", error=RouteError)
    # SUMO accepts an option at any depth, under its long name or its short one.
    value = {
        element.tag: element.get("value", element.get("v", ""))
        for element in top.iter()
        if "value" in element.attrib or "v" in element.attrib
    }

    def files(*options: str) -> tuple[Path, ...]:
        names = next((value[option] for option in options if value.get(option)), "")
        return tuple(path.parent / name.strip() for name in names.split(",") if name.strip())

    nets = files(*_NETS)
    if not nets:
        msg = f'{path}: the configuration names no network; expected <net-file value="..."/>'
        raise RouteError(msg)
    return SumoConfig(
        file=path,
        net_file=nets[0],
        route_files=files(*_ROUTES),
        additional_files=files(*_ADDITIONAL),
        options={
            _LONG.get(name, name): text
            for name, text in value.items()
            if name not in _NETS + _ROUTES + _ADDITIONAL
        },
    )
