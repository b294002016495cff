"""What SUMO refuses of vehicles and types is refused before a run, with file and element."""

from __future__ import annotations

from pathlib import Path

import pytest
from roads import roads

from loopgate.errors import RouteError
from loopgate.network import read_loops
from loopgate.network.vehicle_demand import RoutesFile

NET = roads(
    {"a": (100, 1), "b": (50, 1), "c": (100, 1)}, ["a_0>b_0", "b_0>a_0", "b_0>c_0", "c_0>a_0"], buses_only=[]
)
WAY = '<route id="r" edges="a b c"/>'
Q = '<vehicle id="q" depart="0" route="r"/>'


def read(tmp_path: Path, inside: str, beside: str = "") -> RoutesFile:
    """Return what a route file has, and an additional file beside it."""
    file, more = tmp_path / "x.rou.xml", tmp_path / "x.add.xml"
    file.write_text(f"<routes>{WAY}{inside}</routes>", encoding="utf-8")
    more.write_text(f"<additional>{beside}</additional>", encoding="utf-8")
    return read_loops(NET, file, stops=[more])


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        (2 * Q, r"x\.rou\.xml: vehicle q: the id is used twice \(also by another vehicle\)"),
        (f'{Q}<trip id="q" depart="9" from="a" to="b"/>', r"trip q: the id is used twice"),
        (2 * '<flow id="q" begin="0" number="2" route="r"/>', r"flow q: the id is used twice"),
        (
            f'{Q}<flow id="q" begin="0" number="2"><route edges="a b"/></flow>',
            r"flow q: the id is used twice \(also by another vehicle\)",
        ),
        (
            '<flow id="f" begin="0" end="9" number="2" route="r"/><vehicle id="f.1" depart="3" route="r"/>',
            r"vehicle f\.1: a vehicle of flow f has this name too",
        ),
        (
            '<vehicle id="f.3" depart="3" route="r"/><flow id="f" begin="0" end="40" period="10" route="r"/>',
            r"vehicle f\.3: a vehicle of flow f",
        ),
        ('<vehicle depart="7" route="r"/>', r"x\.rou\.xml: a <vehicle depart='7' route='r'> has no id"),
        ('<vehicle id="&lt;a" depart="7" route="r"/>', r"vehicle '<a': SUMO allows no '<' in the id"),
        ('<flow id="a b" begin="0" number="1" route="r"/>', r"flow 'a b': SUMO allows no ' ' in the id"),
        (2 * '<vType id="c"/>' + Q, r"vType c: the id is used twice \(also by another vType\)"),
        (
            f'<vType id="c"/><vTypeDistribution id="c"><vType id="d"/></vTypeDistribution>{Q}',
            r"vTypeDistribution c: the id is used twice",
        ),
        (
            f'<vType id="d"/><vTypeDistribution id="c"><vType id="d"/></vTypeDistribution>{Q}',
            r"vType d: the id is used twice",
        ),
        (2 * '<vType id="DEFAULT_VEHTYPE" length="7"/>', r"vType DEFAULT_VEHTYPE: the id is used twice"),
        ('<vType length="7"/>', r"a <vType length='7'> has no id"),
        ('<vType id="a,b"/>', r"vType 'a,b': SUMO allows no ',' in the id"),
        (
            2 * '<routeDistribution id="d" routes="r"/>' + '<vehicle id="q" depart="0" route="d"/>',
            r"routeDistribution d: the id is used twice",
        ),
    ],
)
def test_names(tmp_path: Path, inside: str, says: str) -> None:
    """Each is given once, and is one that SUMO can write."""
    with pytest.raises(RouteError, match=says):
        read(tmp_path, inside)


def test_names_across_files(tmp_path: Path) -> None:
    """The line names both files."""
    for mine, other in ((Q, Q), (2 * '<vType id="c"/>', ""), ('<vType id="c"/>', '<vType id="c"/>')):
        with pytest.raises(RouteError, match=r"the id is used twice \(also by a") as error:
            read(tmp_path, mine, other)
        both = [str(tmp_path / name) in str(error.value) for name in ("x.rou.xml", "x.add.xml")]
        assert all(both) if other else any(both)


@pytest.mark.parametrize(
    "inside",
    [
        f'{Q}<flow id="q" begin="0" number="2" route="r"/>',  # its vehicles have numbers
        '<flow id="f" begin="0" end="9" number="2" route="r"/><vehicle id="f.2" depart="3" route="r"/>',
        '<flow id="f" begin="0" end="9" number="2" route="r"/><vehicle id="f.01" depart="3" route="r"/>',
        '<flow id="f" begin="0" period="exp(0.1)" route="r"/><vehicle id="f.2" depart="3" route="r"/>',
        f'<vType id="DEFAULT_VEHTYPE" length="7"/>{Q}',
        f'{Q}<person id="q" depart="0"><walk edges="a b"/></person>',
        '<vehicle id="a/b:c#d@e" depart="0" route="r"/>',
        '<vehicle id="q" depart="0" route="r" color="1,0.5,0" departSpeed="max" departLane="best"/>',
        '<vehicle id="q" depart="begin" route="r" color="#ff0000" arrivalPos="-3" departPos="random_free"/>',
    ],
)
def test_what_sumo_accepts(tmp_path: Path, inside: str) -> None:
    """It is read."""
    assert read(tmp_path, inside).vehicles


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        ('<vehicle id="q" depart="-5" route="r"/>', r"vehicle q: depart is '-5'; .* from 0 on"),
        ('<vehicle id="q" route="r"/>', r"x\.rou\.xml: vehicle q: it has no depart"),
        ('<trip id="q" from="a" to="b"/>', r"trip q: it has no depart"),
        ('<flow id="q" begin="-5" number="1" route="r"/>', r"flow q: begin is '-5'"),
        ('<flow id="q" begin="9" end="5" number="1" route="r"/>', r"its end, 5 s, is before its begin, 9 s"),
        (
            '<vehicle id="q" depart="0" route="r" color="pink"/>',
            r"vehicle q: color is 'pink'; expected #r",
        ),
        ('<vType id="c" color="1,2"/><vehicle id="q" type="c" depart="0" route="r"/>', r"vType c: color is"),
        ('<vehicle id="q" depart="0" route="r" departLane="-1"/>', r"departLane is '-1'; expected one of al"),
        ('<vehicle id="q" depart="0" route="r" departSpeed="fast"/>', r"departSpeed is 'fast'"),
        ('<vehicle id="q" depart="0" route="r" departPos="x"/>', r"departPos is 'x'"),
        ('<vehicle id="q" depart="0" route="r" personNumber="1.5"/>', r"personNumber is '1.5'; .* a whole"),
        (
            "".join(f'<vehicle id="v{k}" route="r"/>' for k in range(3)),
            r"vehicle v0: it has no depart; .*; and 2 faults more$",
        ),
    ],
)
def test_departures_and_words(tmp_path: Path, inside: str, says: str) -> None:
    """A departure is a time from 0 on; other attributes have SUMO's words."""
    with pytest.raises(RouteError, match=says):
        read(tmp_path, inside)
