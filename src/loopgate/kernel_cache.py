"""Forgets compiled code that is older than its source.

Numba keeps what it compiled by file, and looks at that file only: a function keeps an old version of what it
calls, or of a constant, in another file. Here all kernels are forgotten as soon as any source file of the
package is another than it was.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

__all__ = ["forget_stale_kernels"]

_STAMP = "kernels.stamp"


def forget_stale_kernels(package: Path = Path(__file__).parent) -> bool:
    """Delete the compiled code in a package if its sources have changed since; return whether they had.

    Parameters
    ----------
    package
        The folder of the package. One that cannot be written to is left as it is.
    """
    cache = package / "__pycache__"
    sources = sorted(package.rglob("*.py"))
    facts = [
        (str(file.relative_to(package)), file.stat().st_size, file.stat().st_mtime_ns) for file in sources
    ]
    stamp = hashlib.sha256(repr(facts).encode()).hexdigest()
    try:
        if (cache / _STAMP).exists() and (cache / _STAMP).read_text(encoding="ascii") == stamp:
            return False
        for kernel in [*package.rglob("*.nbi"), *package.rglob("*.nbc")]:
            kernel.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        (cache / _STAMP).write_text(stamp, encoding="ascii")
    except OSError:
        return False
    return True
