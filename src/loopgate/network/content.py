"""The identity of a file by its content alone."""

import hashlib
from pathlib import Path

from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.xml_file import included


def content_identity(path: Path) -> str:
    """Return the SHA-256 of a file and of the files that it names.

    Raises `OSError` if a file cannot be read.
    """
    digests = [hashlib.sha256(member.read_bytes()).hexdigest() for member in members(path)]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def members(path: Path) -> list[Path]:
    """Return the file and the files that it needs: named by a ``.sumocfg``, or included."""
    path = path.resolve()
    if not is_sumo_config(path):
        return [path] if ".net.xml" in path.name else [path, *included(path)]  # networks are large
    config = read_sumo_config(path)
    beside = [one.resolve() for one in (*config.route_files, *config.additional_files)]
    return [path, config.net_file.resolve(), *(one for file in beside for one in (file, *included(file)))]
