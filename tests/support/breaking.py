"""Faults on purpose: one function's source with something else in one place."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable
from types import FunctionType
from typing import Any

import pytest


def break_it(monkeypatch: pytest.MonkeyPatch, function: Callable[..., Any], old: str, new: str) -> None:
    """Exchange the code of `function` for one in which `old` reads `new`."""
    assert isinstance(function, FunctionType)
    source = textwrap.dedent(inspect.getsource(function))
    assert source.count(old) == 1, f"{old!r} is not once in {function.__qualname__}"
    source = source.replace("@staticmethod\n", "")
    space: dict[str, Any] = dict(function.__globals__)
    exec(compile(source.replace(old, new), "<broken>", "exec"), space)  # noqa: S102 - our own source
    monkeypatch.setattr(function, "__code__", space[function.__name__].__code__)
