"""The two formulas of pressure: the order of vehicles, and when a vehicle leaves room in a crowded place.

The negotiation ``pressure``, the ledger and vehicles that decide by messages all use them.
"""

from __future__ import annotations

from typing import Final

PASSED_OVER_S: Final = 60.0
"""A request has been passed over if it is older than this [s].

In the order by pressure such a wait counts as much as a full place behind: a vehicle that has been passed
over goes before every vehicle from a place as full that has not waited, whatever is ahead of them."""


def pressure(behind: float, ahead: float, waited_s: float) -> float:
    """Return the pressure of a vehicle: the highest goes first.

    Shares are compared, not numbers of vehicles: a long queue would beat the few vehicles on a short ring
    again and again, which then fills up and crawls.

    Parameters
    ----------
    behind, ahead
        Share of taken slots in its place and in the next place.
    waited_s
        How long the vehicle has waited [s].
    """
    return behind - ahead + waited_s / PASSED_OVER_S


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
