"""The versions that made a result: of loopgate and of other distributions."""

from importlib.metadata import version
from importlib.util import find_spec

DISTRIBUTION = "sumo-loopgate"
"""The package's name for pip."""


def versions(*others: str) -> dict[str, str]:
    """Return the version of ``loopgate`` and of other distributions by name.

    Examples
    --------
    >>> from loopgate.versions import versions
    >>> list(versions("numpy"))
    ['loopgate', 'numpy']
    """
    return {"loopgate": version(DISTRIBUTION)} | {name: version(name) for name in others}


def ledger_kind() -> str:
    """Return whether the ledger (`loopgate.control`) is ``compiled`` or ``plain`` Python."""
    found = find_spec("loopgate.control.ledger")
    return "plain" if found is None or (found.origin or "").endswith(".py") else "compiled"
