"""Spoil a network in every single place, and see that none on which SUMO ends by a signal is let through.

    python analysis/spoiled_networks.py --every 3

Each element of the ring is left out and repeated, each attribute left out and given other values; ``--every``
takes one in so many of these. Each is given to SUMO, which drives vehicles for a minute, in a process of its
own; and to `RoadNetwork.open` and a run in another, where a good run follows that has to be as ever. Prints
how many there are of each outcome; ends with exit code 1 if ours ends by a signal or a traceback, takes a
network on which SUMO ends by a signal, or the good run is another.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import libsumo

from loopgate import RoadNetwork, Scenario, find_loops
from loopgate.errors import LoopgateError
from loopgate.simulation.run import simulate

RING = Path(__file__).resolve().parents[1] / "networks" / "ring3.net.xml"
OTHER = ("-1", "1e9", "x", "", "1")
SECONDS = 60
_LONGEST_S = 60
_SHOWN = 200
_NAMES = {"from", "to", "via", "incLanes", "intLanes", "id"}


def spoils(text: str) -> Iterator[tuple[str, str]]:
    """Yield what was done, and the text of the network."""
    names = sorted({e.get("id", "") for e in ET.fromstring(text).iter()})  # noqa: S314  a file of this project
    for number, element in enumerate(ET.fromstring(text).iter()):  # noqa: S314  the same
        if not number:
            continue
        for times in (0, 2):
            top = ET.fromstring(text)  # noqa: S314  the same
            one = list(top.iter())[number]
            parent = next(e for e in top.iter() if one in list(e))
            at = list(parent).index(one)
            parent[at : at + 1] = [one] * times
            yield f"{element.tag} {'left out' if not times else 'twice'}", ET.tostring(top, "unicode")
        for attribute, value in element.attrib.items():
            instead = (names[1], "none", "") if attribute in _NAMES or value in names else OTHER
            for other in (None, *(one for one in instead if one != value)):
                top = ET.fromstring(text)  # noqa: S314  the same
                one = list(top.iter())[number]
                one.attrib.pop(attribute)
                if other is not None:
                    one.set(attribute, other)
                yield f"{element.tag} {attribute}={other}", ET.tostring(top, "unicode")


def apart(work: Callable[[], str]) -> str:
    """Return what work says in a process of its own, or by what signal that ends."""
    out, into = os.pipe()
    child = os.fork()
    if not child:
        os.close(out)
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        signal.alarm(_LONGEST_S)
        try:
            said = work()
        except BaseException as error:  # noqa: BLE001  to find these is the purpose
            said = f"traceback {error!r}"
        os.write(into, said.encode())
        os._exit(0)
    os.close(into)
    with os.fdopen(out, encoding="utf-8") as told:
        said = told.read()
    number = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return said if number == 0 else f"signal {-number}"


def by_sumo(file: Path, routes: Path) -> str:
    """Drive in SUMO alone; return whether it takes the network."""
    try:
        libsumo.start(["sumo", "--no-step-log", "--no-warnings", "-n", str(file), "-r", str(routes)])
        for _ in range(SECONDS):
            libsumo.simulationStep()
        libsumo.close()
    except (libsumo.TraCIException, libsumo.FatalTraCIError):
        return "refused"
    return "taken"


def by_us(file: Path, alone: str) -> str:
    """Read and run; then run the good network, which has to be as it is alone."""
    try:
        RoadNetwork.open(file)
    except LoopgateError:
        return "refused on reading"
    said = "run"
    try:
        figures(file)
    except LoopgateError as error:
        said = "refused by SUMO" if "SUMO" in str(error) else "refused before SUMO"
    return said if figures(RING) == alone else f"{said}, and the next run is another"


def figures(network: Path) -> str:
    """Return the figures of a short run."""
    summary: dict[str, Any] = simulate(
        Scenario(network=str(network), loops=3, vehicles=6, duration_s=float(SECONDS))
    )
    volatile = ("wall_s", "decision_us", "stage_us", "command")
    return json.dumps({name: value for name, value in summary.items() if name not in volatile})


def main() -> int:
    """Spoil, drive, count."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--every", type=int, default=1, help="take one spoil in so many")
    parser.add_argument("--from", dest="first", type=int, default=0, help="begin with this one")
    given = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    bad: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        routes, file = Path(place, "r.rou.xml"), Path(place, "n.net.xml")
        loops = find_loops(RoadNetwork.open(RING), 3).loops
        ways = [" ".join((*loop.edges, loop.edges[0])) for loop in loops]
        routes.write_text(
            "<routes>"
            + "".join(
                f'<vehicle id="v{n}" depart="{2 * n}"><route edges="{ways[n % len(ways)]}"/></vehicle>'
                for n in range(9)
            )
            + "</routes>"
        )
        figures(RING)  # compiles what is not compiled yet, and SUMO may have run here before
        alone = apart(lambda: figures(RING))
        for number, (what, spoiled) in enumerate(spoils(RING.read_text(encoding="utf-8"))):
            if number < given.first or (number - given.first) % given.every:
                continue
            file.write_text(spoiled, encoding="utf-8")
            ours = apart(lambda: by_us(file, alone))
            theirs = apart(lambda: by_sumo(file, routes))
            counts[theirs, ours[:60]] += 1
            let_through = theirs.startswith("signal") and ours != "refused on reading"
            if ours.startswith(("signal", "traceback")) or "another" in ours or let_through:
                bad.append(f"no. {number}, {what}: SUMO {theirs}, loopgate {ours[:200]}")
            if not counts.total() % _SHOWN:
                print(f"  {counts.total()} spoils, {len(bad)} faults", flush=True)
    for (theirs, ours), count in sorted(counts.items()):
        print(f"{count:6d}  SUMO alone: {theirs:10}  loopgate: {ours}")
    print("\n".join(bad))
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
