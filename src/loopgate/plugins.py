"""Gates and negotiations by name, with options: ``name`` or ``name:option=value,option=value``.

A name is that of an entry point, or ``file.py:Name`` for what a Python file of the user's defines. What a
program has at hand gets such a name too, so that scenarios, sweeps and results are text throughout.
"""

import hashlib
import importlib.util
import inspect
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, TypeVar, cast

from loopgate.cache import Cache
from loopgate.errors import LoopgateError, PluginError
from loopgate.reading import meant, refusing, shown

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


T = TypeVar("T")
Factory = Callable[..., Any]

_LARGEST = 1e12
_LONGEST = 120
_KINDS: dict[str, tuple[tuple[type, ...], str]] = {
    "int": ((int,), "a whole number"),
    "float": ((int, float), "a number"),
    "bool": ((bool,), "true or false"),
    "str": ((str,), "a text"),
}
"""Values that an option takes, by its annotation."""

_IN_FILE = re.compile(r"(?P<file>.*\.py):(?P<rest>[^\W\d]\w*(?::.*)?)", re.DOTALL)
_HERE = "here."
"""Begins the names of things that no file holds; they mean something in one process only."""

_at_hand: dict[str, Factory] = {}


class FilePlugin(NamedTuple):
    """A name that refers to an object in a Python file."""

    file: str
    """As it is written."""
    rest: str
    """The thing that it names there, with options."""


def in_file(spec: object) -> FilePlugin | None:
    """Return file and rest of ``file.py:Name:option=value``; None for another text."""
    found = _IN_FILE.fullmatch(spec) if isinstance(spec, str) else None
    return FilePlugin(found["file"], found["rest"]) if found else None


class Plugins(NamedTuple):
    """A kind of plugin, such as gates: its name in messages, its entry-point group, and its error."""

    kind: str
    group: str
    error: type[LoopgateError]
    given: str = "what it is made for"
    """The one thing that a factory is called with, besides the options."""

    def name_of(self, thing: object) -> str:
        """Return a name by which `make` finds a class or function, in other processes too if possible.

        A text is a name already. What is installed has the name of its entry point, what stands at the top of
        a Python file ``file.py:Name``; anything else gets a name that only this process knows.

        Raises `error` if `thing` cannot be called.
        """
        if isinstance(thing, str):
            return thing
        if not callable(thing):
            msg = f"{self.kind} {shown(thing)}: expected a name, or a class or function that makes one"
            raise self.error(msg)
        own = getattr(thing, "__qualname__", type(thing).__qualname__)
        home = f"{getattr(thing, '__module__', '')}:{own}"
        for point in entry_points(group=self.group):
            if point.value == home:
                return point.name
        # Lambdas and partial classes are called alike.
        alone = own.isidentifier() and hasattr(thing, "__qualname__")
        name = f"{_HERE}{own}" if alone else f"{_HERE}{id(thing):x}"
        with suppress(TypeError, OSError):  # no source, as in a notebook
            file = inspect.getsourcefile(cast("Any", thing))
            if file and own.isidentifier() and file.endswith(".py") and Path(file).is_file():
                name = f"{os.path.relpath(file)}:{own}"
        _at_hand[name] = thing
        return name

    def make(self, spec: str, make: Callable[[Factory, Mapping[str, object]], T]) -> T:
        """Load the class that `spec` names, and call it with the options in `spec`.

        Raises `error` if nothing has that name, the thing has no such option, or refuses an option's value by
        a `ValueError`. Raises `PluginError` if a user's own thing raises anything else, but for errors of the
        package, which get its name if they lack it.

        Parameters
        ----------
        spec
            The name (see `name_of`), with options behind a colon. Values are whole numbers, decimal numbers,
            ``true`` or ``false``, else text; numbers are finite and at most 1e12 in size. Where the factory
            annotates an option as one of these, only such a value is taken.
        make
            Called with the loaded factory, whose first parameter is not an option, and the options.
        """
        name, colon, rest = _split(spec)
        factory = self._factory(name)
        options = dict(self._option(spec, part) for part in rest.split(",")) if colon else {}
        known = _options(factory)
        for option, value in options.items():
            if option not in known:
                has = f"; its options are {', '.join(known)}" if known else "; it has no options"
                msg = f"{self.kind} {name}: unknown option {shown(option)}{has}{meant(option, known)}"
                raise self.error(msg)
            if (expected := _expected(value, known[option].annotation)) is not None:
                msg = f"{self.kind} {name}: {option} is {shown(value)}; expected {expected}"
                raise self.error(msg)
        who = f"{self.kind} {_short(spec)}"
        if not is_ours(factory):
            return self._make_theirs(who, lambda: make(factory, options))
        try:
            return make(factory, options)
        except (TypeError, ValueError) as error:
            msg = f"{who}: {error}"
            raise self.error(msg) from error

    def _make_theirs(self, who: str, make: Callable[[], T]) -> T:
        problem: Exception
        with blaming(f"{who}: making it", f"a class or function that is called with {self.given}"):
            try:
                return make()
            except LoopgateError as error:
                if not str(error).startswith(self.kind):
                    error.args = (f"{who}: {error}",)
                problem = error
            except ValueError as error:
                problem = self.error(f"{who}: {reason_of(error).removeprefix('ValueError: ')}")
        raise problem

    def _option(self, spec: str, part: str) -> tuple[str, object]:
        key, equals, text = part.partition("=")
        if not key or not equals:
            msg = f"{self.kind} {_short(spec)}: {shown(part)} is no option; write name=value"
            raise self.error(msg)
        return key.strip(), _value(text.strip())

    def _factory(self, name: str) -> Factory:
        if name in _at_hand:
            return _at_hand[name]
        where = in_file(name)
        if where is not None:
            return self.from_file(where)
        what = f"{self.kind} {_short(name)}"
        if name.startswith(_HERE):
            msg = f"{what}: made in another program; write it to a file, and name file.py:NAME"
            raise self.error(msg)
        points = _installed(self.group)
        if name not in points:
            there = f"; installed are {', '.join(sorted(points))}; for one of your own write file.py:NAME"
            msg = f"{what}: there is no such {self.kind}{there}{meant(name, points)}"
            raise self.error(msg)
        try:
            return cast("Factory", points[name].load())
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            msg = f"{self.kind} {name}: it is installed, but cannot be imported ({reason_of(error)})"
            raise self.error(msg) from error

    def from_file(self, where: FilePlugin) -> Factory:
        """Return an object of a Python file by its name; an unchanged file is run only once.

        Raises `error` if there is no such file, it fails, or it defines no such thing that can be called.
        """
        file, name = where
        with refusing(f"{self.kind} {file}:{name}", "Python file", self.error):
            source = Path(file).read_bytes()
        try:
            module = _MODULES.get((str(Path(file).resolve()), source), lambda: _run_file(file, source))
            thing = getattr(module, name, None)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            msg = f"{self.kind} {file}:{name}: the file fails ({reason_of(error)})"
            raise self.error(msg) from error
        if not callable(thing):
            msg = f"{self.kind} {file}:{name}: the file defines no class or function of that name"
            raise self.error(msg)
        return cast("Factory", thing)


def _split(spec: str) -> tuple[str, str, str]:
    """Return a name, the colon before its options if there are any, and the options."""
    where = in_file(spec)
    if where is None:
        return spec.partition(":")
    name, colon, rest = where.rest.partition(":")
    return f"{where.file}:{name}", colon, rest


@cache
def _installed(group: str) -> Mapping[str, EntryPoint]:
    """Return the entry points of a group; to look for them takes milliseconds."""
    return {point.name: point for point in entry_points(group=group)}


_MODULES: Cache[ModuleType] = Cache(32)


def _run_file(file: str, source: bytes) -> ModuleType:
    # Dataclasses and pickle look for a module where imports leave it.
    name = f"loopgate_file_{hashlib.sha256(file.encode() + source).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None:
        raise ImportError(file)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    try:
        # Not by the loader: what it keeps compiled is told apart by whole seconds and the file's size only.
        exec(compile(source, file, "exec"), module.__dict__)  # noqa: S102 - to run it is what the user asks
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _options(factory: Factory) -> dict[str, inspect.Parameter]:
    """Return the options that a factory takes: its parameters, but for the first."""
    try:
        return dict(list(inspect.signature(factory).parameters.items())[1:])
    except (TypeError, ValueError):  # some that are not written in Python do not say
        return {}


def _expected(value: object, annotation: object) -> str | None:
    """Return the expected kind of an option by its annotation; None if the value is of that kind."""
    if isinstance(value, int | float) and not abs(value) <= _LARGEST:
        return f"a finite number, at most {_LARGEST:g} in size"
    # Annotations are texts where the module postpones them.
    name = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", "")
    kinds, expected = _KINDS.get(name, ((object,), ""))
    strange = isinstance(value, bool) and bool not in kinds and expected
    return expected if strange or not isinstance(value, kinds) else None


def _short(spec: str) -> str:
    return spec if len(spec) <= _LONGEST else f"{spec[:_LONGEST]} ..."


def _value(text: str) -> object:
    if text in {"true", "false"}:
        return text == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
