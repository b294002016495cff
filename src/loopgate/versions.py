"""The versions that made a result: of loopgate and of other distributions."""

from importlib.metadata import version

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
