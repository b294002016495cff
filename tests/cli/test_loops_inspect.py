"""`loopgate loops` and `loopgate inspect`, by exit code and output."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import sumo
from click.testing import CliRunner
from command import loopgate

from loopgate.abstraction.queue_layout import why_not
from loopgate.cli.main import cli
from loopgate.model import read_system
from loopgate.network import RoadNetwork, VehicleType, read_loops

_RUN = CliRunner()
_NET = "sumo:bs3d"
_SEGMENTS = ("--abstraction", "segments")


def in_a_process(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    command = [sys.executable, "-c", "from loopgate.cli.main import main; main()", *map(str, arguments)]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=120)


@pytest.fixture(scope="module")
def routes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("routes") / "loops.rou.xml"
    assert _RUN.invoke(cli, ["loops", _NET, "--count", "4", "-o", str(file)]).exit_code == 0
    return file


def test_the_same_seed_writes_the_same_bytes(routes: Path, tmp_path: Path) -> None:
    """In another process, with other hash seeds."""
    again = tmp_path / "again.rou.xml"
    done = in_a_process("loops", _NET, "--count", "4", "-o", again)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("4 loops, ")
    assert again.read_bytes() == routes.read_bytes()
    other = _RUN.invoke(cli, ["loops", _NET, "--count", "4", "--seed", "2"])
    assert other.stdout != routes.read_text(encoding="utf-8")


def test_loops_go_to_standard_output_without_a_file(routes: Path) -> None:
    """What would be in the file, and nothing else."""
    assert _RUN.invoke(cli, ["loops", _NET, "--count", "4"]).stdout == routes.read_text(encoding="utf-8")


def test_loops_as_json() -> None:
    """Ids, lengths and edges."""
    result = _RUN.invoke(cli, ["loops", _NET, "--count", "3", "--length", "500:900", "--json"])
    found = json.loads(result.stdout)["loops"]
    assert [loop["id"] for loop in found] == ["loop0", "loop1", "loop2"]
    assert all(500 <= loop["length_m"] <= 900 for loop in found)


def test_fewer_loops_than_asked_for(tmp_path: Path) -> None:
    """Those that there are, and a warning: on stderr, and in the JSON."""
    words = ["loops", "sumo:grid6", "--length", "100:5000", "-o", str(tmp_path / "few.rou.xml")]
    result = _RUN.invoke(cli, words)
    assert result.exit_code == 0
    assert result.stdout.startswith("3 loops, ")
    warning = "sumo:grid6: found 3 of 12 loops of 100 to 5000 m for passenger (seed 1); there are no others"
    assert result.stderr == f"warning: {warning}; for more widen --length\n"
    found = json.loads(_RUN.invoke(cli, [*words, "--json"]).stdout)
    assert (len(found["loops"]), found["warnings"]) == (3, [warning])


def test_loops_of_a_class_over_some_streets_and_around_others(routes: Path, tmp_path: Path) -> None:
    """The file says of what class the vehicles are; streets go by name or by a file of names."""
    loops = {loop.id: loop.edges for loop in read_loops(RoadNetwork.open(_NET), routes).loops}
    over = loops["loop0"][0]
    closed = tmp_path / "closed.txt"
    closed.write_text("\n".join(f"edge:{edge}" for edge in loops["loop1"] if edge not in loops["loop0"]))
    file = tmp_path / "taxi.rou.xml"
    options = ["--count", "2", "--vclass", "taxi", "--via", over, "--avoid", str(closed), "-o", str(file)]
    assert _RUN.invoke(cli, ["loops", _NET, *options]).exit_code == 0
    made = read_loops(RoadNetwork.open(_NET), file)
    assert [vehicle.type.vclass for vehicle in made.vehicles] == ["taxi", "taxi"]
    assert all(over in loop.edges for loop in made.loops)
    assert all(set(closed.read_text().replace("edge:", "").split()).isdisjoint(x.edges) for x in made.loops)


def test_sumo_drives_the_loops(routes: Path, tmp_path: Path) -> None:
    """SUMO itself takes the file: vehicles on every loop, twice round, nothing to complain about."""
    import sumo  # noqa: PLC0415  only this test needs SUMO's own program

    from loopgate.network import RoadNetwork, read_loops  # noqa: PLC0415

    network = RoadNetwork.open(_NET)
    vehicles = tmp_path / "vehicles.rou.xml"
    entries = []
    for loop in read_loops(network, routes).loops:
        twice = " ".join((*loop.edges * 2, loop.edges[0]))
        entries.append(f'<vehicle id="{loop.id}" depart="0"><route edges="{twice}"/></vehicle>')
    vehicles.write_text(f"<routes>{''.join(entries)}</routes>", encoding="utf-8")
    options = [
        "-n",
        network.file,
        "-r",
        f"{routes},{vehicles}",
        "--end",
        "5",
        "--no-step-log",
        "--tls.all-off",
    ]
    done = subprocess.run(
        [Path(sumo.SUMO_HOME) / "bin" / "sumo", *map(str, options)],
        check=False,
        capture_output=True,
        text=True,
    )
    complaints = [line for line in done.stderr.splitlines() if "green phase" not in line]  # the network's own
    assert (done.returncode, complaints) == (0, [])


def test_inspect_shows_and_writes(routes: Path, tmp_path: Path) -> None:
    """Tables on stdout, a picture, and a system file that reads back with the same states."""
    picture, system = tmp_path / "map.png", tmp_path / "system.json"
    result = _RUN.invoke(
        cli,
        ["inspect", _NET, "--routes", str(routes), *_SEGMENTS, "--plot", str(picture), "-o", str(system)],
    )
    assert result.exit_code == 0, result.output
    assert "4 loops" in result.stdout
    assert "lie in zones that loops share" in result.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 50_000
    assert [robot.id for robot in read_system(system).robots] == ["loop0", "loop1", "loop2", "loop3"]


def test_inspect_as_json(routes: Path) -> None:
    """Only JSON; shares agree with legs and zones; a greater radius shares more."""
    shares = []
    for rho in ("0.5", "1.25", "5"):
        result = _RUN.invoke(
            cli, ["inspect", _NET, "--routes", str(routes), *_SEGMENTS, "--rho", rho, "--json"]
        )
        found = json.loads(result.stdout)
        zones = {zone["id"] for zone in found["zones"]}
        for loop in found["loops"]:
            metres = sum(leg["end_m"] - leg["begin_m"] for leg in loop["legs"] if leg["state"] in zones)
            assert metres == pytest.approx(loop["shared_m"], abs=0.2)
        assert sum(zone["length_m"] for zone in found["zones"]) == pytest.approx(
            sum(loop["shared_m"] for loop in found["loops"]), abs=0.2
        )
        shares.append(found["shared"])
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[2] <= 1.0


NETWORKS = Path(__file__).resolve().parents[2]
RING = ["inspect", f"{NETWORKS}/networks/ring3.net.xml", "--routes", f"{NETWORKS}/routes/ring3.rou.xml"]


def test_inspect_queues(tmp_path: Path) -> None:
    """What works and how much room there is; a picture; a system file."""
    picture, system = tmp_path / "queues.svg", tmp_path / "system.json"
    shown = _RUN.invoke(cli, [*RING, "--picture", str(picture), "-o", str(system)])
    assert shown.exit_code == 0, shown.output
    for text in (
        "12 places for 150 vehicles",
        "18 crossings with 6 conflicts",
        "3 lanes too short to queue on",
    ):
        assert text in shown.stdout
    assert shown.stdout.startswith("3 loops that work")
    assert "\u2503" not in shown.stdout
    assert "133 vehicles can start on these loops" in shown.stdout
    assert "115 if they are dealt to the loops in turn" in shown.stdout
    assert "(unlisted)" not in shown.stdout
    assert picture.read_text(encoding="utf-8").count("<svg") == 1
    assert len(read_system(system).robots) == 3


def test_inspect_queues_as_json() -> None:
    """All of it, checked against the rules of the abstraction and against itself."""
    found = json.loads(_RUN.invoke(cli, [*RING, "--json"]).stdout)
    assert found["refused"] == []
    for place in found["places"]:
        assert place["capacity"] == (place["length_m"] - 1.1) // 7.5
        assert 1 <= place["at_start"] < place["capacity"]
    visited = {leg["place"] for loop in found["loops"] for leg in loop["legs"]}
    assert visited == {place["id"] for place in found["places"]}
    crossings = {crossing["id"]: crossing for crossing in found["crossings"]}
    for name, crossing in crossings.items():
        for conflict in crossing["conflicts"]:
            assert conflict["begin_m"] <= crossing["length_m"]
            assert name in {back["with"] for back in crossings[conflict["with"]]["conflicts"]}
    assert {lane["lane"] for lane in found["joined_lanes"]}.isdisjoint(visited)
    assert found["holds"] == sum(place["capacity"] for place in found["places"])


@pytest.fixture(scope="module")
def some_refused(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve loops in south-east Berlin, some of which have no room for vehicles of 45 m."""
    file = tmp_path_factory.mktemp("berlin") / "loops.rou.xml"
    assert _RUN.invoke(cli, ["loops", "sumo:DRT", "--count", "12", "-o", str(file)]).exit_code == 0
    return file


def test_inspect_shows_every_loop_that_cannot_work_and_the_rest(some_refused: Path, tmp_path: Path) -> None:
    """Each with its edge and the reason; the others in full; one line on stderr, exit code 2."""
    picture = tmp_path / "map.png"
    long = ("--vehicle-length", "45")
    done = loopgate("inspect", "sumo:DRT", "--routes", some_refused, *long, "--json", "--picture", picture)
    assert done.returncode == 2
    found = json.loads(done.stdout)
    refused = {entry["loop"] for entry in found["refused"]}
    kept = {loop["id"] for loop in found["loops"]}
    assert len(refused) + len(kept) == 12
    assert refused
    assert kept
    assert not refused & kept
    network = RoadNetwork.open("sumo:DRT")
    loops = {loop.id: loop for loop in read_loops(network, some_refused).loops}
    kind = VehicleType(length_m=45.0)
    for entry in found["refused"]:
        alone = why_not(network, loops[entry["loop"]], kind)
        # Beside others a loop can have less room than by itself.
        assert (entry["reason"], entry["edge"]) == alone or (
            not alone and "fewer than two places" in entry["reason"]
        )
        assert entry["edge"] is None or entry["edge"] in loops[entry["loop"]].edges
        assert (entry["edge"] or "") in entry["reason"]
    assert all(not why_not(network, loops[name], kind) for name in kept)
    assert done.stderr.count("\n") == 1
    assert f"{len(refused)} of 12 loops cannot work as queues" in done.stderr
    assert picture.stat().st_size > 30_000


def test_vehicles_of_the_file_decide_what_fits(routes: Path, tmp_path: Path) -> None:
    """A bus of 18 m needs longer states than a car, and so the zones grow."""
    text = routes.read_text(encoding="utf-8")
    long = tmp_path / "bus.rou.xml"
    bus = '<vType id="bus" length="18"/><vehicle id="b" type="bus" route="loop0" depart="0"/></routes>'
    long.write_text(text.replace("</routes>", bus), encoding="utf-8")
    result = _RUN.invoke(cli, ["inspect", _NET, "--routes", str(long), *_SEGMENTS, "--json"])
    assert [loop["id"] for loop in json.loads(result.stdout)["loops"]] == ["loop0"]
    short = min(
        leg["end_m"] - leg["begin_m"] for loop in json.loads(result.stdout)["loops"] for leg in loop["legs"]
    )
    assert short >= 18 + 2.5


@pytest.mark.parametrize(("option", "name"), [("--plot", "x.png"), ("--plot", "x.what"), ("-o", "x.json")])
def test_files_that_cannot_be_written(routes: Path, tmp_path: Path, option: str, name: str) -> None:
    """A file where a folder should be, or a picture of no known kind: one line, exit code 2."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    folder = tmp_path if name == "x.what" else tmp_path / "file"
    done = loopgate("inspect", _NET, "--routes", routes, *_SEGMENTS, option, folder / name)
    assert done.returncode == 2
    assert "cannot write" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["loops", "sumo:nowhere"], "sumo:nowhere: no such network in the SUMO package; there are sumo:"),
        (["loops", "sumo:square"], "found 0 of 12 loops .*; widen --length, or allow --u-turns"),
        (["loops", _NET, "--length", "9"], "'9' is no range of lengths"),
        (["loops", _NET, "--length", "900:400"], "expected 0 < shortest <= longest"),
        (["loops", _NET, "--max-shared", "2"], "2.0 is not in the range"),
        (["inspect", _NET], "no loops are given; give --routes FILE"),
        (["inspect", "missing.net.xml", "--routes", "x"], "missing.net.xml: there is no such file"),
        (["inspect", _NET, "--routes", "missing.rou.xml"], "missing.rou.xml: there is no such file"),
        (
            ["inspect", _NET, "--routes", "x", "--rho", "2"],
            "--rho and --piece belong to --abstraction segments",
        ),
        (["inspect", _NET, "--routes", "x", "--vehicle-length", "-3"], "--vehicle-length is -3 m"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], text: str) -> None:
    """Exit code 2, one clear line on stderr, nothing on stdout, no traceback."""
    done = loopgate(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert re.search(text, done.stderr), done.stderr
    assert "Traceback" not in done.stderr
    assert len([line for line in done.stderr.splitlines() if line.startswith(("loopgate:", "Error:"))]) == 1


@pytest.mark.parametrize(
    ("routes_text", "text"),
    [
        ('<route id="r" edges="{e0} {e1}"/>', "route r: not a loop: its last edge"),
        ('<route id="r" edges="{e0} nowhere"/>', "route r: edge nowhere is not in the network sumo:bs3d"),
        ('<route id="r" edges="{bus}"/>', "route r: edge {bus} is closed to passenger"),
        (
            (
                '<vehicle id="v" depart="0" departPos="{in0}"><route edges="{loop0}"/></vehicle>'
                '<vehicle id="w" depart="0" departPos="{in0}"><route edges="{loop0}"/></vehicle>'
            ),
            "vehicles v and w both start in zone1, which holds one",
        ),
        ("<route", "not XML"),
    ],
)
def test_routes_drawn_wrong(routes: Path, tmp_path: Path, routes_text: str, text: str) -> None:
    """Each mistake of a hand-drawn route file: one line, exit code 2."""
    from loopgate.network import RoadNetwork, read_loops  # noqa: PLC0415

    network = RoadNetwork.open(_NET)
    loop = read_loops(network, routes).loops[0]
    names = {
        "e0": loop.edges[0],
        "e1": loop.edges[1],
        "bus": next(edge.id for edge in network.edges.values() if not edge.allows("passenger")),
        "loop0": " ".join(loop.edges),
        "in0": "6",
    }
    file = tmp_path / "drawn.rou.xml"
    file.write_text(f"<routes>{routes_text.format(**names)}</routes>", encoding="utf-8")
    done = loopgate("inspect", _NET, "--routes", file, *_SEGMENTS)
    assert done.returncode == 2
    assert text.format(**names) in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_an_ordinary_sumo_configuration(routes: Path, tmp_path: Path) -> None:
    """A .sumocfg names network and routes."""
    from loopgate.network import packaged_networks  # noqa: PLC0415

    config = tmp_path / "x.sumocfg"
    config.write_text(
        f'<configuration><input><net-file value="{packaged_networks()["bs3d"]}"/>'
        f'<route-files value="{routes}"/></input></configuration>',
        encoding="utf-8",
    )
    result = _RUN.invoke(cli, ["inspect", str(config), *_SEGMENTS, "--json"])
    assert len(json.loads(result.stdout)["loops"]) == 4


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("net", "routes", "abstraction"),
    [
        ("networks/grid5-priority.net.xml", "routes/grid5.rou.xml", "queues"),
        ("networks/order2.net.xml", "routes/order2.rou.xml", "segments"),
    ],
)
def test_sumo_takes_the_shapes(net: str, routes: str, abstraction: str, tmp_path: Path) -> None:
    """`--additional` of either abstraction: SUMO loads it beside the network without a word."""
    file = tmp_path / "shapes.add.xml"
    options = ["--routes", routes, "--abstraction", abstraction, "--additional", str(file), "--json"]
    assert _RUN.invoke(cli, ["inspect", net, *options]).exit_code == 0
    assert file.read_text(encoding="utf-8").count("loopgate.place") > 5
    binary = Path(sumo.SUMO_HOME) / "bin" / "sumo"
    command = [str(binary), "-n", net, "-a", str(file), "--no-step-log", "--duration-log.disable", "-e", "1"]
    told = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    assert "Error" not in told.stderr
    assert "Warning" not in told.stderr


@pytest.mark.parametrize("options", [(), _SEGMENTS])
@pytest.mark.parametrize(
    ("attributes", "why"),
    [
        ('tau="0.5"', "tau 0.5 is below the step of 1 s"),
        (
            'carFollowModel="EIDM" decel="1.5"',
            "carFollowModel EIDM with decel 1.5 is too soft to stop at a line",
        ),
    ],
)
def test_inspect_refuses_the_types_that_run_does_not_gate(
    routes: Path, tmp_path: Path, attributes: str, why: str, options: tuple[str, ...]
) -> None:
    """In the same words; what can be shown is shown. On queues they drive by SUMO's rules."""
    (first, *_) = read_loops(RoadNetwork.open(_NET), routes).loops
    typed = tmp_path / "typed.rou.xml"
    typed.write_text(
        f'<routes><vType id="soft" {attributes}/><vehicle id="a" type="soft" depart="0">'
        f'<route edges="{" ".join(first.edges)}"/></vehicle></routes>',
        encoding="utf-8",
    )
    shown = _RUN.invoke(cli, ["inspect", _NET, "--routes", str(typed), *options])
    assert "1 loop" in shown.stdout
    words = ["run", _NET, "--routes", str(typed), *options, "--duration", "20", "-o", str(tmp_path / "out")]
    ran = _RUN.invoke(cli, words)
    assert f"vType soft: {why}" in str(shown.exception)
    if options:
        assert str(shown.exception) == str(ran.exception)
    else:
        assert ran.exit_code == 0
        assert f"vType soft: {why}" in " ".join(ran.stderr.split())


@pytest.fixture
def trips(tmp_path: Path) -> Path:
    """Two trips on the grid, one of which is too long for any place, and a loop."""
    file = tmp_path / "trips.rou.xml"
    file.write_text(
        '<routes><vType id="car"/><vType id="train" length="95"/>'
        '<vehicle id="round" type="car" depart="0"><route edges="B1C1 C1C2 C2B2 B2B1" repeat="9"/></vehicle>'
        '<trip id="a" type="car" depart="5" from="A0A1" to="E4D4"/>'
        '<trip id="b" type="train" depart="6" from="A0A1" to="E4D4"/></routes>',
        encoding="utf-8",
    )
    return file


def test_inspect_lists_trips_as_run_takes_them(trips: Path) -> None:
    """Who is gated, and who is not and why; what is for loops only is refused."""
    grid = f"{NETWORKS}/networks/grid5-priority.net.xml"
    done = loopgate("inspect", grid, "--routes", trips)
    assert done.returncode == 0
    assert "2 vehicles under the gate, 1 drives once" in done.stdout
    assert "1 vehicle in ordinary traffic, first b" in done.stdout
    data = json.loads(loopgate("inspect", grid, "--routes", trips, "--json").stdout)
    assert [v["id"] for v in data["vehicles"]] == ["round", "a"]
    assert data["ordinary"] == ["b"]
    refused = loopgate("inspect", grid, "--routes", trips, "-o", trips.with_name("system.json"))
    assert refused.returncode == 2
    assert "--out is for loops only" in refused.stderr


def test_lines_with_a_timetable_are_made_from_names(tmp_path: Path) -> None:
    """Two lines in one file, each over its edges, with their stops beside; what lacks its partner is told."""
    network = Path(__file__).parents[2] / "networks/grid5-priority.net.xml"
    out = tmp_path / "lines.rou.xml"
    words = ["loops", str(network), "--via", "B2C2,D1D0", "--via", "C0C1,A2A3", "--stops", "B2C2"]
    made = _RUN.invoke(cli, [*words, "--every", "5min", "--first", "9:30", "-o", str(out)])
    assert made.exit_code == 0
    assert f"--stops {tmp_path / 'lines.add.xml'} --move-stops --begin 9:30:00" in made.output
    first, second = (edges.split() for edges in re.findall(r'edges="([^"]+)"', out.read_text("utf-8")))
    assert {"B2C2", "D1D0"} <= set(first)
    assert {"C0C1", "A2A3"} <= set(second)
    alone = _RUN.invoke(cli, words)
    assert (alone.exit_code, "--stops belongs to --every" in alone.output) == (2, True)


@pytest.mark.parametrize(
    ("stops", "says"),
    [
        (("B0B1",), "vehicle u: the stop at B0B1_0 is on edge B0B1, which is not on route u"),
        (("A1A2", "A0A1"), "vehicle u: on its route the stop at A0A1_0 lies behind the stop written before"),
    ],
)
def test_inspect_and_run_refuse_the_same_stops(tmp_path: Path, stops: tuple[str, ...], says: str) -> None:
    """In the same line; SUMO would not start with them."""
    file = tmp_path / "t.rou.xml"
    inner = "".join(f'<stop lane="{edge}_0" endPos="40" duration="5"/>' for edge in stops)
    file.write_text(
        f'<routes><vehicle id="u" depart="9"><route edges="A0A1 A1A2"/>{inner}</vehicle></routes>'
    )
    lines = set()
    for command in ("inspect", "run"):
        done = loopgate(command, "networks/grid5-priority.net.xml", "--routes", str(file))
        lines.add(done.stderr)
        assert done.returncode == 2
    assert len(lines) == 1
    assert f"{file}: {says}" in lines.pop()
