"""``--json``: only JSON on stdout; prints of SUMO, of a gate or a library go elsewhere."""

import ctypes
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from typing import IO, Any

import click

_STDOUT, _STDERR = 1, 2

_to: list[IO[str]] = []
"""Where JSON goes while all else that is printed goes to stderr."""


def print_json(
    data: Any,  # noqa: ANN401  any JSON value
    *,
    indent: int | None = None,
    default: Callable[[Any], Any] | None = None,
) -> None:
    """Print data as JSON; takes the options of `json.dumps`."""
    click.echo(json.dumps(data, indent=indent, default=default), file=_to[-1] if _to else None)


@contextmanager
def only_json(*, wanted: bool) -> Iterator[None]:
    """Send all output but that of `print_json` to stderr, if `wanted`.

    SUMO prints by the file descriptor, in this process and in others, whatever Python's stream is.
    """
    if not wanted:
        yield
        return
    with ExitStack() as stack:
        _to.append(stack.enter_context(_apart()))
        stack.callback(_to.pop)
        stack.enter_context(redirect_stdout(sys.stderr))
        yield


@contextmanager
def _apart() -> Iterator[IO[str]]:
    """Yield a stream to where stdout leads, and let its file descriptor lead to stderr meanwhile."""
    sys.stdout.flush()
    kept = os.dup(_STDOUT)
    os.dup2(_STDERR, _STDOUT)
    try:
        with open(kept, "w", encoding="utf-8", closefd=False) as stream:
            yield stream
    finally:
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).fflush(None)  # what SUMO has printed so far waits in the C library
        os.dup2(kept, _STDOUT)
        os.close(kept)
