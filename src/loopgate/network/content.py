"""The identity of a file by its content, whatever its name and place."""

from __future__ import annotations

import hashlib
from pathlib import Path

from loopgate.network.sumo_config import is_sumo_config, read_sumo_config


def content_identity(path: Path) -> str:
    """Return the SHA-256 of a file's content, and of the contents of what it names.

    Raises `OSError` if a file cannot be read.
    """
    digests = [hashlib.sha256(member.read_bytes()).hexdigest() for member in members(path)]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def members(path: Path) -> list[Path]:
    """Return the file and those without which it means nothing: what a ``.sumocfg`` names."""
    path = path.resolve()
    if not is_sumo_config(path):
        return [path]
    config = read_sumo_config(path)
    return [path, *(p.resolve() for p in (config.net_file, *config.route_files, *config.additional_files))]
