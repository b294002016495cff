"""Routes of vehicles in SUMO: one that is refused is tried again, but not once another is taken."""

from types import SimpleNamespace
from typing import Any

import pytest

from loopgate.errors import TrafficError
from loopgate.traffic.sumo import SumoRoutes


class RefusedError(Exception):
    """What SUMO raises."""


class FakeVehicles:
    """The vehicles of SUMO; it refuses routes by what is closed."""

    def __init__(self) -> None:
        self.given: list[object] = []
        self.refuses: set[object] = set()

    def take(self, _: str, route: object) -> None:
        """Take a route, by its name or its edges."""
        said = tuple(route) if isinstance(route, list) else route
        if said in self.refuses:
            raise RefusedError
        self.given.append(said)

    setRoute = setRouteID = take  # noqa: N815 - SUMO's names

    def getIDList(self) -> list[str]:  # noqa: N802
        """Return the only vehicle."""
        return ["v"]


def routes() -> tuple[SumoRoutes, FakeVehicles, dict[str, Any]]:
    vehicles, added = FakeVehicles(), dict[str, Any]()
    api = SimpleNamespace(vehicle=vehicles, route=SimpleNamespace(add=added.__setitem__))
    return SumoRoutes(api, RefusedError, lambda _: str), vehicles, added


@pytest.mark.parametrize("led", [False, True])
def test_a_refused_route_is_forgotten_once_another_is_taken(led: bool) -> None:  # noqa: FBT001
    """Else the vehicle would be put back on it in the midst of its detour."""
    mine, vehicles, _ = routes()
    vehicles.refuses = {"own"}
    mine.renew("v", "own")
    assert list(mine.without_way) == ["v"]
    if led:
        mine.lead("v", ["a", "b"])
    else:
        mine.renew("v", "detour")
    assert not list(mine.without_way)
    vehicles.refuses = set()
    mine.renew_again(100.0)
    assert vehicles.given == [("a", "b") if led else "detour"]


def test_a_vehicle_is_led_though_an_edge_behind_it_is_closed() -> None:
    """SUMO checks the edges that a vehicle has driven, unless the route has a name."""
    mine, vehicles, added = routes()
    vehicles.refuses = {("a", "b")}
    mine.lead("v", ["a", "b"])
    (name,) = vehicles.given
    assert added == {name: ["a", "b"]}
    vehicles.refuses = {("a", "b"), "v@1"}
    with pytest.raises(TrafficError, match="vehicle v: SUMO does not take the route a b"):
        mine.lead("v", ["a", "b"])
