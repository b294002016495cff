"""Spoil valid inputs in many ways and see that each is read or refused in one line: ``make fuzz``.

    python analysis/fuzz.py --inputs 20000 --cli 500
    python analysis/fuzz.py --again "sweep file" 17

Another process reads them: each may take 20 s, and 1 GB more memory than the process has when it begins.
The same seed spoils the same inputs in the same way; ``--again`` does one of them in this process and shows
what happens. Input 0 of each reader of files is valid, and has to be read. Ends with exit code 1 if an input
was neither read nor refused.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import resource
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import NamedTuple

from fuzz_cli import CLI, check_commands
from fuzz_mutations import spoiled
from fuzz_plugins import PLUGINS
from fuzz_readers import READERS as FILES
from fuzz_readers import make_inputs
from fuzz_results import RESULTS
from fuzz_runs import RUNS, make_runs

from loopgate.errors import LoopgateError
from loopgate.sweep.task import peak_memory_mb, reset_peak_memory

READERS = (*PLUGINS, *RESULTS, *RUNS, *FILES)
HANG_S = 20.0
MEMORY_MB = 1024
_LONGEST_LINE = 2_500
_EVERY_S = 15.0
_WAITS = 6
_MUCH_MB = 500.0


class Outcome(NamedTuple):
    """What became of an input: ``read``, ``refused``, or a fault with what tells it from others."""

    kind: str
    text: str = ""
    peak_mb: float = 0.0


@dataclass(slots=True)
class Tally:
    """What became of a reader's inputs."""

    kinds: Counter[str] = field(default_factory=Counter)
    faults: dict[str, list[int]] = field(default_factory=dict)
    peak_mb: float = 0.0
    peak_at: int = 0
    seconds: float = 0.0

    def add(self, number: int, outcome: Outcome) -> None:
        """Count an input."""
        self.kinds[outcome.kind] += 1
        if outcome.peak_mb > self.peak_mb:
            self.peak_mb, self.peak_at = outcome.peak_mb, number
        if outcome.kind not in {"read", "refused"}:
            self.faults.setdefault(f"{outcome.kind}: {outcome.text}", []).append(number)


def try_reader(name: str, number: int, inputs: Path, scratch: Path, seed: int) -> None:
    """Spoil one input and read it; whatever it raises is the caller's to judge."""
    reader = next(r for r in (*READERS, CLI) if r.name == name)
    random = Random(f"{seed} {name} {number}")
    folder = scratch / reader.name.replace(" ", "-").replace(",", "")
    if not folder.exists():
        shutil.copytree(inputs / reader.folder, folder)
    found = sorted(file for pattern in reader.files for file in folder.glob(pattern) if file.is_file())
    if not found or not number:
        reader.read(folder, random)
        return
    file = random.choice(found)
    before = file.read_bytes()
    try:
        file.write_bytes(spoiled(file.name, before, random))
        reader.read(folder, random)
    except LoopgateError as error:
        _check_text(str(error))
        raise
    finally:
        file.write_bytes(before)


def _check_text(text: str) -> None:
    if not text or "\n" in text or len(text) > _LONGEST_LINE:
        msg = f"not one line: {text[:100]!r}"
        raise AssertionError(msg)


def _serve(connection: Connection, inputs: str, scratch: str, seed: int) -> None:
    """Answer with the outcome of each input that is asked for, until None."""
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 2)
    os.dup2(quiet, 1)
    warnings.simplefilter("error")
    here = Path(scratch, "a", "b", "c")  # a spoiled name of an output is a file here; ../../x is one too
    here.mkdir(parents=True, exist_ok=True)
    os.chdir(here)
    reset_peak_memory()
    base_mb = peak_memory_mb()
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = pages * resource.getpagesize() + MEMORY_MB * 2**20
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
    connection.send(None)
    while (job := connection.recv()) is not None:
        name, number = job
        reset_peak_memory()
        outcome = Outcome("read")
        try:
            try_reader(name, number, Path(inputs), Path(scratch), seed)
        except LoopgateError as error:
            outcome = Outcome("refused", str(error))
        except BaseException as error:  # noqa: BLE001  to find what should not be raised is the purpose
            outcome = Outcome("traceback", _place(error))
        connection.send(outcome._replace(peak_mb=peak_memory_mb() - base_mb))


def _place(error: BaseException) -> str:
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "loopgate" in f.filename]
    where = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "?"
    return f"{type(error).__name__} in {where}: {' '.join(str(error).split())[:110]}"


class Worker:
    """A process that reads spoiled inputs; begun anew when it hangs or dies."""

    def __init__(self, inputs: Path, scratch: Path, seed: int) -> None:
        self._given = (str(inputs), str(scratch), seed)
        self._scratch = scratch
        self._process: multiprocessing.process.BaseProcess | None = None
        self._connection: Connection | None = None

    def try_one(self, name: str, number: int) -> Outcome:
        """Return what becomes of an input."""
        if self._connection is None:
            self._connection = self._begin()
        self._connection.send((name, number))
        if not self._answers(self._connection):
            self.close()
            return Outcome("hang", f"over {HANG_S:g} s")
        try:
            outcome: Outcome = self._connection.recv()
        except EOFError:
            code = self.close()
            return Outcome("died", f"exit code {code}")
        return outcome

    def _answers(self, connection: Connection) -> bool:
        """Wait for an answer: so long in processor time, as others may be busy too, or six times that."""
        begin = self._busy_s()
        for _ in range(_WAITS):
            if connection.poll(HANG_S):
                return True
            if self._busy_s() - begin > HANG_S:
                return False
        return False

    def _busy_s(self) -> float:
        """Return the processor time of the process so far [s]."""
        assert self._process is not None  # noqa: S101 - for the type checker; it has been begun
        with contextlib.suppress(FileNotFoundError):  # it died
            fields = (
                Path(f"/proc/{self._process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
            )
            return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        return 0.0

    def close(self) -> int | None:
        """End the process; return with what code it had ended before, if it had."""
        code = None
        if self._process is not None:
            self._process.join(1.0)
            code = self._process.exitcode
            self._process.kill()
            self._process.join()
        self._process = self._connection = None
        return code

    def _begin(self) -> Connection:
        shutil.rmtree(self._scratch, ignore_errors=True)  # it may have died with a file spoiled
        self._scratch.mkdir(parents=True)
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, *self._given), daemon=True)
        self._process.start()
        theirs.close()
        ours.recv()
        return ours


def main() -> int:
    """Spoil and read."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--inputs", type=int, default=20_000, help="inputs to the readers, all together")
    parser.add_argument("--cli", type=int, default=500, help="command lines")
    parser.add_argument("--seconds", type=float, default=1_500.0, help="end after so long, whatever is left")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="readers whose name contains this")
    parser.add_argument("--valid", type=Path, help="folder of the valid inputs; made if it is not there")
    parser.add_argument("--again", nargs=2, metavar=("READER", "NUMBER"), help="do one input here")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="loopgate-fuzz-") as place:
        inputs = given.valid or Path(place) / "inputs"
        if not inputs.exists():
            with _making_inputs():
                _make(inputs)
        if given.again:
            (Path(place) / "scratch").mkdir()
            try_reader(given.again[0], int(given.again[1]), inputs, Path(place) / "scratch", given.seed)
            return 0
        tallies = _all(given, inputs, Path(place) / "scratch")
    _print(tallies)
    return int(any(tally.faults for tally in tallies.values()))


def _make(inputs: Path) -> None:
    context = multiprocessing.get_context("spawn")  # SUMO's memory is not this process's
    process = context.Process(target=_make_inputs, args=(str(inputs),))
    process.start()
    process.join()
    if process.exitcode:
        shutil.rmtree(inputs, ignore_errors=True)
        sys.exit("the valid inputs could not be made")


def _make_inputs(folder: str) -> None:
    make_runs(Path(folder))
    make_inputs(Path(folder))
    check_commands(Path(folder))
    shutil.rmtree(Path(folder) / "out")


@contextlib.contextmanager
def _making_inputs() -> Iterator[None]:
    begin = time.perf_counter()
    yield
    print(f"valid inputs made in {time.perf_counter() - begin:.0f} s", flush=True)


def _all(given: argparse.Namespace, inputs: Path, scratch: Path) -> dict[str, Tally]:
    without_files = {reader.name for reader in READERS if not reader.files}
    shares = sum(reader.share for reader in READERS)
    plan = [(r.name, -(-given.inputs * r.share // shares)) for r in READERS]
    plan = [(name, count) for name, count in [*plan, ("command line", given.cli)] if given.only in name]
    tallies: dict[str, Tally] = {}
    worker = Worker(inputs, scratch, given.seed)
    began = shown = time.perf_counter()
    for name, count in plan:
        tally = tallies[name] = Tally()
        begun = time.perf_counter()
        for number in range(count):
            if time.perf_counter() - began > given.seconds:
                break
            outcome = worker.try_one(name, number)
            if number == 0 and outcome.kind == "refused" and name not in {*without_files, "command line"}:
                outcome = outcome._replace(kind="traceback", text=f"a valid input is refused: {outcome.text}")
            tally.add(number, outcome)
            tally.seconds = time.perf_counter() - begun
            if time.perf_counter() - shown > _EVERY_S:
                shown = time.perf_counter()
                print(
                    f"  {name}: {number + 1} of {count}, {sum(map(len, tally.faults.values()))} faults",
                    flush=True,
                )
    worker.close()
    return tallies


def _print(tallies: dict[str, Tally]) -> None:
    kinds = ("refused", "read", "traceback", "hang", "died")
    print(
        f"{'reader':20} {'inputs':>7} " + " ".join(f"{kind:>9}" for kind in kinds) + "  peak [MB]  time [s]"
    )
    total: Counter[str] = Counter()
    for name, tally in tallies.items():
        total += tally.kinds
        _line(name, tally.kinds, kinds, tally.peak_mb, tally.seconds)
    most = max((tally.peak_mb for tally in tallies.values()), default=0.0)
    _line("all", total, kinds, most, sum(tally.seconds for tally in tallies.values()))
    for name, tally in tallies.items():
        if tally.peak_mb > _MUCH_MB:
            print(f"{name}: {tally.peak_mb:.0f} MB (as number {tally.peak_at})")
        for text, numbers in sorted(tally.faults.items(), key=lambda item: -len(item[1])):
            print(f"{name}: {len(numbers)} x {text} (as number {numbers[0]})")


def _line(name: str, counts: Counter[str], kinds: tuple[str, ...], peak_mb: float, seconds: float) -> None:
    figures = " ".join(f"{counts[kind]:>9}" for kind in kinds)
    print(f"{name:20} {counts.total():>7} {figures} {peak_mb:>10.0f} {seconds:>9.0f}")


if __name__ == "__main__":
    sys.exit(main())
