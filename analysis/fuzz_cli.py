"""Command lines with a fault: in a word, or in a file that they name."""

from __future__ import annotations

import contextlib
import io
import resource
import subprocess
import sys
from pathlib import Path
from random import Random

import vl_convert
from fuzz_mutations import spoiled, spoiled_word
from fuzz_readers import Reader

import loopgate.report.page
import loopgate.traffic.libsumo_backend  # noqa: F401  its memory is not the input's, nor that of the page above
from loopgate.cli.main import EXIT_BAD_INPUT, EXIT_DEADLOCK, EXIT_STARVING, main
from loopgate.errors import LoopgateError
from loopgate.reading import is_file

vl_convert.vegalite_to_svg({"mark": "point"})
"""The first time it sets gigabytes of addresses aside, for memory that it never uses: no input's fault."""

ENDS = {0, 1, EXIT_BAD_INPUT, EXIT_DEADLOCK, EXIT_STARVING}
"""The exit codes of commands that end as they should: a run that is not clean does not."""

_PROCESSES = 0.06
"""Share of the command lines that are given to a process of their own."""

_COMMANDS = (
    "run network/n.net.xml --routes routes/r.rou.xml --duration 5 --gate certified --step-length 1 -o OUT",
    "run network/n.net.xml --vehicles 3 --loops 2 --length 200:600 --duration 5 --seed 3 --warmup 2",
    "run network/n.net.xml --vehicles 2 --length 200:600 --duration 5 --traffic routes/t.rou.xml",
    "run network/n.net.xml --vehicles 2 --length 200:600 --duration 5 --negotiation pressure:patience=5",
    "run network/n.net.xml --routes routes/r.rou.xml --abstraction segments --rho 1.2 --duration 5",
    "run scenario/s.toml --duration 5 --deadlock-after 60 --lights off --on-deadlock stop",
    "run configured/c.sumocfg --gate open --duration 5 --json",
    "run configured/c.sumocfg --duration 5 --write fcd --sumo --tls.actuated.jam-threshold=10 -o OUT",
    "run network/n.net.xml --vehicles 3 --loops 3 --length 200:900 --spacing hold --starts even --duration 5",
    "run network/n.net.xml --vehicles 2 --duration 5 --revisit 99 --weights wishes/weights.txt",
    "run network/n.net.xml --vehicles 2 --duration 5 --districts wishes/d.add.xml",
    "loops network/n.net.xml --cover wishes/streets.txt --either-way --weights wishes/weights.txt -o OUT",
    "loops network/n.net.xml --cover wishes/d.add.xml --revisit 600 --margin 1.2 --vclass passenger",
    "loops network/n.net.xml --count 3 --length 100:600 --seed 1 --max-shared 0.9 --rho 1.25",
    "loops packed/n.net.xml.gz --count 2 --length 100:600 -o OUT",
    "inspect network/n.net.xml --routes routes/r.rou.xml --vehicle-length 5 --seed 1 --json",
    "inspect network/n.net.xml --routes routes/r.rou.xml --abstraction segments --rho 1.2 --piece 50 -o OUT",
    "inspect configured/c.sumocfg",
    "study explore system/s.json --gate collision --memory-gb 1 --counterexample",
    "study trace system/s.json --gate algorithm2:lookahead=2 --moves r1,r2,r1 --json",
    "study montecarlo system/s.json --gate banker --rounds 5 --seed 2",
    "study verify system/s.json --gate certified:budget=50 --seed 1 --limit 50 --walks 1 --steps 5",
    "study check-certificate certificates/c.jsonl",
    "sweep sweep/s.toml --dry-run --workers 2 --timeout 9 -o OUT --json",
    "sweep sweep/s.toml --dry-run",
    "report results/ -o OUT/page.html",
    "report run/ --files OUT -o OUT/page.html",
    "replay run/ -o OUT/replay.html",
    "inspect network/n.net.xml --routes routes/r.rou.xml --additional OUT",
)
_FOLDERS = {"results/", "run/"}
_COSTLY = {"--rounds", "--walks", "--steps", "--limit", "--systems", "--count", "--duration", "--warmup"}
"""Options by which one asks for long work: they are spoiled by words that are no larger number."""


def _command(folder: Path, random: Random) -> None:
    words = random.choice(_COMMANDS).split()
    places = [n for n, word in enumerate(words) if n and not word.startswith("--")]
    files = [n for n in places if is_file(folder / words[n]) or words[n] in _FOLDERS]
    spoils: dict[Path, bytes] = {}
    if files and random.random() < 0.5:  # noqa: PLR2004  half of them
        named = folder / words[random.choice(files)]
        inside = sorted(f for f in named.rglob("*") if f.is_file()) if named.is_dir() else [named]
        file = random.choice(inside)
        spoils[file] = file.read_bytes()
    else:
        number = random.choice(places)
        costly = words[number - 1] in _COSTLY
        nasty = (
            "nan",
            "inf",
            "-1",
            "1e999",
            "x",
            "",
            "0",
            "-0",
            "1e",
            "--",
            "x" * 300,
            "99999999999999999999999",
        )
        words[number] = (
            random.choice(nasty)
            if costly
            else random.choice((*nasty, "1e308", *[spoiled_word(words[number], random)] * 6))
        )
    full = _full(words, folder, str(random.randrange(10**9)))
    try:
        for file, before in spoils.items():
            file.write_bytes(spoiled(file.name, before, random))
        code, text = _in_process(full) if random.random() < _PROCESSES else _here(full)
    finally:
        for file, before in spoils.items():
            file.write_bytes(before)
    ours = [line for line in text.splitlines() if line.startswith("loopgate: ")]
    lines = ours or [
        line for line in text.splitlines() if line.startswith("Error: ")
    ]  # SUMO too says "Error"
    if "Traceback" in text or code not in ENDS or (code == EXIT_BAD_INPUT and len(lines) != 1):
        msg = f"exit code {code}: {' '.join(full)[:150]}: {text[-300:]}"
        raise AssertionError(msg)
    if code == EXIT_BAD_INPUT:
        raise LoopgateError(lines[0])


def check_commands(folder: Path) -> None:
    """Run every command line without a fault; also compiles what they need, which takes its time.

    Raises
    ------
    AssertionError
        If one is refused.
    """
    for number, command in enumerate(_COMMANDS):
        code, text = _here(_full(command.split(), folder, f"valid{number}"))
        if code not in {0, 3}:
            msg = f"{command}: exit code {code}: {text}"
            raise AssertionError(msg)


def _full(words: list[str], folder: Path, out: str) -> list[str]:
    """Return words with the inputs' folder before the names of files, and a place for OUT."""
    full = [str(folder / word) if is_file(folder / word) or word in _FOLDERS else word for word in words]
    return [word.replace("OUT", str(folder / "out" / out)) for word in full]


def _in_process(words: list[str]) -> tuple[int, str]:
    limit = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))  # it inherits it
    done = subprocess.run(
        [sys.executable, "-c", "from loopgate.cli.main import main; main()", *words],
        check=False,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=60,
    )
    resource.setrlimit(resource.RLIMIT_AS, limit)
    return done.returncode, done.stderr


def _here(words: list[str]) -> tuple[int, str]:
    out, err, before = io.TextIOWrapper(io.BytesIO()), io.StringIO(), sys.argv  # bytes are written to it too
    sys.argv = ["loopgate", *words]
    code: object = 0
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as ended:
        code = ended.code
    finally:
        sys.argv = before
    return int(code) if isinstance(code, int) else 0, err.getvalue()


CLI = Reader("command line", 0, ".", (), _command)
