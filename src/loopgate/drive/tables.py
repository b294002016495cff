"""The state of the drive: a handful of tables, and what a row of each of them is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loopgate.drive.around import (
    AcrossRow,
    ApproachRow,
    ArrivalRow,
    CrossedRow,
    EdgeRow,
    JunctionRow,
    LaneRow,
    LightRow,
    LinkRow,
    OtherRow,
    PhaseRow,
    PlaceRow,
    RearRow,
    SignalRow,
    WayRow,
)

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]
Codes = NDArray[np.int32]


class VehicleRow:
    """A vehicle. Leg ``j`` of its endless way is leg ``j % legs`` of its loop in lap ``j // legs``.

    It holds the legs `tail` to `granted`, and the crossings behind the legs `crossed` to ``granted - 1``.
    The columns that are read in each step come first, near each other: a step of the simulator in between
    leaves nothing in the processor's caches.

    Attributes
    ----------
    name, loop, lap_m
        Its name and that of its loop, by number; length of a lap [m].
    length_m, top, haste, accel, decel
        Length [m], top speed [m/s], at how many times the limits it may drive, if that is more than one;
        acceleration and deceleration [m/s2].
    offset, front, speed
        What to add to the odometer, and the resulting front [m] and speed [m/s].
    moved_m
        By how much arc lengths on its way now are more than on its ways so far in one line [m].
    note_m, rear_m, line_m, held_m
        Where the next edge, lap or leg begins at the earliest; where something is to be given back; where the
        last granted leg ends; where it is held, infinity if it is not [m].
    next_lap_m, laps
        Front at which the next lap ends [m], laps so far.
    road_at, roads, road, road_lap, pivot
        Where its edges are in the table of roads, and how many; the next of them and the lap it lies in; on
        which the simulator renews its route.
    leg_at, legs
        Where its legs are in the table of legs, and how many.
    entered, granted, tail, crossed
        The leg of the front, and what it holds; see above.
    trespassing, held, steered, asking
        Whether the front was past its line, whether it is to stop there, whether it is steered (see
        `Steering`), whether it has to be told when it must ask.
    halted_s, hold_s, stood_s, longest_s
        When it came to rest, not a number if it has not; time at rest so far, time at which it stood at all,
        longest time from asking to a grant [s].
    foreseen
        Whether it can be told when it will be past a crossing.
    heeds_renewal
        Whether something is to be done when its route is renewed, also where it is not to stop.
    pending, since_s, reason, stage, looked_at, asked_at_s, decided, going
        Whether it has a request, since when [s]; why that was refused last, and the word for the gate's stage
        by number; the version of the books when it was last looked at; when the gate was last asked [s], and
        whether it ever was; whether it has been granted, but not been told.
    mover, named_s, barred
        Whether it must move next, for one that is served, since when on end [s], and whether a light or
        ordinary traffic is in its way, or a grant is withheld.
    withheld
        The reason by which the caller withholds any grant from it, by number, `NOTHING` for none.
    aside
        Whether it has stepped aside, and is not back on the road: then it asks for nothing.
    turned
        Whether it is served, and its service has come to a circle.
    stop_m, parks
        Where its front stands at the next stop of its own [m], infinity for none; whether it leaves its lane
        for that.
    red_since_s
        Since when it is refused for a light [s], not a number if it is not.
    lit
        How many passes of its endless way lie behind it, up to the first light that it was let go towards and
        whose line it is not over.
    committed, stood_at, heedless
        At which of the lights between there and its last granted leg it drives on whatever they show, and at
        which of them it has stood, one bit each; and whether the simulator lets it drive on at the first.
    yields_s, kept_mps, clear, first, stands_s, freed
        Of one that has its grant, among ordinary traffic (`loopgate.drive.yielding`): since when it has been
        before a junction with somebody in its way [s]; how fast it may drive, if it is kept out of that
        [m/s]; on which movement nobody came when it was looked last, until it is past that; whether it goes
        on inside where it would be in the way if it waited; since when it has stood at its line with nobody
        in its way [s]; and on which movement it goes without giving way, since it did for too long.
    spare_s
        For how long its request may be passed over so that it falls back to the middle between its neighbours
        on its loop [s]; below 0 it is behind that already, and others soon let it pass.
    """

    offset: float
    front: float
    speed: float
    note_m: float
    rear_m: float
    line_m: float
    held_m: float
    decel: float
    top: float
    accel: float
    moved_m: float
    trespassing: bool
    asking: bool
    held: bool
    steered: bool
    stood_s: float
    road_at: int
    roads: int
    road: int
    granted: int
    leg_at: int
    legs: int
    pending: bool
    decided: bool
    going: bool
    mover: bool
    since_s: float
    reason: int
    looked_at: int
    stop_m: float
    spare_s: float
    red_since_s: float
    lit: int
    committed: int
    stood_at: int
    heedless: bool
    asked_at_s: float
    tail: int
    crossed: int
    entered: int
    halted_s: float
    length_m: float
    road_lap: int
    lap_m: float
    next_lap_m: float
    laps: int
    pivot: int
    heeds_renewal: bool
    foreseen: bool
    loop: int
    haste: float
    name: int
    stage: int
    hold_s: float
    longest_s: float
    named_s: float
    parks: bool
    barred: bool
    withheld: int
    aside: bool
    turned: bool
    yields_s: float
    kept_mps: float
    clear: int
    first: bool
    stands_s: float
    freed: int


class RoadRow:
    """Where an edge of a loop begins [m], its name by number, and how long vehicles have stood on it [s]."""

    begin_m: float
    name: int
    stood_s: float


class LegRow:
    """A leg: the stretch of its loop, what the longest vehicle needs there, and what is behind it.

    That is its state, whether guides follow, and the passes.
    """

    begin_m: float
    end_m: float
    slot_m: float
    state: int
    pinned: bool
    pass_at: int
    pass_end: int


class PassRow:
    """A crossing behind a leg: its movement, lowest limit [m/s], `Crossing.wait_m`, and its foes.

    Then its signal, or `NOBODY` where no light is obeyed, and where that is on the loop [m].
    """

    movement: int
    speed_mps: float
    wait_m: float
    foe_at: int
    foe_end: int
    signal: int
    light_m: float


class FoeRow:
    """A foe of a pass: its movement, and the stretch that both use, as `Crossing.overlaps` has it [m].

    Not a number where there is none: the foe is in the way all along. Then the least time at the limits from
    the end of the leg to that stretch [s], the lowest limit on the way there, and the mean speed as far as
    its end [m/s].
    """

    movement: int
    from_m: float
    to_m: float
    soonest_s: float
    least_mps: float
    mean_mps: float


class StateRow:
    """A state.

    Attributes
    ----------
    room, word, fifo, shut
        How many vehicles it holds, its name by number, whether it is shared and left in order, and whether
        nobody is let into it just now.
    most
        How many vehicles there is room for in each of these two lists.
    holders, held_by
        Where in the lists the vehicles are that hold it, in the order in which they took it, and how many.
    line, queue
        Where in the lists the vehicles are whose last granted leg is in it, head first, and how many.
    filled
        The turn of deciding in which a grant last took a slot of it.
    slot, slot_before
        The vehicle its last slot is kept for, or `NOBODY`, now and before.
    short
        The turn in which its head was last found to lack a slot.
    outside
        How many wait to depart into it.
    served, mover
        The vehicle that is served for whose sake it was looked at, and the one that alone may enter it, or
        `NOBODY`.
    """

    room: int
    word: int
    fifo: bool
    shut: bool
    most: int
    holders: int
    held_by: int
    line: int
    queue: int
    filled: int
    slot: int
    slot_before: int
    short: int
    served: int
    outside: int
    mover: int


class MoveRow:
    """A movement over a junction.

    Attributes
    ----------
    passing, under_way, most
        Where in the lists the vehicles are that are under way on it, how many, and how many have room there.
    entered
        The turn of deciding in which a grant last led over it.
    way
        The vehicle it is kept clear for, or `NOBODY`.
    beside
        The next movement out of the same place; from each to the next, one comes back to the first.
    """

    passing: int
    under_way: int
    most: int
    entered: int
    way: int
    beside: int


class ReasonRow:
    """A reason: its word by number, and how often it was given for a refusal."""

    word: int
    refused: int


class EntryRow:
    """The n-th entry of each of these lists of vehicles.

    Attributes
    ----------
    waiting
        Those with a request, oldest first.
    ready, weight
        Those whose request is to be decided, and by what they are sorted.
    staying
        Those asked by the negotiation to wait.
    answered
        Those with an answer that they have not been told.
    """

    waiting: int
    ready: int
    weight: float
    staying: int
    answered: int


class DriveRow:
    """The one row about the run: its clock and its settings, how long the lists are, and words by number.

    Attributes
    ----------
    now_s, step_s
        Simulated time, and length of a step [s].
    foresees, yields
        Whether one on a shared stretch is out of the way if it will have left it in time, and whether all
        keep the simulator's right of way too.
    at_once
        Whether nothing outside of the system but lights can stop one that has been let go.
    alone
        Whether vehicles decide by themselves, so that nothing is kept for anybody here.
    crowded, patience_s, wait_s
        Of `Pressure`, where that is compiled.
    serve_after_s
        The age of a request from which on it is served [s], infinity for never.
    version, grants, turn, decided_s
        Of the books, which grows with all that may lift a refusal; grants and turns of deciding so far, and
        when the last turn was [s].
    waiting, fresh, answers, staying, late, serving
        Length of these lists; the last `fresh` of those waiting have not been looked at, for `late` of
        them something is kept, and so many are served.
    rows, acts, lost
        How many there are, and how many found no room.
    overruns, trespasses, decisions
        So far; decisions of the chain rule only.
    steps, standing, ended, driven_m
        Steps so far, how many vehicles stood in them, laps that ended, and how far all have driven [m], since
        somebody last took these figures.
    counts_from_s
        From when on standing counts for vehicles and edges [s].
    granted
        How many grants there had been when requests were last collected.
    others, seen, rears, arrivals
        Length of these lists of ordinary traffic: those read, those seen on the road.
    marks, found
        How often marks have been renewed; how many of them a question was about.
    let_go, stood, stood_s, on_red
        How many lights vehicles were let go towards, at how many of these they stood, for how long [s], and
        over how many lines they drove on red.
    red_s, red_since_s, red_at, looked_s
        The longest wait for a light, as far as it is known, since when [s] and before which signal; and when
        vehicles before lights were looked at last [s].
    edge, lap, enter, leave, hold, go, grant, refuse, overrun, not_granted, chain
        Words for the trace.
    """

    now_s: float
    step_s: float
    foresees: bool
    yields: bool
    at_once: bool
    alone: bool
    crowded: float
    patience_s: float
    wait_s: float
    serve_after_s: float
    version: int
    grants: int
    turn: int
    decided_s: float
    waiting: int
    fresh: int
    answers: int
    staying: int
    late: int
    serving: int
    rows: int
    acts: int
    lost: int
    overruns: int
    trespasses: int
    decisions: int
    steps: int
    standing: int
    ended: int
    driven_m: float
    counts_from_s: float
    granted: int
    others: int
    seen: int
    rears: int
    arrivals: int
    marks: int
    found: int
    let_go: int
    stood: int
    stood_s: float
    on_red: int
    red_s: float
    red_since_s: float
    red_at: int
    looked_s: float
    edge: int
    lap: int
    enter: int
    leave: int
    hold: int
    go: int
    grant: int
    refuse: int
    overrun: int
    not_granted: int
    chain: int


class Tables(NamedTuple):
    """All tables, and lists that they point into.

    Those of lights and of ordinary traffic are None where there are none: then nothing of them is compiled.

    Attributes
    ----------
    rows, times
        For the trace, until they are taken: vehicle, event, place, reason and stage by number; when [s].
    acts
        What is to be done to vehicles after this step: vehicle, which act (`loopgate.drive.codes`), the leg
        granted to it.
    calls
        Room for `loopgate.drive.sense`: vehicle, and some of its constants, added up.
    fronts
        How far vehicles are on their ways, by vehicle, as on ways that were never changed [m].
    lists
        Lists of vehicles.
    numbers
        The numbers of the last grants to each vehicle, by leg modulo how many are kept.
    letters
        What lights show, SUMO's letters by their codes, one for each link.
    edges, lanes, links, junctions, others, rears, arrivals, routes
        Of ordinary traffic (`loopgate.drive.around`): the roads, and where it is. The routes of the vehicles,
        each one after the other: edges, and the junctions behind them, `NOBODY` for none.
    ways, crossed, across, approaches, places, way_at, lane_lists
        And where it can be in the way of the gated vehicles: where the legs of each loop are among the ways,
        by the word for the loop; lists of lanes.
    """

    run: Sequence[DriveRow]
    vehicles: Sequence[VehicleRow]
    roads: Sequence[RoadRow]
    legs: Sequence[LegRow]
    passes: Sequence[PassRow]
    foes: Sequence[FoeRow]
    states: Sequence[StateRow]
    moves: Sequence[MoveRow]
    reasons: Sequence[ReasonRow]
    entries: Sequence[EntryRow]
    rows: Codes
    times: Floats
    acts: Numbers
    calls: Numbers
    fronts: Floats
    lists: Numbers
    numbers: Numbers
    signals: Sequence[SignalRow]
    lights: Sequence[LightRow]
    phases: Sequence[PhaseRow]
    letters: Numbers
    edges: Sequence[EdgeRow]
    lanes: Sequence[LaneRow]
    links: Sequence[LinkRow]
    junctions: Sequence[JunctionRow]
    others: Sequence[OtherRow]
    rears: Sequence[RearRow]
    arrivals: Sequence[ArrivalRow]
    routes: Numbers
    ways: Sequence[WayRow]
    crossed: Sequence[CrossedRow]
    across: Sequence[AcrossRow]
    approaches: Sequence[ApproachRow]
    places: Sequence[PlaceRow]
    way_at: Numbers
    lane_lists: Numbers
