"""A vehicle on segments that decides by Algorithm 2 of Zhou et al. 2020, from answers of monitors.

It asks about the segments on its own way, and then about the ways of all vehicles that it finds. So it knows
all circuits that its move could close, and judges them as the gate ``algorithm2`` does. Pure functions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from loopgate.gates.algorithm2 import Algorithm2Gate
from loopgate.gates.base import Decision
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.vehicles.messages import Goes, Left, Moved, Room
from loopgate.vehicles.survey import Busy, Free, Look, Role, Seen, Stand, Whose, Word

__all__ = ["MoveSurvey", "Surveyor", "decide"]


@dataclass(frozen=True, slots=True)
class MoveSurvey:
    """The questions and answers that a vehicle has collected for its next move.

    Attributes
    ----------
    until_s
        End of the time in which the answers stay true, by the vehicle's clock [s].
    asked
        Questions asked; the ways of questions without an answer are `open`.
    stands
        Vehicles found, with their positions.
    """

    until_s: float
    asked: tuple[Look, ...] = ()
    open: frozenset[tuple[int, ...]] = frozenset()
    stands: tuple[Stand, ...] = ()


@dataclass(frozen=True, slots=True)
class Surveyor:
    """The knowledge of a vehicle on segments that decides by Algorithm 2.

    Attributes
    ----------
    stand
        Its position, its loop, and the segments of the loop that other vehicles visit too.
    robots
        Number of all vehicles, as in the paper.
    lookahead
        See `loopgate.gates.algorithm2.Algorithm2Gate`.
    lease_s
        Time for which answers of monitors stay true [s].
    number
        Number of moves that the vehicle has asked for.
    survey
        Questions and answers for the next move, while the vehicle decides.
    rears, untold
        Segments that its front has left but not its rear; segments that it has left and whose monitors have
        not acknowledged it. Each with the number of the move.
    """

    stand: Stand
    robots: int
    lookahead: int = 1
    lease_s: float = 6.0
    number: int = 0
    survey: MoveSurvey | None = None
    rears: tuple[tuple[int, int, bool], ...] = ()
    untold: tuple[tuple[int, int], ...] = field(default=())

    @property
    def most(self) -> int:
        """The number of segments to look ahead: N - 2 for N vehicles, as in the paper; at least one."""
        return max(1, self.robots - 2)

    @property
    def wished(self) -> Stand:
        """The vehicle's presence in the next segment, as it will be after the move."""
        stand = self.stand
        return replace(stand, number=self.number, at=(stand.at + 1) % len(stand.loop))


Answer = tuple[Surveyor, list[Word]]


def ask(me: Surveyor, now_s: float) -> Answer:
    """Return the vehicle after it has asked for its next segment, and its questions along its path.

    A vehicle that goes from one private segment to another asks no monitor.
    """
    me = replace(me, number=me.number + 1)
    stand, wished = me.stand, me.wished
    way: list[int] = []
    roles: list[Role] = []
    if stand.shared[stand.at]:
        way.append(stand.loop[stand.at])
        roles.append(Role.LEAVE)
    if stand.shared[wished.at]:
        ahead = wished.ahead(me.most)
        way += [stand.loop[wished.at], *ahead]
        roles += [Role.TAKE, *(Role.READ for _ in ahead)]
    survey = MoveSurvey(now_s + me.lease_s, stands=(stand,))
    if not way:
        return replace(me, survey=survey), []
    look = Look(stand.vehicle, me.number, tuple(way), tuple(roles), wished)
    return replace(me, survey=replace(survey, asked=(look,), open=frozenset({look.way}))), [look]


def again(me: Surveyor) -> list[Word]:
    """Return the questions that have no answer yet, to be sent again."""
    survey = me.survey
    return [] if survey is None else [look for look in survey.asked if look.way in survey.open]


def seen(me: Surveyor, message: Seen) -> Answer:
    """Return the vehicle after an answer, and its questions along the ways of newly found vehicles."""
    survey = me.survey
    if survey is None or message.number != me.number or message.way not in survey.open:
        return me, []
    stands, looks = list(survey.stands), list[Look]()
    known = {one.vehicle for one in stands}
    for place, there in message.seen:
        if there is None or there.vehicle in known:
            continue
        known.add(there.vehicle)
        stands.append(there)
        ahead = there.ahead(me.most)
        if ahead:
            before = message.way[: message.way.index(place) + 1]
            roles = (Role.OVER,) * len(before) + (Role.READ,) * len(ahead)
            looks.append(Look(me.stand.vehicle, me.number, (*before, *ahead), roles, me.wished))
    waits = (survey.open - {message.way}) | {look.way for look in looks}
    after = MoveSurvey(survey.until_s, (*survey.asked, *looks), frozenset(waits), tuple(stands))
    return replace(me, survey=after), list(looks)


def decide(me: Surveyor) -> Decision | None:
    """Return the vehicle's decision by Algorithm 2; None while answers are missing.

    The vehicle builds a system of the vehicles that it has found. Each other vehicle is a robot that stands
    in a state of its own, so that the number of robots and the shared segments are right.
    """
    survey = me.survey
    if survey is None or survey.open:
        return None
    stands = survey.stands
    shared = dict.fromkeys(
        place for one in stands for place, others in zip(one.loop, one.shared, strict=True) if others
    )
    robots = [Robot(RobotId(str(one.vehicle)), _names(one.loop), start=one.at) for one in stands]
    robots += [
        Robot(RobotId(f"aside {aside}"), (StateId(f"aside {aside}"), *_names(shared)))
        for aside in range(me.robots - len(stands))
    ]
    system = System(robots)
    return Algorithm2Gate(system, lookahead=me.lookahead).decide(system.initial, 0)


def _names(places: Sequence[int] | Mapping[int, None]) -> tuple[StateId, ...]:
    return tuple(StateId(str(place)) for place in places)


def go(me: Surveyor) -> Answer:
    """Return the vehicle after it has set out for its next segment, and its messages."""
    stand, wished = me.stand, me.wished
    here, there = stand.loop[stand.at], stand.loop[wished.at]
    out: list[Word] = []
    if stand.shared[wished.at]:
        out.append(Goes(there, stand.vehicle, me.number))
    if stand.shared[stand.at]:
        out.append(Moved(here, stand.vehicle, me.number))
    rears = (*me.rears, (here, me.number, stand.shared[stand.at]))
    untold = tuple(one for one in me.untold if one[0] != there)
    after = replace(me, stand=wished, survey=None, rears=rears, untold=untold)
    return after, [*out, *_freed(me, gives_up=False)]


def give_up(me: Surveyor) -> Answer:
    """Return the vehicle after it has given up its request, and its messages."""
    return replace(me, survey=None), _freed(me, gives_up=True)


def _freed(me: Surveyor, *, gives_up: bool) -> list[Word]:
    """Return messages that free the segments it has read; if it gives up, also those it wanted to use."""
    out: list[Word] = []
    for number, look in enumerate(me.survey.asked if me.survey is not None else ()):
        begins = 0 if gives_up and number == 0 else look.roles.count(Role.OVER)
        if not gives_up and number == 0:
            begins = len(look.roles) - look.roles.count(Role.READ)
        if begins < len(look.way):
            out.append(Free(me.stand.vehicle, me.number, look.way, begins, not gives_up))
    return out


def told(me: Surveyor, message: Busy | Whose | Room) -> Answer:
    """Return the vehicle after a monitor's refusal, question or acknowledgement, and its messages."""
    if isinstance(message, Busy):
        return give_up(me) if me.survey is not None and message.number == me.number else (me, [])
    if isinstance(message, Room):
        left = tuple(one for one in me.untold if one != (message.place, message.number))
        return replace(me, untold=left), []
    deciding = message.number == me.number and me.survey is not None
    return me, [] if deciding else [_become(me, message)]


def _become(me: Surveyor, asked: Whose) -> Word:
    """Return the state of a wish: the vehicle has come, has gone, has left with its rear, or has given up."""
    stand, place = me.stand, asked.place
    if place == stand.loop[stand.at] and asked.number == stand.number:
        return Goes(place, stand.vehicle, asked.number)
    went = next((number for left, number, _ in me.rears if left == place), None)
    if went is not None:
        return Moved(place, stand.vehicle, went)
    left = next((number for left, number in me.untold if left == place), None)
    if left is not None:
        return Left(place, stand.vehicle, left)
    return Free(stand.vehicle, asked.number, (place,))


def rear_out(me: Surveyor) -> Answer:
    """Return the vehicle after its rear has left the first segment it still touches, and its messages."""
    place, number, shared = me.rears[0]
    me = replace(me, rears=me.rears[1:])
    if not shared:
        return me, []
    untold = (*(one for one in me.untold if one[0] != place), (place, number))
    return replace(me, untold=untold), [Left(place, me.stand.vehicle, number)]


def repeat(me: Surveyor) -> list[Word]:
    """Return the reports that no monitor has acknowledged, to be sent again."""
    return [Left(place, me.stand.vehicle, number) for place, number in me.untold]
