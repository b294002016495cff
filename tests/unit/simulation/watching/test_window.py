"""Who is painted how in sumo-gui."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from roads import polygon

from loopgate.simulation.watching.window import COLOURS, Window

DRIVES, HELD, STANDS, JAM = COLOURS
LOOP = polygon("a", [(0.0, 0.0), (50.0, 0.0), (50.0, 80.0)])


class Screen:
    """Remembers what is painted."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.box: tuple[tuple[float, float], ...] = ()
        self.painted: list[tuple[str, tuple[int, int, int]]] = []
        self.on_road = ["u", "v", "w"]

    def vehicles(self) -> list[str]:
        return self.on_road

    def show(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        self.box = (low, high)

    def paint(self, vehicle: str, colour: tuple[int, int, int]) -> None:
        self.painted.append((vehicle, colour))


def table() -> Any:  # noqa: ANN401  as the engine's
    made = np.zeros(3, dtype=[("speed", float), ("held", bool), ("halted_s", float)])
    made["halted_s"] = np.nan
    return made


@pytest.fixture
def screen() -> Screen:
    return Screen()


def window(screen: Screen, vehicles: Any) -> Window:  # noqa: ANN401  as above
    drivers = [SimpleNamespace(id=name) for name in "uvw"]
    return Window(screen, cast("Any", SimpleNamespace(drivers=drivers, vehicles=vehicles, changes=1)), [LOOP])


def test_the_view_fits_the_loops(screen: Screen) -> None:
    """With some room round them."""
    window(screen, table())
    (west, south), (east, north) = screen.box
    assert (west, south) == (-40.0, -40.0)
    assert (east, north) == (90.0, 120.0)


def test_painted_by_what_they_do_and_only_when_it_changes(screen: Screen) -> None:
    """One drives, one is held, one stands; after three minutes those that stand are in a jam."""
    vehicles = table()
    view = window(screen, vehicles)
    vehicles["speed"] = [8.0, 0.0, 0.0]
    vehicles["held"][1], vehicles["halted_s"][1] = True, 5.0
    view.look()
    assert screen.painted == [("u", DRIVES), ("v", HELD), ("w", STANDS)]
    view.look()
    assert len(screen.painted) == 3
    screen.now_s = 180.0
    view.look()
    assert screen.painted[3:] == [("v", JAM), ("w", JAM)]
    vehicles["speed"][2] = 3.0
    view.look()
    assert screen.painted[5:] == [("w", DRIVES)]


def test_who_is_off_the_road_is_painted_when_it_is_back(screen: Screen) -> None:
    """SUMO knows nobody who has arrived or is being teleported."""
    view = window(screen, table())
    screen.on_road = ["u"]
    view.look()
    assert screen.painted == [("u", STANDS)]
    screen.on_road = ["u", "v"]
    view.look()
    assert screen.painted[1:] == [("v", STANDS)]
