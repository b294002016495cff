"""SUMO's XML files, plain or gzipped, with errors that a user can act on."""

import gzip
import os
import zlib
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import IO, cast
from xml.etree import ElementTree as ET

from loopgate.disk import writing
from loopgate.errors import LoopgateError
from loopgate.reading import is_file, refusing, shown

_WAYS_OUT = {
    "osm": "make a network of OpenStreetMap's data first: netconvert --osm-files FILE -o NAME.net.xml",
    "routes": "this one holds routes: give the network as NETWORK and this file as --routes",
    "net": "this one is a network: it goes first, as NETWORK; 'loopgate loops NETWORK -o FILE' makes routes",
    "fcd-export": "this one is FCD output: 'loopgate read-fcd FCD NETWORK -o FOLDER' reads it",
    "additional": "this one holds additional elements, such as stops: name it in a .sumocfg",
    "configuration": "this one is a configuration: its name should end in .sumocfg or .sumo.cfg",
}
"""Advice on files that are often taken for others, by their root element."""

_ALSO = {"configuration": {"sumoConfiguration"}, "routes": {"trips", "additional"}}
"""The names that SUMO writes today, and those that it reads as well, by the first."""

_NOT_ADDITIONAL = frozenset({"osm", "net", "configuration", "sumoConfiguration"})
"""Root elements that no additional file has; SUMO takes any other."""

_DEEPEST = 50
"""Elements within elements; SUMO's own files have six."""

_GZIP_MAGIC = b"\x1f\x8b"


def read_xml(file: Path, *, root: str, what: str, error: type[LoopgateError]) -> ET.Element:
    """Parse a file and its included files, and return the root element.

    Raises `error` if it cannot be read, or includes itself.

    Parameters
    ----------
    file
        Plain or gzipped XML; told apart by content, not by name.
    root
        The root element it must have.
    what
        The kind of file that it should be, for messages: "route file".
    """
    check_root(file, root=root, what=what, error=error)
    top = _parse(file, what, error)
    top.tag = top.tag if root == "additional" else root
    _include(top, (file.resolve(),), what, error)
    return top


def included(file: Path) -> list[Path]:
    """Return the files that a file includes, directly or not; errors are left to `read_xml`."""
    found: dict[Path, None] = {file.resolve(): None}
    ahead = [file.resolve()]
    while ahead:
        one = ahead.pop()
        with suppress(OSError, EOFError, zlib.error, ET.ParseError, LookupError):
            with open_xml(one) as stream:
                content = stream.read()
            if b"<include" not in content:
                continue
            names = (each.get("href", "") for each in ET.fromstring(content).findall("include"))  # noqa: S314
            more = [(one.parent / name).resolve() for name in names]
            ahead += [each for each in more if is_file(each) and each not in found]
            found |= dict.fromkeys(ahead)
    return list(found)[1:]


def check_included(file: Path, error: type[LoopgateError]) -> list[Path]:
    """Return a file and its included files, which SUMO reads by itself.

    Raises `error` if one of them includes a file without a name, or itself: SUMO ends by a signal on these.
    """
    return _check_included(file, (), error)


def _check_included(file: Path, within: tuple[Path, ...], error: type[LoopgateError]) -> list[Path]:
    found, within = [file], (*within, file.resolve())
    with (
        suppress(OSError, EOFError, zlib.error, ET.ParseError, LookupError, ValueError),
        open_xml(file) as stream,
    ):
        for _, element in ET.iterparse(stream):  # noqa: S314  expat refuses entities without bounds
            if element.tag == "include":
                found += _check_one(file, element.get("href", ""), within, error)
            element.clear()
    return found


def _check_one(file: Path, name: str, within: tuple[Path, ...], error: type[LoopgateError]) -> list[Path]:
    other = file.parent / name
    if not name or other.resolve() in within:
        msg = f"{file}: {_why_not(name, within, other.resolve())}; correct href"
        raise error(msg)
    return _check_included(other, within, error) if is_file(other) else []


def _why_not(name: str, within: tuple[Path, ...], file: Path) -> str:
    why = "and that includes it again" if file in within else "and there is no such file"
    return f"it includes {shown(name)}, {why}" if name else "it has an <include> without href"


def _parse(file: Path, what: str, error: type[LoopgateError]) -> ET.Element:
    with _refusing(file, what, error), open_xml(file) as stream:
        top = ET.parse(stream).getroot()  # noqa: S314  expat refuses entities that grow without bounds
        _check_depth(top)
    if top.tag.startswith("{"):  # SUMO reads names without their namespace
        for one in top.iter():
            one.tag = _bare(one.tag)
    return top


def _bare(tag: str) -> str:
    return tag.rpartition("}")[2]


def _check_depth(top: ET.Element) -> None:
    """Raise `ValueError` if elements are nested deeper than in any file of SUMO's; O(elements)."""
    level, depth = [top], 1
    while level:
        if depth > _DEEPEST:
            msg = f"<{shown(level[0].tag)[1:-1]}>: elements are nested more than {_DEEPEST} deep"
            raise ValueError(msg)
        level, depth = [inner for one in level for inner in one], depth + 1


def _include(top: ET.Element, within: tuple[Path, ...], what: str, error: type[LoopgateError]) -> None:
    """Replace each ``<include>`` element by the content of its file."""
    for at in reversed([number for number, one in enumerate(top) if one.tag == "include"]):
        file = (within[-1].parent / top[at].get("href", "")).resolve()
        if file in within or not is_file(file):
            msg = f"{within[-1]}: {_why_not(top[at].get('href', ''), within, file)}; correct href"
            raise error(msg)
        inner = _parse(file, what, error)
        _include(inner, (*within, file), what, error)
        top[at : at + 1] = list(inner)


def check_root(file: Path, *, root: str, what: str, error: type[LoopgateError]) -> None:
    """Raise `error` unless a file begins as an XML file with a given root element."""
    with _refusing(file, what, error):
        if not file.exists():
            msg = f"{file}: there is no such file; expected a SUMO {what}{_as_here(file)}"
            raise error(msg)
        if file.is_dir():
            msg = f"{file}: a folder, not a SUMO {what}"
            raise error(msg)
        if file.stat().st_size == 0:
            msg = f"{file}: the file is empty; expected a SUMO {what} (XML, <{root}>)"
            raise error(msg)
        with open_xml(file) as stream:
            tag = _bare(next(iter(ET.iterparse(stream, events=("start",))))[1].tag)  # noqa: S314  as above
        if not _is_root(tag, root):
            is_config = tag in _ALSO["configuration"]
            way_out = _WAYS_OUT.get("configuration" if is_config else tag)
            hint = f"; {way_out}" if way_out else ""
            msg = f"{file}: the root element is <{shown(tag)[1:-1]}>; a SUMO {what} has <{root}>{hint}"
            raise error(msg)


def _as_here(file: Path) -> str:
    r"""Return what to write for a path of Windows, whose folders end with ``\\``; empty for other paths."""
    other = str(file).replace("\\", "/")
    return "" if os.sep == "\\" or other == str(file) else f"; here folders end with /: write {other}"


def _is_root(tag: str, root: str) -> bool:
    return tag not in _NOT_ADDITIONAL if root == "additional" else tag in {root, *_ALSO.get(root, ())}


def _refusing(file: Path, what: str, error: type[LoopgateError]) -> AbstractContextManager[None]:
    return refusing(file, what, error, wrong=f"not XML that can be read; expected a SUMO {what}")


def write_xml(top: ET.Element, file: Path) -> None:
    """Write an XML file; raise `ResultsError` if the disk is full or refuses it."""
    with writing(file):
        ET.ElementTree(top).write(file, encoding="utf-8", xml_declaration=True)


def open_xml(file: Path) -> IO[bytes]:
    """Open a plain or gzipped file; the content decides which."""
    with file.open("rb") as stream:
        zipped = stream.read(2) == _GZIP_MAGIC
    return cast("IO[bytes]", gzip.open(file)) if zipped else file.open("rb")
