"""What docs/options.md says of SUMO's options is so: it is made anew, and SUMO says what it got."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from loopgate import Scenario
from loopgate.errors import ScenarioError
from loopgate.simulation.run import simulate
from loopgate.simulation.sumo_options import HONOURED, UNDER_GATE

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
PLACE = importlib.util.spec_from_file_location("options", ROOT / "analysis" / "options.py")
assert PLACE is not None
assert PLACE.loader is not None
OPTIONS: Any = importlib.util.module_from_spec(PLACE)
PLACE.loader.exec_module(OPTIONS)

LEFT = {
    "ignore-junction-blocker": "40",
    "waiting-time-memory": "90",
    "time-to-impatience": "170",
    "routing-algorithm": "astar",
    "weights.random-factor": "1.5",
    "device.emissions.probability": "0.5",
    "device.fcd.period": "5",
    "tls.actuated.jam-threshold": "10",
    "precision": "3",
    "pedestrian.model": "nonInteracting",
    "lanechange.overtake-right": "true",
    "default.emergencydecel": "9",
}
TOLD = {
    **dict.fromkeys(UNDER_GATE, "true"),
    "lateral-resolution": "0.8",
    "time-to-teleport": "120",
    "collision.action": "remove",
}
TOLD |= {"default.departspeed": "max", "default.departlane": "best", "max-depart-delay": "60"}
TOLD |= {"random-depart-offset": "4", "insertion-checks": "none"}


def test_the_page_is_what_the_code_says() -> None:
    """Each option of SUMO's schema once; `python analysis/options.py` makes it."""
    assert (ROOT / "docs" / "options.md").read_text(encoding="utf-8") == OPTIONS.page()
    every = [name for names in OPTIONS.options().values() for name in names]
    assert len(every) == len(set(every)) > 400
    assert {OPTIONS.what_of(name)[0] for name in LEFT} == {OPTIONS.LEFT}
    assert {OPTIONS.what_of(name)[0] for name in TOLD} == {OPTIONS.TOLD}
    assert set(HONOURED) < set(every)
    named = {element: sorted(" ".join(some).split()) for element, some in OPTIONS.REROUTERS.items()}
    assert named == {element: sorted(some) for element, some in OPTIONS.rerouters().items()}


def test_sumo_gets_what_is_left_to_it_and_the_rest_is_told(tmp_path: Path) -> None:
    """By its own word, in a run under the gate."""
    said = "".join(f'<{name} value="{value}"/>' for name, value in (LEFT | TOLD).items())
    (tmp_path / "x.rou.xml").write_text(
        '<routes><route id="r" edges="A0A1 A1A2"/>'
        '<flow id="f" begin="0" number="3" period="5" route="r"/></routes>'
    )
    (tmp_path / "x.sumocfg").write_text(
        f'<configuration><net-file value="{ROOT / "networks" / "grid5-priority.net.xml"}"/>'
        f'<route-files value="x.rou.xml"/><end value="60"/>{said}</configuration>'
    )
    got: dict[str, str] = {}

    def look(_now_s: float, _course: object) -> None:
        import libsumo  # noqa: PLC0415  it runs by now

        got.update({name: libsumo.simulation.getOption(name) for name in LEFT})

    summary = simulate(Scenario(network=str(tmp_path / "x.sumocfg")), tick=look)
    assert (summary["gate"], summary["audit"]) == ("certified", "clean")
    assert {name: value.rstrip("0").rstrip(".") for name, value in got.items()} == {
        name: value.rstrip("0").rstrip(".") for name, value in LEFT.items()
    }
    untold = [name for name in TOLD if not any(f": {name} " in line for line in summary["warnings"])]
    assert untold == []


def test_defaults_of_types_hold_for_gated_vehicles(tmp_path: Path) -> None:
    """A gate knows of them: who cannot be driven so is ordinary, with the reason."""
    (tmp_path / "x.rou.xml").write_text(
        '<routes><vType id="own" actionStepLength="1"/><route id="r" edges="A0A1 A1A2"/>'
        '<vehicle id="a" depart="0" route="r"/><vehicle id="b" type="own" depart="5" route="r"/></routes>'
    )
    options = "--default.action-step-length 3 --default.speeddev 0.3"
    routes, network = str(tmp_path / "x.rou.xml"), "networks/grid5-priority.net.xml"
    summary = simulate(Scenario(network=network, routes=routes, sumo=options, duration_s=60))
    assert (summary["vehicles"], summary["others"]["vehicles"], summary["audit"]) == (1, 1, "clean")
    assert any("a: vType DEFAULT_VEHTYPE: actionStepLength 3 is above" in w for w in summary["warnings"])
    wrong = Scenario(network=network, routes=routes, sumo="--default.speeddev much", duration_s=60)
    with pytest.raises(ScenarioError, match=r"default.speeddev is 'much'; expected a number"):
        simulate(wrong)
