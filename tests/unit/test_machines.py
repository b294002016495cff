"""What only Linux has is not needed: a run and a sweep without it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

WITHOUT = """
import os, signal, subprocess, sys
import numpy, pandas, pyarrow.parquet  # what looks for Windows by itself
sys.modules["fcntl"] = sys.modules["resource"] = None
for name in ("sched_getaffinity", "getuid", "geteuid"):
    delattr(os, name)
for name in ("SIGHUP", "SIGKILL"):
    delattr(signal, name)
class msvcrt:
    LK_NBLCK = 2
    locking = staticmethod(lambda *_: None)
sys.modules["msvcrt"] = msvcrt
from loopgate import Scenario, run
from loopgate.machines import largest_file_bytes, peak_memory_bytes, processors
from loopgate.sweep.local import LocalExecutor, _begin
_begin()  # of a worker
done = run(Scenario(network="networks/order2.net.xml", routes="routes/order2.rou.xml", duration_s=30))
print(done.summary["audit"], processors() > 0, largest_file_bytes(), peak_memory_bytes())
"""


def test_a_machine_without_what_linux_has(tmp_path: Path) -> None:
    """Locks, owners, limits and signals have a way round."""
    # In a folder of its own: its locks are none, so it would take folders in use for abandoned ones.
    own = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", WITHOUT]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=own)
    assert (done.returncode, done.stdout.split()) == (0, ["clean", "True", "None", "0"]), done.stderr
