"""Settings shared by all tests."""

import signal

from hypothesis import settings
from numba import config

from loopgate.kernel_cache import mark

# Examples are derived from the test, not from chance: a red test stays red until it is mended.
settings.register_profile("quick", deadline=None, max_examples=60, derandomize=True)
settings.register_profile("soak", deadline=None, max_examples=3000)
settings.load_profile("quick")


def pytest_configure() -> None:
    """Let Ctrl-C reach the programs that tests start: shells in the background tell theirs to ignore it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for group in (
        "drive",
        "network",
        "research",
    ):  # else it is said in the middle of a test that they compile
        mark(config.CACHE_DIR, group)  # type: ignore[attr-defined]
