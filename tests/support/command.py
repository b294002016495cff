"""The `loopgate` command as a shell runs it, but in this process: one of its own takes seconds to start."""

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, chdir, contextmanager
from pathlib import Path

import pytest

from loopgate.cli.main import main

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def loopgate(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run the command; return its exit code and all that it and SUMO print."""
    handlers = [signal.getsignal(name) for name in _SIGNALS]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        try:
            with ExitStack() as stack:
                patch = stack.enter_context(pytest.MonkeyPatch.context())
                for number, file in ((1, out.fileno()), (2, err.fileno())):
                    stack.enter_context(_instead(number, file))
                stack.enter_context(chdir(cwd or Path()))
                for stream, number in (("stdout", 1), ("stderr", 2)):
                    patch.setattr(sys, stream, stack.enter_context(open(number, "w", closefd=False)))
                patch.setattr(sys, "argv", ["loopgate", *map(str, words)])
                main()
        except SystemExit as ended:
            code = ended.code
        finally:
            for name, handler in zip(_SIGNALS, handlers, strict=True):
                signal.signal(name, handler)
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(["loopgate", *words], int(code or 0), out.read(), err.read())


@contextmanager
def _instead(number: int, file: int) -> Iterator[None]:
    """Let what is written to a file descriptor go to another file for a while."""
    kept = os.dup(number)
    os.dup2(file, number)
    try:
        yield
    finally:
        os.dup2(kept, number)
        os.close(kept)
