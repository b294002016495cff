"""The report on results of every kind: what it says, and that it needs nothing else."""

import csv
import html
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from loopgate.analysis import add_series
from loopgate.errors import ResultsError
from loopgate.plots import figure_svg
from loopgate.plots.charts import Chart, figure_spec
from loopgate.report.content import Section, network_sections
from loopgate.report.page import library, write_report
from loopgate.report.tables import write_csv
from loopgate.results.table_reading import plain
from loopgate.runs.results import Results, read_results
from loopgate.sweep.task import load_runner

Make = Callable[..., Results]
Full = tuple[Results, Path]

FULL = {"vehicles": [10, 40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3]}


class Page(HTMLParser):
    """What a page refers to, its ids, its text, and whether its tags close."""

    VOID = frozenset({"meta", "link", "br", "input", "img"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note references and ids."""
        self.open += [] if tag in self.VOID else [tag]
        for name, value in attrs:
            if name in {"src", "href", "xlink:href"}:
                self.references.append(value or "")
            if name == "id":
                self.ids.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        """Close the innermost tag, which must be this one."""
        assert self.open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note references and ids of a tag that closes itself."""
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_data(self, data: str) -> None:
        """Collect the text."""
        self.words.append(data)

    @property
    def text(self) -> str:
        """The page's words."""
        return " ".join(" ".join(self.words).split())


def page(results: Results, folder: Path) -> Page:
    write_report(results, folder / "r.html")
    return parse(folder)


def parse(folder: Path) -> Page:
    parsed = Page((folder / "r.html").read_text(encoding="utf-8"))
    assert not parsed.open
    return parsed


@pytest.fixture(scope="module")
def section(full: Full) -> Section:
    """Return what the report on these results shows."""
    [only] = network_sections(full[0])
    return only


def test_the_page_needs_nothing_but_itself(full: Full) -> None:
    """Every reference stays on the page or is data; no style or script comes from elsewhere."""
    _, folder = full
    parsed = parse(folder)
    assert {ref.split(":")[0] if not ref.startswith("#") else "#" for ref in parsed.references} == {
        "#",
        "data",
    }
    text = (folder / "r.html").read_text(encoding="utf-8").replace(library(), "")
    assert not re.search(r"@import|url\((?!#)|<script src|<img", text)
    policy = re.search(r'content="(default-src [^"]+)"', text)
    assert policy is not None
    assert policy[1].startswith("default-src 'none'; style-src 'sha256-")
    assert "unsafe-inline" not in policy[1]
    assert " style=" not in text
    assert "unsafe-eval" not in policy[1]


def test_every_reference_on_the_page_leads_somewhere_and_ids_are_unique(full: Full) -> None:
    """Of several networks too: names of figures must not take each other's place."""
    _, folder = full
    parsed = parse(folder)
    assert len(parsed.ids) == len(set(parsed.ids))
    text = (folder / "r.html").read_text(encoding="utf-8").replace(library(), "")
    wanted = {ref[1:] for ref in parsed.references if ref.startswith("#")}
    wanted |= set(re.findall(r"url\(#([^)]+)\)", text))
    assert wanted <= set(parsed.ids)


def test_the_headline_is_made_from_the_figures(full: Full, section: Section) -> None:
    """The fake gate drives a quarter more and never locks up; open does in all runs with 80 vehicles."""
    results, folder = full
    text = parse(folder).text
    runs = results.runs
    best = runs[(runs["gate"] == "certified") & (runs["vehicles"] == 80)]["km_per_h"].mean()
    said = f"{best:,.0f}".replace(",", " ")
    assert f"vehicles drive most with loopgate: {said} vehicle-km/h with 80 vehicles. That is " in text
    assert "The capacity was not reached with loopgate: more than 80 vehicles were not tried." in text
    assert "loopgate in 0 of 9 (95 % interval 0 to 30 %)" in text
    assert "SUMO's rules in 3 of 9 (95 % interval" in text
    assert "from 80 vehicles on" in text
    assert "Runs that stopped at their deadlock: SUMO's rules in 3, with " in text
    mark = "3 of 18 runs stopped at their deadlock"
    assert all(mark in figure.caption for figure in section.figures)
    assert all(mark in table.title for table in section.tables)
    assert "18 runs, none failed." in text


def test_figures_and_tables_are_files_too(full: Full, section: Section) -> None:
    """SVG and PNG of each figure, CSV with all digits and LaTeX of each table."""
    results, folder = full
    files = folder / "r-files"
    names = {file.name for file in files.iterdir()}
    for figure in (
        *("throughput", "speed", "standing", "fundamental-diagram", "speed-density", "paired"),
        *("deadlock-rate", "survival", "laps", "map", "decision-time", "revisits", "idleness"),
        *("worst-idleness", "idleness-map", "junctions", "streets"),
    ):
        assert {f"{figure}.svg", f"{figure}.png"} <= names
    assert len([name for name in names if name.endswith(".csv")]) == len(section.tables) + 1
    table = pd.read_csv(files / "throughput.csv")
    first = results.runs[(results.runs["gate"] == "open") & (results.runs["vehicles"] == 10)]
    assert table.loc[0, "mean"] == pytest.approx(first["km_per_h"].mean())
    latex = (files / "deadlocks.tex").read_text(encoding="utf-8")
    assert r"\toprule" in latex
    assert r"SUMO's rules & 80 & 3 & 3 & 100.0 \% (44 to 100 \%) \\" in latex
    latex = (files / "fundamental.tex").read_text(encoding="utf-8")
    assert "series & vehicles & density [veh/km] & flow [veh/h] & mean speed [km/h]" in latex
    latex = (files / "throughput.tex").read_text(encoding="utf-8")
    assert "series & vehicles & runs & throughput [veh km/h]" in latex
    assert re.search(r"loopgate & 40 & 3 & [\d~.]+ \$\\pm\$ [\d~.]+ ", latex)
    assert not re.search(
        r"nan|None|<NA>|& *(&|\\\\)", "".join(f.read_text("utf-8") for f in files.glob("*.tex"))
    )


def test_the_same_results_give_the_same_figures(full: Full, section: Section) -> None:
    """Figures carry no date and no random ids."""
    _, folder = full
    assert {file.stem for file in (folder / "r-files").glob("*.svg")} == {f.name for f in section.figures}
    for figure in section.figures:
        file = folder / "r-files" / f"{figure.name}.svg"
        assert file.read_text(encoding="utf-8") == figure_svg(figure.figure), figure.name


def test_an_empty_results_folder(tmp_path: Path) -> None:
    """A sweep that has only begun: the page says so and how to go on."""
    (tmp_path / "rows").mkdir()
    (tmp_path / "sweep.json").write_text('{"name": "s", "runs": 35, "command": "loopgate sweep s.toml"}')
    made = write_report(read_results(tmp_path), tmp_path / "r.html")
    text = Page(made.page.read_text(encoding="utf-8")).text
    assert "There are no runs yet, of 35 planned." in text
    assert "loopgate sweep s.toml" in text
    assert made.files is None


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (".", "a folder; expected the name of a page"),
        ("r.pdf", "the page is HTML; .* --pdf .* prints it"),
    ],
)
def test_what_is_no_page_is_refused_before_anything_is_drawn(tmp_path: Path, name: str, told: str) -> None:
    """Figures take a minute; and a PDF that holds HTML opens nowhere."""
    (tmp_path / "rows").mkdir()
    (tmp_path / "sweep.json").write_text('{"name": "s", "runs": 35}')
    with pytest.raises(ResultsError, match=told):
        write_report(read_results(tmp_path), tmp_path / name)
    assert not (tmp_path / name).is_file()


def test_failed_runs_only(make: Make, tmp_path: Path) -> None:
    """Reasons instead of figures."""
    text = page(make({"seed": [0, 1]}, vehicles=5, trouble="raise"), tmp_path).text
    assert "2 runs; all failed, so there is nothing to compare" in text
    assert "edge e7: no lane for passenger" in text


@pytest.mark.usefixtures("undrawn")
def test_a_single_run(make: Make, tmp_path: Path) -> None:
    """No interval is claimed, nothing is compared."""
    text = page(make({"vehicles": [40], "gate": ["certified"], "seed": [1]}), tmp_path).text
    assert "interval" not in text.partition("What must not happen")[0].partition("Runs that lock up")[0]
    assert "on the same seeds" not in text


@pytest.mark.usefixtures("undrawn")
def test_a_run_in_which_nothing_was_achieved(make: Make, tmp_path: Path) -> None:
    """No lap, no distance: no division by zero, and figures all the same."""
    assert "0 vehicle-km/h" in page(make({"vehicles": [40]}, duration_s=10), tmp_path).text


@pytest.mark.usefixtures("undrawn")
def test_partial_results_with_a_failure(make: Make, tmp_path: Path) -> None:
    """Both how many are there and how many failed."""
    results = make({"vehicles": [10], "gate": ["open", "certified"], "trouble": ["none", "raise"]})
    partial = Results(results.folders, results.runs, results.edge_sets, {**results.manifest, "runs": 9})
    text = page(partial, tmp_path).text
    assert "4 runs of 9 planned are there; 2 failed." in text


@pytest.mark.usefixtures("undrawn")
def test_failed_runs_that_left_their_vehicles_to_the_file(make: Make, tmp_path: Path) -> None:
    """How many there would have been is not known of them; the report on the others is as it would be."""
    text = page(make({"gate": ["open"]}, include=[{"vehicles": [10, 20]}]), tmp_path).text
    assert "3 runs; 1 failed." in text
    assert "more than 20 vehicles were not tried" in text


@pytest.mark.usefixtures("undrawn")
def test_rows_of_different_codes_are_pointed_out(make: Make, tmp_path: Path) -> None:
    """A package changed in the middle of a sweep makes rows that are not of one kind."""
    results = make({"vehicles": [10, 20]})
    mixed = results.runs.assign(loopgate_code=["a", "b"])
    text = page(Results(results.folders, mixed, results.edge_sets), tmp_path).text
    assert "made by 2 different codes of loopgate" in text


@pytest.mark.usefixtures("undrawn")
def test_whatever_varies_besides_becomes_a_series(make: Make, tmp_path: Path) -> None:
    """A scenario key of the user's own tells series apart; each network has a section of its own."""
    grid = {
        "vehicles": [10, 20],
        "gate": ["certified"],
        "rho_m": [1.5, 2.0],
        "network": ["sumo:DRT", "sumo:bs3d"],
    }
    parsed = page(make(grid), tmp_path)
    assert "loopgate, rho_m 1.5" in parsed.text
    assert {"n1", "n2"} <= set(parsed.ids)
    assert (tmp_path / "r-files" / "sumo-DRT-throughput.svg").exists()


@pytest.mark.usefixtures("undrawn")
def test_loops_that_follow_from_the_vehicles_make_no_series(make: Make, tmp_path: Path) -> None:
    """A file with more loops than vehicles uses as many as there are vehicles: still one series per gate."""
    includes = [{"vehicles": n, "on_loops": n, "gate": ["open", "certified"]} for n in (50, 60)]
    results = make({}, include=includes)
    assert sorted(add_series(results.runs.drop(columns="on_loops"))["series"].unique()) == [
        "SUMO's rules",
        "loopgate",
    ]
    text = page(replace(results, runs=results.runs.drop(columns="on_loops")), tmp_path).text
    assert "Difference to SUMO's rules on the same seeds" in text
    assert "loops 50" not in text


def test_vehicles_for_each_kilometre_make_no_series() -> None:
    """They are another way to say how many there are, which is on the axis."""
    runs = pd.DataFrame({"gate": ["open", "open"], "vehicles": [29, 73], "vehicles_per_km": [2.0, 5.0]})
    assert set(add_series(runs)["series"]) == {"SUMO's rules"}
    assert len(set(add_series(runs.assign(types=["bus=1", "bus=2"]))["series"])) == 2


def test_loops_that_were_not_asked_for_make_no_series(make: Make) -> None:
    """With equal vehicles, one seed finds 50 loops that work and the other 48: one series all the same."""
    includes = [
        {"vehicles": 50, "gate": "open", "seed": seed, "on_loops": loops}
        for seed, loops in ((1, 50), (2, 48))
    ]
    runs = make({}, include=includes).runs
    assert set(runs["loops"]) == {48, 50}
    assert set(add_series(runs.drop(columns="on_loops"))["series"]) == {"SUMO's rules"}


def test_the_title_and_the_first_sentence_say_what_came_out(full: Full) -> None:
    """Who was compared, where, with how many vehicles and seeds, who drives most and who locks up."""
    text = parse(full[1]).text
    assert text.startswith("SUMO's rules and loopgate on sumo:DRT: loopgate report")
    sentence = text[text.index("10 to 80 vehicles, 3 seeds, 400 s each: ") :]
    assert "vehicles drive most with loopgate" in sentence
    assert ". Runs that lock up: SUMO's rules in 3 of 9, loopgate in 0 of 9." in sentence


@pytest.mark.usefixtures("undrawn")
def test_long_names_of_series_make_no_long_title(make: Make, tmp_path: Path) -> None:
    """The title says in what they differ, the first sentence sets the best of each gate side by side."""
    types = ["bus=1,passenger=3", "passenger=1"]
    grid = {"vehicles": [10, 80], "gate": ["open", "certified"], "lights": ["off", "obey"], "types": types}
    text = page(make(grid), tmp_path).text
    what = "SUMO's rules and loopgate on sumo:DRT, compared by lights and types"
    assert text.startswith(f"{what}: loopgate report")
    sentence = text[text.index("10 to 80 vehicles, 1 seed, 400 s each: ") :]
    sentence = sentence[: sentence.index(" Report on")]
    assert "vehicles drive most with \u201cloopgate, lights obeyed, types bus=1,passenger=3\u201d" in sentence
    assert sentence.count("at its best") == 1
    assert re.search(r"\([^)]*\(", sentence) is None
    assert ". Runs that lock up: SUMO's rules in " in sentence
    assert len(sentence) < 400
    assert "Vehicles drive most with" in text.replace(sentence, "")


def test_loops_that_were_chosen_make_a_series(make: Make) -> None:
    """Equal vehicles on 4 and on 8 loops are not the same setting."""
    runs = make({"vehicles": [50, 60], "loops": [4, 8], "gate": ["open"]}).runs
    assert sorted(add_series(runs)["series"].unique()) == ["SUMO's rules, loops 4", "SUMO's rules, loops 8"]


def test_standing_is_measured_alike_for_all_gates(full: Full) -> None:
    """Nobody is held without a gate, and nobody claims a hold of 0; all stand, and all are compared."""
    results, folder = full
    free = results.runs["gate"] == "open"
    assert results.runs.loc[free, ["hold_s", "longest_wait_s", "edge_hold_s"]].isna().all().all()
    assert results.runs.loc[~free, ["hold_s", "longest_wait_s", "edge_hold_s"]].notna().all().all()
    assert (results.runs["stood_s"] == 3.0 * results.runs["vehicles"]).all()
    table = pd.read_csv(folder / "r-files" / "standing.csv")
    share = results.runs["stood_s"] * results.runs["mean_speed_mps"] / results.runs["distance_km"] / 1000.0
    most = share.groupby([results.runs["gate"], results.runs["vehicles"]]).mean().groupby("gate").max()
    named = {"loopgate": most["certified"], "SUMO's rules": most["open"]}
    assert table.groupby("series")["mean"].max().to_dict() == pytest.approx(named, rel=1e-6)
    assert ">SUMO's rules<" in (folder / "r-files" / "map.svg").read_text(encoding="utf-8")
    assert not (folder / "r-files" / "hold.csv").exists()


def test_what_the_longest_waits_were_for(full: Full, section: Section) -> None:
    """Drawn by cause, at the count that all series have; without a gate nobody waits for one."""
    _, folder = full
    [figure] = [one for one in section.figures if one.name == "longest-waits"]
    assert figure.table == "longest-waits"
    table = pd.read_csv(folder / "r-files" / "longest-waits.csv")
    assert set(table["series"]) == {"loopgate"}
    assert table[table["vehicles"] == 80][["cause", "most"]].to_numpy().tolist() == [
        ["crossing", 15.0],
        ["occupied", 8.0],
    ]
    drawn = (folder / "r-files" / "longest-waits.svg").read_text(encoding="utf-8")
    assert drawn.count('fill="#0072b2"') == len(table[table["vehicles"] == 80])


def test_trips_are_a_table_where_there_are_any(full: Full, section: Section) -> None:
    """Also of runs without loops; on loops the single runs have no empty columns."""
    results, _ = full
    names = ["mean_trip_s", "mean_waiting_s", "mean_time_loss_s", "mean_depart_delay_s", "mean_delay_s"]
    columns = ["arrived", "unfinished", *names, "worst_delay_s"]
    tables = {table.name: table.table for table in section.tables}
    assert "trips" not in tables
    assert tables["runs"].notna().any().all()
    assert not {*columns} & {*tables["runs"]}
    once = results.runs.assign(**dict.fromkeys(columns, 2.0))
    once.loc[once["gate"] == "open", "edge_km"] = 0.0
    tables = {t.name: t.table for t in network_sections(replace(results, runs=once))[0].tables}
    assert list(tables["trips"]) == ["series", "vehicles", "runs", *columns]
    assert set(tables["trips"]["series"]) == {"loopgate", "SUMO's rules"}
    assert {*columns} - {"mean_trip_s", "mean_waiting_s"} <= {*tables["runs"]}
    [other] = network_sections(replace(results, runs=once.assign(edge_km=0.0)))
    assert "fundamental" not in {table.name for table in other.tables}  # no loops: no length to be dense on
    assert {figure.table for figure in other.figures} <= {table.name for table in other.tables}


def test_the_code_under_each_table_makes_it(full: Full, section: Section) -> None:
    """What a reader copies from the page gives its numbers; a figure's code is that of its table."""
    check_codes([section], full[1])


@pytest.mark.usefixtures("undrawn")
def test_of_several_networks_it_makes_those_of_each(make: Make, tmp_path: Path) -> None:
    """Two runs lock up, so that all tables are there."""
    grid = {"vehicles": [10, 80], "gate": ["open", "certified"], "network": ["sumo:DRT", "sumo:bs3d"]}
    results = make(grid)
    write_report(results, tmp_path / "r.html")
    check_codes(network_sections(results), tmp_path)


@pytest.mark.usefixtures("undrawn")
def test_the_code_of_a_single_run_makes_its_tables(tmp_path: Path) -> None:
    """Curves over time, causes of waiting, a loop over time and who is stuck, all from the run folder."""
    run = load_runner(f"{Path(__file__).parents[1] / 'sweep' / 'fake_runner.py'}:run")
    for gate in ("open", "certified"):
        folder = tmp_path / gate
        folder.mkdir()
        run({"vehicles": 80, "gate": gate, "seed": 9, "duration_s": 900}, folder)
        results = read_results(folder)
        write_report(results, folder / "r.html")
        codes = check_codes(network_sections(results), folder)
        wanted = {"flow", "time-space"} | ({"stuck"} if gate == "open" else {"causes"})
        assert wanted <= set(codes)


def spec_of(figure: Chart) -> dict[str, Any]:
    """Return a figure as Vega-Lite with its rows in place, for names of tables are the page's own."""
    spec = figure_spec(figure)
    tables = spec.pop("datasets", {})

    def in_place(part: Any) -> Any:  # noqa: ANN401 - any part of a figure
        if isinstance(part, list):
            return [in_place(one) for one in part]
        if not isinstance(part, dict):
            return part
        rows = part.get("data", {})
        own = {"data": rows["values"] if "values" in rows else tables[rows["name"]]} if rows else {}
        return {key: in_place(one) for key, one in part.items() if key != "data"} | own

    return dict(in_place(spec))


def check_codes(sections: Sequence[Section], folder: Path) -> dict[str, str]:
    """Run the code of every table of the report in a folder; return it by the table's name."""
    text = html.unescape((folder / "r.html").read_text(encoding="utf-8"))
    found: dict[str, str] = {}
    for section in sections:
        assert section.load in text
        known: dict[str, Any] = {}
        exec(section.load, known)  # noqa: S102 - as a reader does
        prefix = section.network.replace(":", "-") + "-" if len(sections) > 1 else ""
        assert {figure.table for figure in section.figures} <= {table.name for table in section.tables}
        for table in section.tables:
            assert table.code in text
            made = plain(eval(table.code, known))  # noqa: S307 - as a reader does
            write_csv(made, folder / "again.csv")
            again = (folder / "again.csv").read_bytes()
            assert again == (folder / "r-files" / f"{prefix}{table.name}.csv").read_bytes(), table.code
            found[table.name] = table.code
        for figure in section.figures:
            assert figure.code in text
            drawn = eval(figure.code, known)  # noqa: S307 - as a reader does
            assert (folder / "r-files" / f"{prefix}{figure.name}.svg").is_file()
            assert spec_of(drawn) == spec_of(figure.figure), figure.code
    return found


@pytest.mark.usefixtures("undrawn")
def test_survival_is_drawn_for_one_vehicle_count_at_a_time(make: Make, tmp_path: Path) -> None:
    """Runs with 10 vehicles never lock up and those with 80 do: pooled, neither could be read."""
    grid = {**FULL, "vehicles": [10, 70, 80]}
    text = page(make(grid), tmp_path).text
    drawn = pd.read_csv(tmp_path / "r-files" / "survival.csv")
    assert sorted(drawn["vehicles"].unique()) == [70, 80]
    assert "for each vehicle count with which runs lock up" in text


@pytest.mark.usefixtures("undrawn")
def test_no_lock_up_is_no_figure(make: Make, tmp_path: Path) -> None:
    """Intervals up from 0 % looked like lock-ups; words and table have them."""
    text = page(make({**FULL, "vehicles": [10, 40]}), tmp_path).text
    assert "loopgate in 0 of 6 (95 % interval 0 to" in text
    assert (tmp_path / "r-files" / "deadlocks.csv").exists()
    assert not (tmp_path / "r-files" / "deadlock-rate.svg").exists()


@pytest.mark.usefixtures("undrawn")
def test_nothing_is_said_twice(make: Make, tmp_path: Path) -> None:
    """The first sentence of the page, of one run and of several, does not come back below it."""
    for grid in ({"vehicles": [10]}, {"vehicles": [10, 40], "gate": ["open", "certified"]}):
        folder = tmp_path / str(len(grid))
        folder.mkdir()
        text = page(make(grid), folder).text
        assert text.count("vehicle-km/h with ") == 1


@pytest.mark.usefixtures("undrawn")
def test_at_most_six_survival_panels(make: Make, tmp_path: Path) -> None:
    """Spread from the fewest to the most vehicles that lock up, and the caption says so."""
    text = page(make({"vehicles": list(range(60, 76)), "gate": ["open"]}), tmp_path).text
    drawn = pd.read_csv(tmp_path / "r-files" / "survival.csv")
    assert sorted(drawn["vehicles"].unique()) == [60, 63, 66, 69, 72, 75]
    assert "for 6 of the 16 counts with which runs lock up" in text


@pytest.mark.usefixtures("undrawn")
def test_roads_are_watched_by_equally_many_vehicles(make: Make, tmp_path: Path) -> None:
    """Idleness in words and on maps is of one vehicle count that all series have, and says which."""
    results = make({**FULL, "vehicles": [10, 40]})
    lone = results.runs[(results.runs["gate"] == "open") | (results.runs["vehicles"] == 10)]
    idle = lone.assign(idleness_s=lone["vehicles"].astype(float))
    text = page(replace(results, runs=idle), tmp_path).text
    assert "with 10 vehicles: SUMO's rules 10 s on average, 83 s at worst; loopgate 10 s on average" in text
    assert "With 10 vehicles, mean over runs" in text


@pytest.mark.usefixtures("undrawn")
def test_more_series_than_a_reader_can_tell_apart(make: Make, tmp_path: Path) -> None:
    """Figures show eight, the page names the rest, the tables have all."""
    text = page(make({"vehicles": [10], "gate": [f"g{n}" for n in range(10)]}), tmp_path).text
    assert "The figures leave out gate g8; gate g9" in text
    assert len(pd.read_csv(tmp_path / "r-files" / "throughput.csv")) == 10


def test_names_from_outside_are_text_and_no_markup(make: Make, tmp_path: Path) -> None:
    """A gate called like a tag appears as it is written, on the page and in figures."""
    text = page(make({"vehicles": [10], "gate": ["<script>alert(1)</script>", "b & c"]}), tmp_path).text
    assert "<script>alert(1)</script>" in text


def test_a_place_that_cannot_be_written(make: Make, tmp_path: Path) -> None:
    """One line that names the file."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(ResultsError, match=r"file.*: cannot be written"):
        write_report(make({"vehicles": [10]}), tmp_path / "file" / "r.html")


@pytest.mark.usefixtures("undrawn")
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux that is always full")
def test_a_full_disk(make: Make, tmp_path: Path) -> None:
    """One line that names the file and says what to do."""
    with pytest.raises(ResultsError, match=r"/dev/full: cannot be written \(no space left.*free some space"):
        write_report(make({"vehicles": [10]}), Path("/dev/full"), files=tmp_path / "files")


@pytest.mark.usefixtures("undrawn")
def test_what_is_not_known_of_older_rows_is_on_the_page(make: Make, tmp_path: Path) -> None:
    """A reader must not take a gap for a zero."""
    noted = replace(make({"vehicles": [10]}), notes=("rows: another version made 1 files",))
    assert "another version made 1 files" in page(noted, tmp_path).text


def test_no_results_there(tmp_path: Path) -> None:
    """The error says what was expected."""
    with pytest.raises(ResultsError, match=r"no results; expected rows/ \(a sweep\), summary.json"):
        read_results(tmp_path)


@pytest.mark.parametrize("begin", ["=", "+", "-", "@", "\t", " =", "\r@"])
def test_a_name_is_no_formula_in_a_spreadsheet(begin: str, tmp_path: Path) -> None:
    """In a column of texts, of lists, and in a heading; numbers below zero stay numbers."""
    name = f"{begin}cmd()"
    lists = pd.Series([np.array([name, "b"]), None], dtype=object)
    write_csv(pd.DataFrame({"street": [name, "a"], "list": lists, name: [-1.5, 2.0]}), tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    name = name.replace("\r", " ")
    assert rows == [["street", "list", f"'{name}"], [f"'{name}", f"'{name} b", "-1.5"], ["a", "", "2.0"]]


@pytest.mark.parametrize("text", ["-3.20,10.5 4,5", "-12", "+1e-3,-2E5", " -1 -2"])
def test_a_text_of_figures_stays_as_it_is(text: str, tmp_path: Path) -> None:
    """Who draws the streets by their shapes reads the file as it was; one letter more and it is a formula."""
    write_csv(pd.DataFrame({"shape": [text, f"{text}+A1"], text: [1, 2]}), tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    assert rows == [["shape", text], [text, "1"], [f"'{text}+A1", "2"]]


def test_the_first_table_and_the_paragraph_for_a_paper(full: Full) -> None:
    """Vehicles against rules with intervals, on the page and in LaTeX; versions and settings in words."""
    results, folder = full
    text = parse(folder).text
    means = results.runs[results.runs["vehicles"] == 40].groupby("gate")["km_per_h"].mean()
    latex = (folder / "r-files" / "headline.tex").read_text(encoding="utf-8")
    [row] = re.findall(r"^40 & .*$", latex, re.MULTILINE)
    assert re.findall(r"& (\d+) \$\\pm\$", row.replace("~", "")) == [
        f"{means[gate]:.0f}" for gate in ("open", "certified")
    ]
    assert text.index("with its 95 % interval (Student's t)") < text.index("Series in the figures")
    paragraph = text[text.index("Methods, for a paper") :]
    assert "18 runs with 10, 40, 80 vehicles" in paragraph
    assert "and the seeds 1 to 3 measured 400 s after a warm-up of 0 s each." in paragraph
    assert "loopgate (gate certified" in paragraph
    assert (folder / "r-files" / "throughput-column.pdf").read_bytes().startswith(b"%PDF")
