"""The two formulas of pressure: the order of vehicles, and when a vehicle leaves room in a crowded place.

The negotiation ``pressure``, the ledger and vehicles that decide by messages all use them.
"""

from __future__ import annotations


def pressure(behind: int, ahead: int, waited: float) -> float:
    """Return the pressure of a vehicle: the highest goes first.

    `behind`, `ahead`: number of vehicles in its place and in the next place. `waited`: its wait, counted in
    vehicles.
    """
    return behind - ahead + waited


def leaves_room(ahead: float, here: float, waited: float, crowded: float) -> bool:
    """Return whether a vehicle must wait, to leave room in a crowded place for others.

    No vehicle drives from an emptier place into a crowded one, unless it has waited the longer, the fuller
    the crowded place is.

    Parameters
    ----------
    ahead, here
        Share of taken slots in the next place and in the vehicle's place.
    waited
        The vehicle's wait as share of the longest wait, from an empty place into a full one.
    crowded
        Share of taken slots from which a place counts as crowded.

    Examples
    --------
    >>> leaves_room(0.9, 0.4, 0.1, crowded=0.6), leaves_room(0.9, 0.4, 0.6, crowded=0.6)
    (True, False)
    """
    return ahead >= crowded and ahead - here >= waited
