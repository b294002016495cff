"""Settings shared by all tests."""

import os
import signal
import subprocess
import sys
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


def _half_built() -> bool:
    """Return whether SUMO has refused an input of a test in this process, and left a part of it."""
    backend = sys.modules.get("loopgate.traffic.libsumo_backend")
    return backend is not None and bool(backend.half_built)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test in a process of its own if it leaves a part of its input in libsumo, or finds one there.

    With such a part the next simulation in the process can end it. Runs of loopgate go to another process
    then; tests that start libsumo themselves do not.
    """
    marked = pyfuncitem.get_closest_marker
    starts = marked("in_libsumo") or {"libsumo", "libsumo_backend"} & vars(pyfuncitem.module).keys()
    alone = marked("spoils_libsumo") or (starts and _half_built())
    if not alone or "LOOPGATE_TEST_ALONE" in os.environ:
        return None
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", pyfuncitem.nodeid]
    done = subprocess.run(
        command,
        check=False,
        capture_output=True,
        text=True,
        cwd=pyfuncitem.config.rootpath,
        env={**os.environ, "LOOPGATE_TEST_ALONE": "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return True


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave figures empty, where words and tables are what is looked at."""
    monkeypatch.setattr(vl_convert, "vegalite_to_svg", lambda _: '<svg xmlns="http://www.w3.org/2000/svg"/>')
    monkeypatch.setattr(vl_convert, "svg_to_png", lambda *_, **__: b"")
    monkeypatch.setattr(vl_convert, "svg_to_pdf", lambda *_, **__: b"")
