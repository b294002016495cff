"""Compile what tests need before they begin; else each process that tests would compile all of it."""

import compileall
import sys
from pathlib import Path

from numba import config

import loopgate
from loopgate.cli.warm_up import compile_all
from loopgate.research.kernel_cache import mark

if __name__ == "__main__":
    # Where PYTHONDONTWRITEBYTECODE is set, hundreds of processes would keep nothing of what they compile.
    compileall.compile_dir(Path(loopgate.__file__).parent, quiet=1)
    if mark(config.CACHE_DIR, "tests"):  # type: ignore[attr-defined]
        sys.stderr.write(f"{compile_all()} functions compiled\n")
