"""Every public function has an example in its docstring, and it comes out as printed."""

from __future__ import annotations

import doctest
import inspect
from collections.abc import Callable
from pathlib import Path

import pytest

import loopgate
import loopgate.analysis
import loopgate.plots

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
PUBLIC = {
    f"{home.__name__}.{name}": getattr(home, name)
    for home in (loopgate, loopgate.analysis, loopgate.plots)
    for name in home.__all__
    if inspect.isfunction(getattr(home, name))
} | {
    "loopgate.RoadNetwork.open": loopgate.RoadNetwork.open,
    "loopgate.Scenario": loopgate.Scenario,
    "loopgate.Sweep": loopgate.Sweep,
    "loopgate.System": loopgate.System,
}


@pytest.mark.parametrize("name", PUBLIC)
def test_an_example_runs_as_printed(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Paths in it are relative to the repository; what it writes goes elsewhere."""
    for folder in ("analysis", "networks", "routes"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    public: Callable[..., object] = PUBLIC[name]
    (found,) = doctest.DocTestFinder(recurse=False).find(inspect.unwrap(public), name, globs={})
    assert found.examples, f"{name} has no example"
    said: list[str] = []
    assert doctest.DocTestRunner().run(found, out=said.append).failed == 0, "".join(said)
