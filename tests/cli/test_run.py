"""`loopgate run` by exit code and output."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from command import loopgate
from made_networks import dead_end_street

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
GRID = ROOT / "networks" / "grid5-priority.net.xml"


def test_a_run_prints_a_table_and_exits_with_0(tmp_path: Path) -> None:
    """Laps, throughput, deadlocks, collisions, audit: all in the table."""
    done = loopgate(
        *("run", ROOT / "networks" / "ring3.net.xml", "--routes", ROOT / "routes" / "ring3.rou.xml"),
        *("--abstraction", "segments", "--gate", "algorithm2", "--duration", "300", "-o", tmp_path / "out"),
    )
    assert done.returncode == 0, done.stderr
    for word in ("laps", "throughput", "deadlocks", "collisions", "longest wait", "audit", "clean"):
        assert word in done.stdout


def test_a_run_loads_only_what_it_needs(tmp_path: Path) -> None:
    """Half a second for numba, as much for scipy's rooms; it compiles nothing and draws nothing."""
    code = (
        "import sys\nfrom loopgate.cli.main import cli\ncli(sys.argv[1:], standalone_mode=False)\n"
        "heavy = 'numba scipy.sparse scipy.spatial scipy.optimize matplotlib altair'.split()\n"
        "print([name for name in heavy if name in sys.modules], file=sys.stderr)"
    )
    words = (
        "run",
        str(GRID),
        "--loops",
        "3",
        "--vehicles",
        "10",
        "--duration",
        "5",
        "-o",
        str(tmp_path / "out"),
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
    assert done.stderr.endswith("[]\n"), done.stderr


def test_json_is_only_json(tmp_path: Path) -> None:
    """For machines: the summary on stdout, nothing else."""
    done = loopgate(
        *("run", GRID, "--loops", "2", "--gate", "open", "--duration", "60", "--json", "-o", tmp_path / "out")
    )
    assert json.loads(done.stdout) == json.loads((tmp_path / "out" / "summary.json").read_text())


LOUD_GATE = """
import os

from loopgate.gates.open import OpenGate


class Loud(OpenGate):
    def __init__(self, system):
        print("a gate talks")
        os.write(1, b"and by the file descriptor")
        super().__init__(system)
"""


@pytest.mark.parametrize("more", [[], ["--traci"], ["--gate", "open"], ["--gate", "LOUD"]])
def test_json_is_only_json_whatever_else_is_printed(tmp_path: Path, more: list[str]) -> None:
    """SUMO talks on stdout where a configuration says so, and a gate can print: that goes to stderr."""
    (tmp_path / "loud.py").write_text(LOUD_GATE)
    (tmp_path / "t.rou.xml").write_text(
        '<routes><flow id="f" begin="0" end="50" number="3"><route edges="A0A1 A1A2 A2B2"/></flow></routes>'
    )
    (tmp_path / "beside.add.xml").write_text(
        '<additional><edgeData id="e" file="stdout" period="10"/></additional>'
    )
    said = (
        f'<net-file value="{GRID}"/><route-files value="t.rou.xml"/><verbose value="true"/>'
        '<additional-files value="beside.add.xml"/><duration-log.statistics value="true"/>'
        '<summary-output value="stdout"/><tripinfo-output value="-"/>'
    )
    config = tmp_path / "t.sumocfg"
    config.write_text(f"<configuration>{said}</configuration>")
    words = [word.replace("LOUD", str(tmp_path / "loud.py:Loud")) for word in more]
    done = loopgate("run", config, "--duration", "60", "--json", *words)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["duration_s"] == 60
    assert "<summary" in done.stderr


def test_a_run_goes_on_with_the_loops_there_are(tmp_path: Path) -> None:
    """On a street where vehicles must turn round, with fewer loops than asked for, and a warning."""
    street = dead_end_street(tmp_path / "street.net.xml")
    done = loopgate(
        *("run", street, "--loops", "40", "--length", "200:2000", "--u-turns", "--vehicles", "20"),
        *("--duration", "300", "--positions", "-o", tmp_path / "out"),
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    (warning,) = summary["warnings"]
    assert "found 8 of 40 loops" in warning
    assert warning.endswith("; there are no others; going on with these")
    assert summary["loops"] == 8
    assert f"warning: {street}: found" in done.stdout.replace("\n", "")
    assert "--u-turns" in summary["command"]
    assert summary["audit"] == "clean"
    assert summary["collisions"] == 0


def test_a_deadlock_exits_with_3(tmp_path: Path) -> None:
    """And names the circle."""
    done = loopgate(
        *("run", GRID, "--loops", "60", "--loops-seed", "2", "--vehicles", "220", "--gate", "open"),
        *("--abstraction", "segments", "--seed", "1", "--duration", "700", "-o", tmp_path / "out"),
    )
    assert done.returncode == 3, done.stderr
    assert "deadlock at" in done.stdout


def test_results_are_not_overwritten_unasked(tmp_path: Path) -> None:
    """A second run into the same folder is refused, then allowed."""
    words = ("run", GRID, "--loops", "2", "--gate", "open", "--duration", "30", "-o", tmp_path / "out")
    assert loopgate(*words).returncode == 0
    again = loopgate(*words)
    assert again.returncode == 2
    assert "--overwrite" in again.stderr
    assert loopgate(*words, "--overwrite").returncode == 0


ROUTES = {
    "broken": ('<route id="r" edges="A0B0 B0C0 C0D0"/>', "does not lead to"),
    "missing": ('<route id="r" edges="A0B0 nowhere B0A0"/>', "nowhere"),
    "unconnected": ('<route id="r" edges="A0B0 C3D3 B0A0"/>', "C3D3"),
    "too-near": (
        (
            '<vType id="hasty" tau="0.5"/><route id="r" edges="A0B0 B0B1 B1A1 A1A0"/>'
            '<vehicle id="x" type="hasty" route="r" depart="0"/>'
        ),
        "bad.rou.xml: vType hasty: tau 0.5 is below the step of 1 s",
    ),
    "one-zone": (
        (
            '<route id="r1" edges="A0B0 B0B1 B1A1 A1A0"/>'
            '<route id="r2" edges="A0B0 B0C0 C0C1 C1B1 B1A1 A1A0"/>'
            '<vehicle id="x" route="r1" depart="0" departPos="20"/>'
            '<vehicle id="y" route="r2" depart="0" departPos="60"/>'
        ),
        "zone",
    ),
}


@pytest.mark.parametrize("case", ROUTES)
def test_bad_routes_are_one_clear_line(tmp_path: Path, case: str) -> None:
    """The file, what is wrong with it, exit code 2, no traceback."""
    body, words = ROUTES[case]
    (tmp_path / "bad.rou.xml").write_text(f"<routes>{body}</routes>")
    done = loopgate(
        *("run", GRID, "--routes", tmp_path / "bad.rou.xml", "--abstraction", "segments"),
        *("--gate", "collision", "--duration", "60"),
    )
    assert done.returncode == 2, done.stdout
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("no.net.xml",), "no.net.xml"),
        (("sumo:Atlantis", "--loops", "2"), "sumo:DRT"),
        ((str(GRID),), "no loops"),
        (("sumo:fokr_bs_demo", "--loops", "2"), "turning round is the only way: allow --u-turns"),
        ((str(GRID), "--loops", "2", "--gate", "none"), "there is no such gate"),
        (
            (
                str(GRID),
                "--loops",
                "2",
                "--vehicles",
                "9",
                "--abstraction",
                "segments",
                "--gate",
                "collision",
            ),
            "one",
        ),
        ((str(GRID), "--loops", "2", "--negotiation", "luck"), "there is no such negotiation"),
        ((str(GRID), "--loops", "2", "--duration", "-5"), "duration"),
        (("no.toml",), "cannot read the scenario"),
        ((str(GRID), "--loops", "2", "-o", "out:1"), "colon"),
    ],
)
def test_bad_input_is_one_clear_line(words: tuple[str, ...], expected: str) -> None:
    """Exit code 2 and the way out."""
    done = loopgate("run", *words)
    assert done.returncode == 2, done.stdout
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr


def test_a_network_that_is_no_xml(tmp_path: Path) -> None:
    """Named as such."""
    (tmp_path / "x.net.xml").write_text("this is no XML")
    done = loopgate("run", tmp_path / "x.net.xml", "--loops", "2")
    assert done.returncode == 2
    assert "x.net.xml" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr


def test_names_go_to_a_stream_that_cannot_hold_them(tmp_path: Path) -> None:
    """A table is printed all the same, and a route file as the UTF-8 that it says it is."""
    network = tmp_path / "Łódź.net.xml"
    network.write_text(
        (ROOT / "networks" / "ring3.net.xml").read_text(encoding="utf-8").replace("p1a", "Łp1a"), "utf-8"
    )
    for words in (("run", network, "--loops", "1", "--duration", "20"), ("loops", network, "--count", "1")):
        done = subprocess.run(
            [sys.executable, "-c", "from loopgate.cli.main import main; main()", *map(str, words)],
            env=os.environ | {"PYTHONIOENCODING": "ascii"},
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    assert "Łp1a" in done.stdout.decode("utf-8")


def test_times_of_a_configuration_may_have_colons(tmp_path: Path) -> None:
    """As SUMO has it, for steps too."""
    (tmp_path / "t.rou.xml").write_text(
        '<routes><vehicle id="v" depart="0"><route edges="A0A1 A1A2"/></vehicle></routes>'
    )
    config = tmp_path / "t.sumocfg"
    for step, gate, says in (
        ("00:00:01", "certified", ""),
        ("00:00:05", "open", ""),
        ("00:00:05", "certified", "step_s is 5.0"),
    ):
        config.write_text(
            f'<configuration><net-file value="{GRID}"/><route-files value="t.rou.xml"/>'
            f'<step-length value="{step}"/><default.action-step-length value="{step}"/></configuration>'
        )
        done = loopgate("run", config, "--gate", gate, "--duration", "20")
        assert (done.returncode, says in done.stderr) == (2 if says else 0, True), done.stderr
    config.write_text(config.read_text().replace("00:00:05", "00:00:01"))
    done = loopgate("run", config, "--step-length", "0.5", "--gate", "open", "--duration", "20")
    assert "step-length 00:00:01 is not taken over: the run has 0.5" in " ".join(done.stdout.split())


LED_OFF = {
    "n.rou.xml": '<routes><flow id="f" begin="0" end="10" number="2" from="p1b" to="s1"/></routes>',
    "n.add.xml": '<additional><rerouter id="r" edges="p1b" timeThreshold="9"><interval begin="0" end="1e9">'
    '<destProbReroute id="s2"/></interval></rerouter></additional>',
}


def test_a_configuration_none_of_whose_vehicles_can_be_gated_runs(tmp_path: Path) -> None:
    """As in SUMO, with the reason; but not where a gate was asked for."""
    for name, text in LED_OFF.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    config = tmp_path / "n.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{ROOT / "networks/ring3.net.xml"}"/>'
        '<route-files value="n.rou.xml"/><additional-files value="n.add.xml"/></configuration>',
        encoding="utf-8",
    )
    done = loopgate("run", config, "--duration", "60", "--json", "-o", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["gate"], told["audit"], told["trips"]) == ("open", "not gated", 2)
    assert "--gate open" in told["command"]
    (warning,) = done.stderr.splitlines()
    assert warning.startswith(
        f"warning: {config}: none of its vehicles is gated: 2 vehicles, first f.0: rerouter r"
    )
    assert warning.endswith("; all drive by SUMO's rules, as with --gate open")
    refused = loopgate("run", config, "--duration", "60", "--gate", "certified")
    assert (refused.returncode, refused.stdout) == (2, "")


RING = '<route id="r" edges="A0A1 A1B1 B1B0 B0A0"/>'
ODD = '<vehicle id="odd" route="r" depart="0"><stop edge="A1B1" speed="9" endPos="50"/></vehicle>'


def test_stops_that_no_gate_makes_are_named_everywhere(tmp_path: Path) -> None:
    """By inspect, and by a run without a gate, in whose figures these vehicles are not."""
    file = tmp_path / "r.rou.xml"
    file.write_text(f'<routes>{RING}{ODD}<vehicle id="v" route="r" depart="0"/></routes>')
    given = (GRID, "--routes", file)
    for told in (
        loopgate("inspect", *given),
        loopgate("run", *given, "--duration", "30", "--gate", "open"),
        loopgate("run", *given, "--duration", "30"),
    ):
        assert told.returncode == 0
        assert "odd: stop with speed '9'" in " ".join(told.stdout.split())


def test_a_file_that_no_gate_can_drive_runs_without_one(tmp_path: Path) -> None:
    """Also where its routes close: the message says that SUMO drives them, and it does."""
    file = tmp_path / "r.rou.xml"
    file.write_text(f"<routes>{RING}{ODD}</routes>")
    given = ("run", GRID, "--routes", file, "--duration", "60", "--json")
    without, asked = loopgate(*given), loopgate(*given, "--gate", "open")
    assert (without.returncode, asked.returncode) == (0, 0)
    assert "all drive by SUMO's rules" in without.stderr
    assert json.loads(asked.stdout)["vehicles"] == json.loads(without.stdout)["vehicles"] == 1
    assert loopgate(*given, "--gate", "certified").returncode == 2


def test_the_next_commands_can_be_copied(tmp_path: Path) -> None:
    """Also from a folder with a blank, or with brackets, which are no colours."""
    out = tmp_path / "a [red] run"
    ring = ROOT / "networks" / "ring3.net.xml", "--routes", ROOT / "routes" / "ring3.rou.xml"
    done = loopgate("run", *ring, "--duration", "10", "-o", out)
    assert f"results in {out}; next: loopgate report '{out}', or loopgate replay '{out}'" in done.stdout
