"""Compile what tests need before they begin; else each process that tests would compile all of it."""

import sys

from numba import config

from loopgate.cli.warm_up import compile_all
from loopgate.kernel_cache import mark

if __name__ == "__main__" and mark(config.CACHE_DIR, "tests"):  # type: ignore[attr-defined]
    sys.stderr.write(f"{compile_all()} functions compiled\n")
