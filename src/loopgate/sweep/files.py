"""Networks and routes: their hashes, and their way to another machine."""

import os
import zlib
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from loopgate.errors import SweepError
from loopgate.network.road import PACKAGED, content_identity, members
from loopgate.reading import is_file, refusing, shown


@dataclass(frozen=True, slots=True)
class NamedFile:
    """A value of a scenario that may be a file."""

    identity: str
    """SHA-256 of the file's content; for a name in a package, the name and the package's version."""
    path: Path | None
    """The file, or None for a name that every machine resolves for itself."""


@dataclass(frozen=True, slots=True)
class PackedFile:
    """A file as it travels with a run; a ``.sumocfg`` travels with the files that it names."""

    identity: str
    main: str
    """The file itself, among the members."""
    members: tuple[tuple[str, bytes], ...]
    """Relative path and content, compressed by zlib: road networks are XML and shrink to about a tenth."""


def file_identity(value: str, key: str, folder: Path) -> NamedFile:
    """Return the file that `value` of the scenario key `key` names.

    Raises `SweepError` if it looks like a file and is none, or cannot be read.
    """
    if value.startswith(PACKAGED):
        return NamedFile(f"{value}@{metadata.version('eclipse-sumo')}", None)
    for path in (folder / value, Path(value)):
        if is_file(path):
            with refusing(path, key, SweepError):
                return NamedFile(content_identity(path), path.resolve())
    msg = (
        f"{key} {shown(value)[1:-1]}: there is no such file in {folder.resolve()} or in the working directory"
    )
    raise SweepError(msg)


def pack(path: Path) -> PackedFile:
    """Read a file for the journey.

    Raises `OSError` if a file cannot be read.
    """
    files = members(path)
    root = Path(os.path.commonpath([file.parent for file in files]))
    packed = tuple((file.relative_to(root).as_posix(), zlib.compress(file.read_bytes(), 6)) for file in files)
    return PackedFile(content_identity(path), packed[0][0], packed)


def unpack(packed: PackedFile, folder: Path) -> Path:
    """Write a file that has travelled into `folder`, under its own name, and return where it is."""
    root = folder / packed.identity[:16]
    for name, content in packed.members:
        target = root / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(zlib.decompress(content))
    return root / packed.main
