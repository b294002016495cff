"""Settings shared by all tests."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import vl_convert
from compiled_wheel import stale
from hypothesis import settings
from numba import config

from loopgate.research import kernel_cache

# Examples are derived from the test, not from chance: a red test stays red until it is mended.
settings.register_profile("quick", deadline=None, max_examples=60, derandomize=True)
settings.register_profile("soak", deadline=None, max_examples=3000)
settings.load_profile("quick")

_ALONE = "LOOPGATE_TEST_ALONE"
"""Is set in the process of a single test."""


def pytest_configure() -> None:
    """Refuse to test another checkout than this one, and let Ctrl-C reach the programs that tests start.

    Shells in the background tell theirs to ignore it.
    """
    tested, ours = Path(kernel_cache.__file__).resolve().parents[1], Path(__file__).resolve().parents[1]
    if not tested.is_relative_to(ours):
        msg = f"{ours}: its tests would test {tested}; run `make test` here, or put {ours}/src on PYTHONPATH"
        raise pytest.UsageError(msg)
    if stale():
        msg = f"{stale()[0]} is newer than what was compiled of it in place: `make compiled` or `make plain`"
        raise pytest.UsageError(msg)
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Else it is said in the middle of a test that they compile.
    kernel_cache.mark(config.CACHE_DIR, "research")  # type: ignore[attr-defined]


def _refusals() -> int:
    """Return how often SUMO has refused an input of a test in this process, and left a part of it."""
    backend = sys.modules.get("loopgate.traffic.libsumo_backend")
    return 0 if backend is None else len(backend.half_built)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test in a process of its own if it leaves a part of its input in libsumo.

    With such a part the next simulation in the process can end it, and runs go to another process.
    """
    if pyfuncitem.get_closest_marker("spoils_libsumo") is None or _ALONE in os.environ:
        return None
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "0", pyfuncitem.nodeid],
        check=False,
        capture_output=True,
        text=True,
        cwd=pyfuncitem.config.rootpath,
        env={**os.environ, _ALONE: "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return True


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Fail a test that leaves a part of its input in libsumo unmarked: all tests after it would be slow."""
    before = _refusals()
    yield
    if _refusals() > before and _ALONE not in os.environ:
        pytest.fail(f"{item.nodeid} leaves a part of its input in libsumo: mark it as spoils_libsumo")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave figures empty, where words and tables are what is looked at."""
    monkeypatch.setattr(vl_convert, "vegalite_to_svg", lambda _: '<svg xmlns="http://www.w3.org/2000/svg"/>')
    monkeypatch.setattr(vl_convert, "svg_to_png", lambda *_, **__: b"")
    monkeypatch.setattr(vl_convert, "svg_to_pdf", lambda *_, **__: b"")


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Search for covering loops in two short rounds, where what becomes of the loops is looked at."""
    for effort, least in (("ROUNDS", 2), ("_MOVES_OF_EACH", 50), ("_PAIRS", 15)):
        monkeypatch.setattr(f"loopgate.network.cover.search.{effort}", least)
