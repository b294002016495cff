"""Settings shared by all tests."""

import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import vl_convert
from hypothesis import settings
from numba import config

from loopgate import kernel_cache

# Examples are derived from the test, not from chance: a red test stays red until it is mended.
settings.register_profile("quick", deadline=None, max_examples=60, derandomize=True)
settings.register_profile("soak", deadline=None, max_examples=3000)
settings.load_profile("quick")


def pytest_configure() -> None:
    """Refuse to test another checkout than this one, and let Ctrl-C reach the programs that tests start.

    Shells in the background tell theirs to ignore it.
    """
    tested, ours = Path(kernel_cache.__file__).resolve().parent, Path(__file__).resolve().parents[1]
    if not tested.is_relative_to(ours):
        msg = f"{ours}: its tests would test {tested}; run `make test` here, or put {ours}/src on PYTHONPATH"
        raise pytest.UsageError(msg)
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for group in (
        "drive",
        "network",
        "research",
    ):  # else it is said in the middle of a test that they compile
        kernel_cache.mark(config.CACHE_DIR, group)  # type: ignore[attr-defined]


@pytest.fixture(autouse=True)
def _libsumo_as_before() -> Iterator[None]:
    """Let no test find that SUMO refused an input of a test before it: runs would go to another process."""
    yield
    backend = sys.modules.get("loopgate.traffic.libsumo_backend")
    if backend is not None:
        backend.half_built.clear()


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave figures empty, where words and tables are what is looked at."""
    monkeypatch.setattr(vl_convert, "vegalite_to_svg", lambda _: '<svg xmlns="http://www.w3.org/2000/svg"/>')
    monkeypatch.setattr(vl_convert, "svg_to_png", lambda *_, **__: b"")
    monkeypatch.setattr(vl_convert, "svg_to_pdf", lambda *_, **__: b"")
