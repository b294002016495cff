"""The versions that made a result: of loopgate and of other distributions."""

from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

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


PLAIN_COSTS = "the gate takes about twice the time of a compiled one, with the same results"


def ledger_words() -> str:
    """Return a phrase for the ledger: its kind; for a plain one also why it is plain, and what that costs."""
    kind = ledger_kind()
    if kind != "plain":
        return f"{kind} ledger"
    file = Path(__file__).with_name("why_plain.txt")
    why = file.read_text(encoding="utf-8").strip() if file.exists() else "as in its source folder"
    return f"plain ledger ({why}): {PLAIN_COSTS}"
