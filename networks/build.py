"""Build every network in this folder from its sources, and show what differs from what is there.

``python networks/build.py`` writes the built files; with ``--check`` it writes nothing and exits with 1
if a file would change. The sources are the plain XML files in ``plain/`` (they open in netedit) and, for
the grids, the options of netgenerate below. Two builds with one version of SUMO are equal byte for byte.
"""

from __future__ import annotations

import difflib
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import sumo

HERE = Path(__file__).resolve().parent
PLAIN = HERE / "plain"
TOOLS = Path(sumo.SUMO_HOME) / "bin"

GRID = (
    "--grid",
    "--grid.number=5",
    "--grid.length=100",
    "--default.lanenumber=1",
    "--default.speed=13.89",
    "--no-turnarounds",
)
"""Five by five junctions, 100 m apart, one lane each way, no U-turns."""

GRIDS = {
    "grid5-priority": ("--default-junction-type=priority",),
    "grid5-right-before-left": ("--default-junction-type=right_before_left",),
    "grid5-all-way-stop": ("--default-junction-type=allway_stop",),
    "grid5-actuated": ("--default-junction-type=traffic_light", "--tls.default-type=actuated"),
}

MOST_LINES_SHOWN = 20


def commands() -> dict[str, list[str]]:
    """Return, by network, the command that builds it (without its output)."""
    made = {name: [str(TOOLS / "netgenerate"), *GRID, *options] for name, options in GRIDS.items()}
    for nodes in sorted(PLAIN.glob("*.nod.xml")):
        name = nodes.name.removesuffix(".nod.xml")
        made[name] = [
            str(TOOLS / "netconvert"),
            f"--node-files={nodes}",
            f"--edge-files={nodes.with_name(name + '.edg.xml')}",
            "--no-turnarounds",
        ]
    return made


def build(name: str, command: list[str]) -> str:
    """Return the text of the network `name`, without the date and the paths that SUMO puts at its head.

    Raises
    ------
    RuntimeError
        If SUMO's tool fails or warns; the text is what it said.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{name}.net.xml"
        done = subprocess.run(
            [*command, f"--output-file={file}"],
            check=False,
            capture_output=True,
            text=True,
            env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
        )
        if done.returncode != 0 or done.stderr.strip():
            msg = f"{name}: {Path(command[0]).name} says: {done.stderr.strip() or done.stdout.strip()}"
            raise RuntimeError(msg)
        text = file.read_text(encoding="utf-8")
    return re.sub(r"<!--.*?-->\n*", "<!-- built by networks/build.py -->\n\n", text, count=1, flags=re.DOTALL)


def difference(name: str, text: str) -> list[str]:
    """Return the lines by which `text` differs from the network's file, as a unified diff."""
    file = HERE / f"{name}.net.xml"
    there = file.read_text(encoding="utf-8") if file.exists() else ""
    return list(
        difflib.unified_diff(there.splitlines(), text.splitlines(), "as it is", "as built", lineterm="", n=0)
    )


def main(arguments: list[str]) -> int:
    """Build all networks; return 1 if ``--check`` was asked for and a file would change."""
    check = "--check" in arguments
    changed = 0
    for name, command in commands().items():
        text = build(name, command)
        lines = difference(name, text)
        print(f"{name}.net.xml: {f'{len(lines)} lines of difference' if lines else 'no difference'}")
        for line in lines[:MOST_LINES_SHOWN]:
            print("   ", line[:120])
        changed += bool(lines)
        if lines and not check:
            (HERE / f"{name}.net.xml").write_text(text, encoding="utf-8")
    return int(check and changed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
