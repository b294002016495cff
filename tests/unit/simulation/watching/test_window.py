"""Who is painted how in sumo-gui."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pytest
from roads import polygon

from loopgate.arrays import Floats
from loopgate.simulation.watching.window import COLOURS, Window

DRIVES, HELD, STANDS, JAM = COLOURS
LOOP = polygon("a", [(0.0, 0.0), (50.0, 0.0), (50.0, 80.0)])


class Screen:
    """Remembers what is painted."""

    def __init__(self) -> None:
        self.now_s, self.step_s = 0.0, 1.0
        self.box: tuple[tuple[float, float], ...] = ()
        self.painted: list[tuple[str, tuple[int, int, int]]] = []
        self.on_road = ["u", "v", "w"]

    def vehicles(self) -> list[str]:
        return self.on_road

    def show(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        self.box = (low, high)

    def paint(self, vehicle: str, colour: tuple[int, int, int]) -> None:
        self.painted.append((vehicle, colour))


class Moves:
    """What drives the vehicles: odometers, and those that are held at a gate."""

    def __init__(self) -> None:
        self.at_m = np.zeros(3)
        self.held: set[str] = set()

    def odometers(self) -> tuple[Sequence[str], Floats]:
        return "uvw", self.at_m

    def refused(self, vehicle: str) -> object:
        return vehicle if vehicle in self.held else None


@pytest.fixture
def screen() -> Screen:
    return Screen()


def window(screen: Screen, moves: Moves) -> Window:
    return Window(screen, cast("Any", moves), [LOOP])


def test_the_view_fits_the_loops(screen: Screen) -> None:
    """With some room round them."""
    window(screen, Moves())
    (west, south), (east, north) = screen.box
    assert (west, south) == (-40.0, -40.0)
    assert (east, north) == (90.0, 120.0)


def test_painted_by_what_they_do_and_only_when_it_changes(screen: Screen) -> None:
    """One drives, one is held, one stands; after three minutes those that stand are in a jam."""
    moves = Moves()
    view = window(screen, moves)
    moves.held.add("v")
    view.look()
    assert screen.painted == [("u", STANDS), ("v", HELD), ("w", STANDS)]
    moves.at_m = np.array([8.0, 0.0, 0.0])
    view.look()
    moves.at_m = moves.at_m + np.array([8.0, 0.05, 0.0])
    view.look()
    assert screen.painted[3:] == [("u", DRIVES)]
    screen.now_s = 180.0
    moves.at_m = moves.at_m + np.array([8.0, 0.0, 0.0])
    view.look()
    assert screen.painted[4:] == [("v", JAM), ("w", JAM)]
    moves.at_m = moves.at_m + np.array([8.0, 0.0, 3.0])
    view.look()
    assert screen.painted[6:] == [("w", DRIVES)]


def test_who_is_off_the_road_is_painted_when_it_is_back(screen: Screen) -> None:
    """SUMO knows nobody who has arrived or is being teleported."""
    view = window(screen, Moves())
    screen.on_road = ["u"]
    view.look()
    assert screen.painted == [("u", STANDS)]
    screen.on_road = ["u", "v"]
    view.look()
    assert screen.painted[1:] == [("v", STANDS)]
