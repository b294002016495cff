"""Places and movements of the ledger: more of them are laid while vehicles drive."""

from __future__ import annotations

from pathlib import Path

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.places import Leg
from loopgate.control.rules import usual
from loopgate.model import StateId
from loopgate.network import RoadNetwork, VehicleType, generate_loops
from loopgate.simulation.attaching.plan import Plan

GRID = Path(__file__).resolve().parents[3] / "networks" / "grid5-priority.net.xml"


def foes(path: list[Leg]) -> list[dict[str, float]]:
    """Return what each movement on a path conflicts with, and from where on."""
    passes = [over for leg in path for over in leg.passes]
    return [{foe.name: shared.from_m for foe, shared in over.foes.items()} for over in passes]


def more_foes(plan: Plan, before: Plan) -> bool:
    """Return whether a movement of a plan has more conflicts than it had before."""
    known = {c.id: c.foes for way in before.itineraries for leg in way.legs for c in leg.crossings}
    crossings = [c for way in plan.itineraries for leg in way.legs for c in leg.crossings]
    return any(c.foes > known[c.id] for c in crossings if c.id in known)


def test_what_is_laid_later_conflicts_with_what_is_there() -> None:
    """As if all had been laid at once; who is under way stays so, and is in the way of the others."""
    network = RoadNetwork.open(str(GRID))
    loops = generate_loops(network, 40, length_m=(500.0, 1500.0))
    first = Plan(network, ((loops[0], VehicleType()),))
    plans = (first.extended([(loop, VehicleType())]) for loop in loops[1:])
    every = next(plan for plan in plans if plan.goes_on_with(first) and more_foes(plan, first))
    name = loops[0].id
    before, after = (plan.layout.itineraries for plan in (first, every))
    layout = PlaceLayout(first.room, [way.legs for way in before.values()])
    path = layout.path(before[name].legs)
    ledger = Ledger(usual())
    at = next(n for n, leg in enumerate(path) if leg.passes)
    car = ledger.take_in("car", path, at)
    alone = foes(path)
    ledger.ask(car)
    assert ledger.answer() == [car]
    ways = [way.legs for way in after.values()]
    layout.extend(every.room, ways, [(path, after[name].legs)])
    at_once = PlaceLayout(every.room, ways)
    assert alone != foes(path) == foes(at_once.path(after[name].legs))
    assert layout.places.keys() == at_once.places.keys()
    assert layout.places[car.leg.place.name] is car.leg.place
    assert [trip.vehicle for trip in path[at].passes[0].movement.junction.trips] == [car]


def test_movements_that_begin_at_one_place_are_of_one_group() -> None:
    """Though no conflict links them: one waits behind the other where both leave by one lane."""
    here = StateId("here")
    ways = [
        (DrawnLeg(here, 0.0, 50.0, (Crossing(way, frozenset()),)), DrawnLeg(StateId(way), 70.0, 100.0))
        for way in ("left", "right")
    ]
    layout = PlaceLayout({"here": 2, "left": 2, "right": 2}, ways)
    left, right = (layout.path(way)[0].passes[0].movement for way in ways)
    assert left is not right
    assert left.junction is right.junction
