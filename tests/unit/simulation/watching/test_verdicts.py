"""Who erred in a collision of a gated with an ordinary vehicle, by what both did before, without SUMO."""

from itertools import product
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from fake_traffic import whereabouts

from loopgate.network.road import Connection
from loopgate.simulation.watching.verdicts import Verdicts
from loopgate.traffic.base import Collision, Light

MAJOR = Connection("west", 0, "east", 0, (":j_0_0",), "s", "j", 0, ("t", 0))
MINOR = Connection("south", 0, "north", 0, (":j_1_0", ":j_2_0"), "s", "j", 1, ("t", 1))
BEHIND = Connection("east", 0, "far", 0, (":k_0_0",), "s", "k", 0, ("t", 1))
LENGTH_M = dict.fromkeys(("west_0", "south_0", "east_0", "north_0", ":j_0_0", ":j_1_0", ":j_2_0"), 100.0)


class Junction:
    """Of two ways straight on, the one from the south yields. The gated vehicle is ``g``."""

    def __init__(self, shown: str = "GG", *, trespassing: bool = False, equal: bool = False) -> None:
        yields = (frozenset[int](), frozenset[int]() if equal else frozenset({0}))
        network: Any = SimpleNamespace(
            connections=(MAJOR, MINOR, BEHIND),
            junctions={"j": SimpleNamespace(yields_to=yields)},
            lanes={lane: SimpleNamespace(length_m=length) for lane, length in LENGTH_M.items()},
        )
        self.at: dict[str, tuple[str, float, float]] = {}
        self.traffic = Mock(
            now_s=0.0,
            step_s=1.0,
            whereabouts=lambda: whereabouts(**self.at),
            light=lambda _: Light(shown, 10.0),
        )
        drive: Any = SimpleNamespace(
            changes=0,
            names=lambda: ["g"],
            granted=lambda: np.array([0]),
            records={"g": None},
            trespasses_now=lambda _: trespassing,
        )
        self.verdicts = Verdicts(network, self.traffic, drive)

    def step(self, **at: tuple[str, float, float]) -> None:
        """Let a second pass, after which vehicles are there."""
        self.traffic.now_s += 1.0
        self.at |= at
        self.verdicts.look()

    def erred(self, collider: str = "o", victim: str = "g") -> tuple[str, str]:
        """Let them collide."""
        verdict = self.verdicts.judge(Collision(collider, victim, ":j_0_0"))
        assert verdict is not None
        return verdict.erred, verdict.why


@pytest.mark.parametrize(("gated", "collider"), list(product(("west", "south"), ("g", "o"))))
def test_who_has_to_yield_errs(gated: str, collider: str) -> None:
    """The other one was too near to stop when it drove in, or was there before."""
    for first in ("west", "south"):
        junction = Junction()
        names = {"west": "g", "south": "o"} if gated == "west" else {"west": "o", "south": "g"}
        inside = {"west": (":j_0_0", 1.0, 10.0), "south": (":j_1_0", 1.0, 10.0)}
        junction.step(**{name: (f"{road}_0", 95.0, 10.0) for road, name in names.items()})
        junction.step(**{names[first]: inside[first]})
        junction.step(**{name: inside[road] for road, name in names.items()})
        victim = "o" if collider == "g" else "g"
        assert junction.erred(collider, victim)[0] == ("gated" if gated == "south" else "ordinary")


@pytest.mark.parametrize(
    ("gated", "gap_m", "erred"),
    [("west_0", 2.0, "ordinary"), ("west_1", 2.0, "gated"), ("west_0", 6.0, "gated")],
)
def test_who_comes_from_beside_the_body_of_the_other_errs(gated: str, gap_m: float, erred: str) -> None:
    """On the lane from which the junction is entered; not one that was ahead of it, with its rear too."""
    junction = Junction()
    junction.traffic.size.return_value = 5.0, 2.5
    ordinary = "west_1" if gated == "west_0" else "west_0"
    junction.step(g=(gated, 90.0, 10.0), o=(ordinary, 90.0 + gap_m, 10.0))
    junction.step(g=(":j_0_0", 1.0, 10.0), o=(":j_0_0", 3.0, 5.0))
    assert junction.erred("g", "o")[0] == erred


@pytest.mark.parametrize(("left_m", "erred"), [(40.0, "ordinary"), (12.0, "gated")])
def test_who_could_have_stopped_errs(left_m: float, erred: str) -> None:
    """The gated vehicle has to yield, and is on its way across when the other one is 40 m away, or 12."""
    junction = Junction()
    junction.step(g=("south_0", 99.0, 5.0), o=("west_0", 80.0 - left_m, 10.0))
    junction.step(g=(":j_1_0", 3.0, 5.0), o=("west_0", 90.0 - left_m, 10.0))
    junction.step(g=(":j_2_0", 3.0, 5.0), o=("west_0", 100.0 - left_m, 10.0))
    junction.step(o=(":j_0_0", 1.0, 10.0))
    assert junction.erred()[0] == erred
    assert "g" in junction.erred()[1]


@pytest.mark.parametrize(("left_m", "erred"), [(8.0, "ordinary"), (30.0, "gated")])
def test_who_departs_when_the_other_cannot_stop_any_more_errs(left_m: float, erred: str) -> None:
    """The gated vehicle has to yield, and is 8 m or 30 m before the junction when somebody departs there."""
    junction = Junction()
    junction.step(g=("south_0", 90.0 - left_m, 10.0))
    junction.step(g=("south_0", 100.0 - left_m, 10.0), o=("west_0", 70.0, 13.0))
    junction.step(g=(":j_1_0", 1.0, 5.0), o=("west_0", 83.0, 13.0))
    junction.step(g=(":j_1_0", 6.0, 5.0), o=(":j_0_0", 1.0, 13.0))
    assert junction.erred()[0] == erred


def test_who_is_inside_in_the_same_second_cannot_stop() -> None:
    """However far it had been from the junction a second before."""
    junction = Junction()
    junction.step(g=("south_0", 99.0, 5.0), o=("west_0", 80.0, 13.0))
    junction.step(g=(":j_1_0", 3.0, 5.0), o=("west_0", 93.0, 13.0))
    junction.step(g=(":j_2_0", 3.0, 5.0), o=(":j_0_0", 6.0, 13.0))
    assert junction.erred()[0] == "gated"


@pytest.mark.parametrize("waits", ["g", "o"])
def test_who_waits_inside_in_the_way_errs(waits: str) -> None:
    """However long before: the other one has the right of way, and SUMO does not let it stop for that."""
    goes = "o" if waits == "g" else "g"
    junction = Junction()
    junction.step(**{waits: ("south_0", 99.0, 5.0), goes: ("west_0", 20.0, 10.0)})
    for second in range(7):
        junction.step(**{waits: (":j_1_0", 3.0, 0.0), goes: ("west_0", 30.0 + 10.0 * second, 10.0)})
    junction.step(**{goes: (":j_0_0", 1.0, 10.0)})
    erred = "gated" if waits == "g" else "ordinary"
    said = f"{waits} had to yield; it waited inside, in the way of {goes}"
    assert junction.erred(goes, waits) == (erred, said)


def test_who_drives_in_at_red_errs() -> None:
    """Whatever the right of way is."""
    junction = Junction("rG")
    junction.step(g=("south_0", 99.0, 5.0), o=("west_0", 99.0, 10.0))
    junction.step(g=(":j_1_0", 3.0, 5.0), o=(":j_0_0", 3.0, 10.0))
    assert junction.erred() == ("ordinary", "o drove in at red")


@pytest.mark.parametrize(("shown", "erred"), [("GG", "ordinary"), ("rG", "gated")])
def test_the_junction_counts_where_they_collide(shown: str, erred: str) -> None:
    """The front of the gated vehicle is in the next one, where no light is red; its rear is hit."""
    junction = Junction(shown)
    junction.step(g=("west_0", 99.0, 8.0), o=("south_0", 99.9, 0.0))
    junction.step(g=(":j_0_0", 98.0, 8.0))
    junction.step(g=(":k_0_0", 1.0, 8.0), o=(":j_1_0", 2.0, 2.0))
    assert junction.erred("g", "o")[0] == erred


def test_who_comes_later_errs_where_none_yields() -> None:
    """As at junctions whose right of way does not know that two ways touch."""
    junction = Junction(equal=True)
    junction.step(g=("south_0", 99.0, 5.0), o=("west_0", 99.0, 10.0))
    junction.step(g=(":j_1_0", 3.0, 5.0))
    junction.step(o=(":j_0_0", 3.0, 10.0))
    assert junction.erred()[0] == "ordinary"


def test_who_is_behind_errs() -> None:
    """On one road, and where both drove in from one lane."""
    junction = Junction()
    junction.step(g=("west_0", 20.0, 5.0), o=("west_0", 10.0, 10.0))
    assert junction.erred("g", "o") == ("gated", "g ran into o from behind")
    junction.step(g=(":j_0_0", 20.0, 5.0))
    junction.step(o=(":j_0_0", 10.0, 10.0))
    assert junction.erred()[0] == "ordinary"


def test_a_gated_vehicle_without_a_grant_errs() -> None:
    """Before all else."""
    junction = Junction(trespassing=True)
    junction.step(g=("west_0", 20.0, 5.0), o=("west_0", 10.0, 10.0))
    assert junction.erred()[0] == "gated"


def test_what_is_told_and_of_whom() -> None:
    """Where both were five seconds before; nothing of two that are under the gate, or of two that are not."""
    junction = Junction()
    for second in range(10):
        junction.step(g=("west_0", 30.0 + second, 5.0), o=("west_0", 10.0 + second, 10.0))
    verdict = junction.verdicts.judge(Collision("o", "g", "west_0"))
    assert verdict is not None
    assert verdict.before == {"g": ("west_0", 34.0, 5.0), "o": ("west_0", 14.0, 10.0)}
    assert verdict.figures()["gated"] == "g"
    assert junction.verdicts.judge(Collision("o", "p", "west_0")) is None
    assert junction.verdicts.judge(Collision("g", "g", "west_0")) is None
