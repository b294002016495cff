"""Reading users' files: each error becomes one line that names the file.

Parsers raise what they happen to stumble on: besides errors of their own also those for unknown encodings,
for numbers of five thousand digits, for lists nested too deep, for keys that are missing. A list of all that
is never complete, so everything that goes wrong while a file is read is taken for a fault of the file.
"""

import codecs
import difflib
import json
import os
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from loopgate.errors import UNPRINTABLE, LoopgateError

_LONGEST_VALUE = 80
_LONGEST_REASON = 200
_KINDS: dict[type, str] = {
    dict: "a JSON object",
    list: "a JSON list",
    str: "a text",
    int: "a whole number",
    bool: "true or false",
}

T = TypeVar("T")


@contextmanager
def refusing(file: Path | str, what: str, error: type[LoopgateError], *, wrong: str = "") -> Iterator[None]:
    """Turn each exception in the ``with`` block into `error`, a line that begins with the file.

    Errors of the package that are such an `error` already pass through.

    Parameters
    ----------
    what
        The kind of file that it should be, for messages: "system file".
    wrong
        The words for what it is instead, if it can be opened; "no readable WHAT" by default.
    """
    try:
        yield
    except error:
        raise
    except LoopgateError as problem:
        msg = f"{file}: {problem}"
        raise error(msg) from problem
    except Exception as problem:
        if isinstance(problem, OSError) and problem.strerror:  # parsers raise bare ones for what they read
            other = str(problem.filename or file)  # a configuration names files, which may be the ones
            where = file if Path(file).name.startswith(Path(other).name) else f"{file}: {other}"
            msg = f"{where}: cannot read the {what} ({problem.strerror})"
            raise error(msg) from problem
        msg = f"{file}: {wrong or f'no readable {what}'} ({_reason(problem)})"
        raise error(msg) from problem


def read_json(file: Path | str, what: str, error: type[LoopgateError]) -> Any:  # noqa: ANN401  any JSON value
    """Return the content of a JSON file; raise `error` if it cannot be read or is no JSON."""
    with refusing(file, what, error, wrong="not a JSON file"):
        return json.loads(_text(file, what, error, 256_000_000))


def read_object(file: Path | str, what: str, error: type[LoopgateError]) -> dict[str, Any]:
    """Return the JSON object that a file holds; raise `error` if it holds something else."""
    data = read_json(file, what, error)
    if not isinstance(data, dict):
        msg = f"{file}: no {what}: it holds {shown(data)}; expected a JSON object"
        raise error(msg)
    return data


def read_toml(file: Path | str, what: str, error: type[LoopgateError]) -> dict[str, Any]:
    """Return the content of a TOML file; raise `error` if it cannot be read or is no TOML."""
    with refusing(file, what, error, wrong="not a TOML file"):
        return tomllib.loads(_text(file, what, error, 4_000_000))


def _text(file: Path | str, what: str, error: type[LoopgateError], largest_bytes: int) -> str:
    """Return the text of a file that is not too large for its parser: it needs many times the memory."""
    with Path(file).open("rb") as stream:
        content = stream.read(largest_bytes + 1)
    if len(content) > largest_bytes:
        msg = f"{file}: larger than {largest_bytes / 1e6:g} MB, which no {what} should be"
        raise error(msg)
    return decoded(content).replace("\r\n", "\n")


def decoded(content: bytes) -> str:
    r"""Return the text of a file: UTF-8, or the encoding of its byte order mark.

    Raises `UnicodeDecodeError` if it is neither.

    >>> [decoded(text) for text in (b"a", b"\xef\xbb\xbfa", b"\xff\xfea\x00", b"\xfe\xff\x00a")]
    ['a', 'a', 'a', 'a']
    """
    marked = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return content.decode("utf-16" if marked else "utf-8-sig")


def read_words(file: Path | str) -> str:
    """Return the text of a file; raise `OSError` or `UnicodeDecodeError` if it has none."""
    return decoded(Path(file).read_bytes()).replace("\r\n", "\n")


def of_kind(kind: type[T], value: object, what: str, error: type[Exception], expected: str = "") -> T:
    """Return a value of the expected kind (a boolean is no number), or raise `error`."""
    if isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    msg = f"{what} is {shown(value)}; expected {expected or _KINDS[kind]}"
    raise error(msg)


def at_least(least: float, value: object, what: str, error: type[LoopgateError], expected: str) -> float:
    """Return a number that is no less than `least`; raise `error` for anything else."""
    if isinstance(value, int | float) and value >= least:
        return float(value)
    msg = f"{what} is {shown(value)}; expected {expected}"
    raise error(msg)


def as_path(value: object, what: str, error: type[LoopgateError]) -> Path:
    """Return a text or path as a path; raise `error` for anything else."""
    if isinstance(value, (str, os.PathLike)):
        return Path(value)
    msg = f"{what} is {shown(value)}; expected a path, as a text or a Path"
    raise error(msg)


def meant(word: object, known: Iterable[str]) -> str:
    """Return a "did you mean" question with the nearest known word, in whatever case; empty if none is near.

    >>> meant("vehicels", ["vehicles", "loops"]), meant("x", ["vehicles"])
    ("; did you mean 'vehicles'?", '')
    """
    by_letters = {one.casefold(): one for one in known}
    near = difflib.get_close_matches(str(word)[:_LONGEST_VALUE].casefold(), list(by_letters), n=1)
    return f"; did you mean '{by_letters[near[0]]}'?" if near else ""


def check_keys(given: Iterable[str], known: Iterable[str], what: object, error: type[Exception]) -> None:
    """Raise an error that names the first unknown key."""
    for key in given:
        if key not in known:
            names = sorted(known)
            msg = f"{what}: unknown key {shown(key)}; known are {', '.join(names)}{meant(key, names)}"
            raise error(msg)


def is_file(path: Path | str) -> bool:
    """Return whether the file exists; False for a text that cannot be a file name."""
    return os.path.isfile(path)  # noqa: PTH113  pathlib's raises on names that are too long


def is_folder(path: Path | str) -> bool:
    """Return whether the folder exists; False for a text that cannot be a folder name."""
    return os.path.isdir(path)  # noqa: PTH112  as above


def is_plain(text: str) -> bool:
    """Return whether a text can be printed and written: no control characters, no halves of characters."""
    return UNPRINTABLE.search(text) is None


def shown(value: object) -> str:
    """Return a value as Python writes it, shortened to a line, for a message."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # whole numbers of thousands of digits; lists in lists in lists
        return f"a value of type {type(value).__name__} too long to be shown"
    except Exception:  # noqa: BLE001  a user's own class may raise anything
        return f"a value of type {type(value).__name__} that cannot be shown"
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 4]} ..."


def counted(number: int, what: str) -> str:
    """Return number and noun, as in ``3 loops``."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return the first names of a list, and the number of the rest."""
    every = list(names)
    more = len(every) - most
    return ", ".join(every[:most]) + (f" and {more} more" if more > 0 else "")


def _reason(problem: BaseException) -> str:
    text = " ".join(str(problem).split())[:_LONGEST_REASON]
    plain = isinstance(problem, ValueError) and not isinstance(problem, UnicodeEncodeError)
    return text if text and plain else f"{type(problem).__name__}: {text}".rstrip(": ")
