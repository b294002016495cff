"""Calls of a user's code: an exception becomes one line that names the code and the line number."""

import inspect
import os
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from loopgate.errors import LoopgateError, PluginError
from loopgate.reading import shown

_PACKAGE = f"{Path(__file__).parent}{os.sep}"
_LIBRARIES = tuple({sysconfig.get_path(name) + os.sep for name in ("stdlib", "purelib", "platlib")})
_LONGEST_REASON = 200
_OURS = "loopgate."


def is_ours(thing: object) -> bool:
    """Return whether a class, a function or an object belongs to this package."""
    home = thing if hasattr(thing, "__qualname__") else type(thing)
    return str(getattr(home, "__module__", "")).startswith(_OURS)


def name_of_class(thing: object) -> str:
    """Return the name of an object's class, with the file that defines the class if there is one."""
    kind = type(thing)
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    if not file:
        return kind.__qualname__
    here = Path.cwd()
    place = Path(file).relative_to(here) if Path(file).is_relative_to(here) else file
    return f"{place}:{kind.__qualname__}"


@contextmanager
def blaming(who: str, expected: str, error: type[LoopgateError] = PluginError) -> Iterator[None]:
    """Turn each exception in the ``with`` block, except Ctrl-C, into `error`.

    Parameters
    ----------
    who
        The begin of the line: who was asked for what, as in ``gate mine.py:Mine: decide``.
    expected
        The end of the line: what is expected instead.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise
    except BaseException as problem:
        msg = f"{who} raised {reason_of(problem)}{_place(problem)}; expected {expected}"
        raise error(msg) from problem


def reason_of(problem: BaseException) -> str:
    """Return an exception's type and message, in at most one line."""
    try:
        words = " ".join(str(problem).split())[:_LONGEST_REASON]
    except Exception:  # noqa: BLE001  the words of a user's own error may fail as well
        words = "its own text fails"
    return f"{type(problem).__name__}: {words}".rstrip(": ")


def _place(problem: BaseException) -> str:
    """Return the line of a user's file that raised the error or led to it; empty if there is none."""
    frames = [(f.f_code.co_filename, number) for f, number in traceback.walk_tb(problem.__traceback__)]
    theirs = [frame for frame in frames if not frame[0].startswith(_PACKAGE)]
    own = [frame for frame in theirs if not frame[0].startswith((*_LIBRARIES, "<"))] or theirs
    return f" ({Path(own[-1][0]).name}, line {own[-1][1]})" if own else ""


def takes(function: Callable[..., object], *given: str) -> str:
    """Return why a function cannot take this number of arguments; empty if it can."""
    try:
        signature = inspect.signature(function)
    except ValueError:  # some that are not written in Python do not say
        return ""
    except TypeError:
        return f"is {shown(function)}"
    try:
        signature.bind(*given)
    except TypeError:
        return f"takes {signature}"
    return ""
