"""Every public function has an example in its docstring, and it comes out as printed.

So has every class at the top of the package that has methods: in its own docstring, or in that of a method.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
from collections.abc import Callable
from pathlib import Path

import pytest

import loopgate

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = [
    loopgate,
    *(importlib.import_module(f"loopgate.{part.name}") for part in pkgutil.iter_modules(loopgate.__path__)),
]


def offered() -> dict[str, Callable[..., object]]:
    """Return public functions and classes by name, each once though several packages offer it."""
    found: dict[Callable[..., object], str] = {}
    for package in PACKAGES:
        for name in getattr(package, "__all__", ()):
            thing = getattr(package, name)
            if inspect.isfunction(thing) or inspect.isclass(thing):
                found.setdefault(thing, f"{package.__name__}.{name}")
    return {name: thing for thing, name in found.items()}


PUBLIC = offered()
EXAMPLES = {
    found.name: found
    for name, thing in PUBLIC.items()
    for found in doctest.DocTestFinder().find(inspect.unwrap(thing), name, globs={})
    if found.examples
}


def needs_example(name: str, thing: Callable[..., object]) -> bool:
    """Functions do, and classes at the top that have methods."""
    if inspect.isfunction(thing):
        return True
    if name.removeprefix("loopgate.") not in loopgate.__all__:
        return False
    return any(inspect.isfunction(part) for key, part in vars(thing).items() if not key.startswith("_"))


@pytest.mark.parametrize("name", [name for name, thing in PUBLIC.items() if needs_example(name, thing)])
def test_there_is_an_example(name: str) -> None:
    """Of a class, that of a method will do."""
    assert any(example == name or example.startswith(f"{name}.") for example in EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs_as_printed(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Paths in it are relative to the repository; what it writes goes elsewhere."""
    for folder in ("analysis", "networks", "routes"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    said: list[str] = []
    assert doctest.DocTestRunner().run(EXAMPLES[name], out=said.append).failed == 0, "".join(said)
