"""Flows of more vehicles than any run may have are refused before what runs need is loaded."""

import subprocess
import sys
from pathlib import Path

import pytest

from loopgate.errors import RouteError
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_options import refuse_too_many

FLOW = '<flow id="f" begin="0" end="3600" from="A0A1" to="A1B1" {}/>'
MUCH = FLOW.format('number="1000000000"')


def write(folder: Path, name: str, inside: str, root: str = "routes") -> str:
    (folder / name).write_text(f"<{root}>{inside}</{root}>", encoding="utf-8")
    return str(folder / name)


@pytest.mark.parametrize("often", ['number="1000000000"', 'period="1e-7"', 'period="exp(1e9)"'])
def test_flow_of_too_many_is_refused(tmp_path: Path, often: str) -> None:
    routes = write(tmp_path, "r.rou.xml", FLOW.format(often).replace('end="3600" ', ""))
    with pytest.raises(RouteError, match="vehicles and persons of flows depart from 0 to 100 s"):
        refuse_too_many(Scenario(network="n.net.xml", routes=routes, duration_s=100))


@pytest.mark.parametrize("where", ["route-files", "additional-files"])
def test_flow_that_a_configuration_names_is_refused(tmp_path: Path, where: str) -> None:
    write(tmp_path, "r.rou.xml", MUCH)
    write(tmp_path, "i.rou.xml", '<include href="r.rou.xml"/>')
    named = f'<net-file value="n.net.xml"/><{where} value="i.rou.xml"/>'
    config = write(tmp_path, "c.sumocfg", named, "configuration")
    with pytest.raises(RouteError, match="of them of f"):
        refuse_too_many(Scenario(network=config))


def test_flow_beside_the_loops_is_refused(tmp_path: Path) -> None:
    traffic = write(tmp_path, "t.rou.xml", MUCH)
    with pytest.raises(RouteError, match="of them of f"):
        refuse_too_many(Scenario(network="n.net.xml", vehicles=2, traffic=traffic))


def test_what_is_less_clear_is_for_the_run(tmp_path: Path) -> None:
    much = write(tmp_path, "much.rou.xml", MUCH)
    refuse_too_many(Scenario(network="n.net.xml", routes=much, vehicles=3))
    few = write(tmp_path, "few.rou.xml", FLOW.format('number="5"'))
    refuse_too_many(Scenario(network="n.net.xml", routes=few))
    refuse_too_many(Scenario(network="n.net.xml", routes=str(tmp_path / "absent.rou.xml")))


def test_refusal_loads_nothing_that_runs_need(tmp_path: Path) -> None:
    routes = write(tmp_path, "r.rou.xml", MUCH)
    code = (
        "import sys\nfrom loopgate.cli.main import cli\n"
        f"try: cli(['run', 'n.net.xml', '--routes', {routes!r}], standalone_mode=False)\n"
        "except Exception as error: print(type(error).__name__)\n"
        "print(sorted({'numba', 'pandas', 'networkx', 'pyarrow', 'libsumo'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "RouteError\n[]\n"
