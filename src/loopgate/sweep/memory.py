"""Peak memory of a process, per run where the system can tell."""

import contextlib
import resource
import sys
from pathlib import Path

_KIB_PER_MIB = 1024
_RESET_PEAK = "5"  # proc(5), clear_refs: reset the peak resident set size


def reset_peak_memory() -> None:
    """Reset the peak of memory; only Linux can, other systems keep the old peak."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text(_RESET_PEAK, encoding="ascii")


def peak_memory_mb() -> float:
    """Return the largest resident memory since the last reset, or of the process [MiB]."""
    try:
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / _KIB_PER_MIB
    except OSError:
        pass
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / _KIB_PER_MIB**2 if sys.platform == "darwin" else peak / _KIB_PER_MIB
