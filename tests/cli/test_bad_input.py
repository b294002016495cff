"""Command lines that once ended in a traceback: one line and exit code 2, before anything runs."""

from pathlib import Path

import pytest

from loopgate.cli import main as command

ROOT = Path(__file__).parents[2]
RING = str(ROOT / "networks" / "ring3.net.xml")
GRID = str(ROOT / "networks" / "grid5-priority.net.xml")
LOOPS = str(ROOT / "routes" / "ring3.rou.xml")
LONG = "x" * 300


def refused(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *words: str) -> str:
    """Return the line with which a command line is refused."""
    monkeypatch.setattr("sys.argv", ["loopgate", *words])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2
    lines = [li for li in capsys.readouterr().err.splitlines() if li.startswith(("loopgate: ", "Error: "))]
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--duration", "inf"], "duration_s is inf; expected a number from 1 to 1e+08"),
        (["--duration", "1e308"], "duration_s is 1e+308"),
        (["--warmup", "nan"], "warmup_s is nan"),
        (["--step-length", "1e9"], "step_s is 1000000000.0; expected a number from 0.01 to 10"),
        (
            ["--vehicles", "999999999999999999999"],
            "vehicles is 999999999999999999999; expected a whole number",
        ),
        (["--seed", "-1"], "seed is -1"),
        (["--length", "5:inf"], "loop_length_m is '5:inf'"),
        (["--gate", "certifed"], "gate certifed: there is no such gate; installed are algorithm2"),
        (["--gate", "certified:budget=nan"], "budget is nan; expected a finite number"),
        (["--gate", "certified:budget=9e99"], "budget is 9e+99"),
        (["--gate", "certified:patience=long"], "patience is 'long'; expected a whole number"),
        (["--gate", "open:"], "is no option"),
        (["--negotiation", "pressure:patience=inf"], "patience is inf; expected a finite number"),
        (["--negotiation", "luck"], "negotiation luck: there is no such negotiation"),
        (["-o", LONG], "File name too long"),
    ],
)
def test_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words: list[str], says: str
) -> None:
    """Numbers, names and options of gate and negotiation, and the run folder."""
    assert says in refused(capsys, monkeypatch, "run", RING, "--routes", LOOPS, *words)


@pytest.mark.parametrize(
    "words",
    [
        ["loops", RING, "--max-shared", "nan"],
        ["loops", RING, "--rho", "inf"],
        ["loops", RING, "--length", "5:inf"],
        ["loops", RING, "--count", "9999999999"],
        ["loops", RING, "--count", "1", "--length", "100:900", "-o", f"{LONG}/x"],
        ["inspect", RING, "--routes", LOOPS, "--vehicle-length", "nan"],
        ["inspect", RING, "--routes", LOOPS, "--abstraction", "segments", "--rho", "nan"],
        ["inspect", RING, "--routes", LONG],
        ["study", "explore", LONG],
        ["study", "explore", "s.json", "--memory-gb", "nan"],
        ["study", "montecarlo", "s.json", "--rounds", "0"],
        ["study", "check-certificate", LONG],
        ["report", LONG],
        ["sweep", LONG],
    ],
)
def test_other_commands(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    """Numbers that are none or without bounds, and names that no file has."""
    refused(capsys, monkeypatch, *words)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ('gate = ["certified", "certifed"]', "gate certifed: there is no such gate"),
        ('gate = ["certified:budgt=5"]', "unknown option 'budgt'; its options are promise"),
        ('negotiation = ["presure"]', "negotiation presure: there is no such negotiation"),
        ('negotiation = ["pressure:patience=0"]', "expected a share, and a time above 0"),
        ("vehicels = [5]", "unknown key 'vehicels'"),
        ("vehicles = [5, -5]", "vehicles is -5"),
    ],
)
@pytest.mark.parametrize("more", [["--dry-run"], []])
def test_sweeps(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    line: str,
    says: str,
    more: list[str],
) -> None:
    """Misspelt keys, gates, negotiations and their options: the file is named and no run begins."""
    (tmp_path / "s.toml").write_text(f'[base]\nnetwork = "{RING}"\n[grid]\n{line}\n')
    monkeypatch.chdir(tmp_path)
    text = refused(capsys, monkeypatch, "sweep", "s.toml", *more)
    assert text.startswith("loopgate: s.toml: ")
    assert says in text
    assert not (tmp_path / "out").exists()


def test_plans_for_folders_that_cannot_be(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A plan looks for rows in the results' folder; where none can be, the sweep itself says so."""
    (tmp_path / "s.toml").write_text(f'[base]\nnetwork = "{RING}"\nloops = 2\n')
    monkeypatch.setattr("sys.argv", ["loopgate", "sweep", str(tmp_path / "s.toml"), "--dry-run", "-o", LONG])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code in {0, None}
    assert "too long" in refused(capsys, monkeypatch, "sweep", str(tmp_path / "s.toml"), "-o", LONG)


def test_a_page_that_is_a_folder(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A report needs the name of a page."""
    (tmp_path / "rows").mkdir()
    assert "expected the name of a page" in refused(capsys, monkeypatch, "report", str(tmp_path), "-o", ".")


@pytest.mark.sumo
@pytest.mark.spoils_libsumo
def test_traffic_that_stops_sumo(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """SUMO reads some of it while it runs, and what it says then is the line."""
    (tmp_path / "t.rou.xml").write_text(
        '<routes><trip id="a" depart="0" from="p1b" to="s1"/>'
        '<flow id="c" begin="-1" end="60" period="10" from="p3b" to="s3"/></routes>'
    )
    words = ["run", RING, "--routes", LOOPS, "--duration", "5", "--traffic", str(tmp_path / "t.rou.xml")]
    assert "flow 'c'" in refused(capsys, monkeypatch, *words)


def test_certificates_that_are_none(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Lists in lists in lists, and numbers of five thousand digits."""
    for text in ("", "[" * 100_000, "9" * 5000, '{"system": 5}', '{"kind": "home"}', "\x00"):
        (tmp_path / "c.jsonl").write_text(text)
        assert "c.jsonl" in refused(
            capsys, monkeypatch, "study", "check-certificate", str(tmp_path / "c.jsonl")
        )


@pytest.mark.parametrize(
    "words",
    [
        ["run", RING, "--routes", LOOPS, "-o", "out\udcff"],
        ["report", "out", "-o", "r\udcff.html"],
        ["replay", "out\udcff"],
    ],
)
def test_names_that_are_no_utf_8(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    """Neither SUMO nor a page can hold them."""
    assert "no UTF-8, so neither SUMO nor a page" in refused(capsys, monkeypatch, *words)


@pytest.mark.parametrize(
    ("inner", "says"),
    [
        ('<include href="' + LONG + '"/>', "and there is no such file; correct href"),
        ("<routes>" * 5000 + "</routes>" * 5000, "elements are nested more than 50 deep"),
        (
            '<vehicle id="v" depart="0">' + "<param>" * 5000 + "</param>" * 5000 + "</vehicle>",
            "elements are nested more than 50 deep",
        ),
    ],
)
@pytest.mark.parametrize("option", [["--routes"], ["--loops", "1", "--traffic"]])
def test_route_files_that_no_reader_takes(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    inner: str,
    says: str,
    option: list[str],
) -> None:
    """Names longer than a file can have, elements within elements without end."""
    file = tmp_path / "r.rou.xml"
    file.write_text(f"<routes>{inner}</routes>")
    assert says in refused(capsys, monkeypatch, "run", RING, *option, str(file))


def test_what_is_refused_leaves_no_folder(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Nor a part of its tables; a folder that was there before stays."""
    made, there = tmp_path / "made", tmp_path / "there"
    there.mkdir()
    for folder in (made, there):
        said = refused(capsys, monkeypatch, "run", RING, "--routes", "none.rou.xml", "-o", str(folder))
        assert "none.rou.xml" in said
    trace = tmp_path / "fcd.xml"
    frames = "".join(f'<timestep time="{time}.00"/>' for time in range(5))
    trace.write_text(f'<fcd-export>{frames}<timestep time="x"/></fcd-export>', encoding="utf-8")
    assert "fcd.xml" in refused(capsys, monkeypatch, "read-fcd", str(trace), RING, "-o", str(made))
    assert sorted(one.name for one in tmp_path.iterdir()) == ["fcd.xml", "there"]
    assert not list(there.iterdir())


ALONE = '<vehicle {} depart="7"><route edges="A0A1 A1A2"/></vehicle>'


@pytest.mark.parametrize("verb", ["run", "inspect"])
@pytest.mark.parametrize(
    ("inside", "says"),
    [
        (2 * ALONE.format('id="q"'), "x.rou.xml: vehicle q: the id is used twice"),
        (ALONE.format(""), "x.rou.xml: a <vehicle depart='7'> has no id"),
        (
            ALONE.format('id="&lt;script&gt;"'),
            "vehicle '<script>': SUMO allows no '<' in the id of a vehicle",
        ),
        (ALONE.format('id="q" color="notacolor"'), "vehicle q: color is 'notacolor'"),
        (2 * '<trip id="t" depart="5" from="A0A1" to="A1A2"/>', "x.rou.xml: trip t: the id is used twice"),
        (
            '<flow id="f" begin="5" end="50" probability="1" from="A0A1" to="A1A2"/>'
            + ALONE.format('id="f.1"'),
            "x.rou.xml: two vehicles are called f.1; rename one",
        ),
    ],
)
def test_vehicles_that_sumo_refuses(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    verb: str,
    inside: str,
    says: str,
) -> None:
    """One line with file and element, from `inspect` too."""
    (tmp_path / "x.rou.xml").write_text(f"<routes>{inside}</routes>", encoding="utf-8")
    assert says in refused(capsys, monkeypatch, verb, GRID, "--routes", str(tmp_path / "x.rou.xml"))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--vehicles", "5"], "no loops for --vehicles; leave it away"),
        (["--on-loops", "v=1"], "no loops for --on-loops; leave it away"),
        (["--types", "bus=1", "--vehicles", "5"], "no loops for --vehicles and --types; leave them away"),
    ],
)
def test_numbers_for_loops_beside_trips(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    words: list[str],
    says: str,
) -> None:
    """The way out, once, and not a line for each trip."""
    trips = "".join(f'<trip id="t{k}" depart="{k}" from="A0A1" to="A1A2"/>' for k in range(3))
    for inside in (trips, ALONE.format('id="q"')):
        (tmp_path / "x.rou.xml").write_text(f"<routes>{inside}</routes>", encoding="utf-8")
        line = refused(capsys, monkeypatch, "run", GRID, "--routes", str(tmp_path / "x.rou.xml"), *words)
        assert "x.rou.xml: its vehicles drive their routes once" in line
        assert says in line


def test_inspect_names_the_step_of_a_configuration(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """With its file."""
    alone = ALONE.format('id="q"')
    (tmp_path / "x.rou.xml").write_text(f"<routes>{alone}</routes>", encoding="utf-8")
    config = tmp_path / "x.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{Path(GRID).resolve()}"/><route-files value="x.rou.xml"/>'
        '<step-length value="2"/></configuration>',
        encoding="utf-8",
    )
    assert "x.sumocfg: step-length: step_s is 2.0" in refused(capsys, monkeypatch, "inspect", str(config))
