"""Vehicle-km in the hour in two cities: SUMO's own rules with lights on and off, beside the certified gate.

South-east Berlin and Braunschweig, as they come with SUMO, on random loops of 400 to 3000 m: 60 and 20
for each seed, driven under every rule by the same vehicles from the same places.

    python analysis/throughput_city.py --seeds 5 --write

prints the tables and renews them in ``docs/studies/throughput.md``. Runs that are done are kept, see
``--help``.
"""

from __future__ import annotations

from collections.abc import Sequence

from throughput_study import Rule, Study, conduct, parser

from loopgate.abstraction.queue_layout import why_not
from loopgate.network import Loop, RoadNetwork, generate_loops

LENGTH_M = (400.0, 3000.0)


def _rule(name: str, network: str, gate: str, lights: str) -> Rule:
    scenario = {"network": network, "gate": gate, "lights": lights}
    return Rule(name, scenario, yardstick=gate == "open")


def _city(name: str, title: str, network: str, loops: int, vehicles: tuple[int, ...], *, lit: bool) -> Study:
    rules = [
        _rule("SUMO, lights on", network, "open", "keep"),
        _rule("SUMO, lights off", network, "open", "off"),
        _rule("certified, lights off", network, "certified", "off"),
    ]

    def make(seed: int) -> Sequence[Loop]:
        roads = RoadNetwork.open(network)
        return generate_loops(
            roads, loops, length_m=LENGTH_M, seed=seed, admits=lambda loop: not why_not(roads, loop)
        )

    chosen = tuple(rule for rule in rules if lit or rule.scenario["lights"] == "off")
    return Study(name, title, chosen, vehicles, make)


CITIES = (
    _city(
        "berlin",
        "South-east Berlin (`sumo:DRT`)",
        "sumo:DRT",
        60,
        (50, 150, 300, 400, 600),
        lit=True,
    ),
    # The lights of this network belong to a game in which a player switches them: left alone they stay red.
    _city("braunschweig", "Braunschweig (`sumo:bs3d`)", "sumo:bs3d", 20, (50, 100, 150), lit=False),
)

if __name__ == "__main__":
    words = parser(__doc__)
    words.add_argument("--city", choices=[city.name for city in CITIES], help="only this one")
    given = words.parse_args()
    for city in CITIES:
        if given.city in {None, city.name}:
            conduct(city, given)
