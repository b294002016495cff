"""Lights that are obeyed: grants into green only, and who drives on at amber.

A request is granted if the light at its line is open in the next step and even a slow driver is over the line
before it is red, as far as the light's program tells; where a crossing leads over several lights, each of the
others has to be green when the vehicle gets to it; but a light far ahead, as where nobody may wait on much of
a road, only stops it there. Who was granted that is *committed*, as SUMO's own drivers are who are too near
to brake: it drives on at amber. It stops for a red all the same if it still can; it then keeps what it was
granted while it stands there: the gate knew it there when it admitted others, so taking it back could undo
what was promised to them. What it was granted beyond such a light is no reason to drive on there: the first
light before it is what counts. How often vehicles stand so, and how often one crosses its line on red since
it could not brake, is counted.

Lights only delay, so what the gate promises holds as long as every light turns green again and again. Two
lights on one crossing need not be green together for that: after a while only the first one counts.
"""

from __future__ import annotations

import math
from typing import Final

from loopgate.drive.codes import HEED, HEEDLESS, NOBODY
from loopgate.drive.gaps import FAR_M, PATIENCE_S, leg_of
from loopgate.drive.motion import time_s
from loopgate.drive.sense import STANDING_MPS, act, braking_m
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, only_with, part

__all__ = ["OPEN", "keeps", "let_go", "look", "may_be_open", "next_letter", "red_at_s", "unread"]

OPEN: Final = tuple(map(ord, "GgoOs"))
"""Letters with which a vehicle may drive: green, lights off, and the green arrow."""

_AMBER: Final = tuple(map(ord, "yY"))
_RED: Final = tuple(map(ord, "ru"))

_ARROW: Final = ord("s")
_ARROW_STOP_S: Final = 3.0
"""SUMO's letter for a green arrow, before which a vehicle stops first, and the time that this takes [s]."""

_BEFORE_RED_S: Final = 1.0
"""So long before red a slow driver has to be over the line for a grant [s]."""

_SLOW_ACCEL: Final = 0.6
_SLOW_SPEED: Final = 0.9
_START_S: Final = 1.0
"""Drivers dawdle: what share of their acceleration and of the speed limit is counted on to reach a line in
time, and the time to get going [s]."""

_MOST: Final = 62
"""Of so many lights before a vehicle that was let go it is kept in mind what it does there: one bit each."""


@part
def _is_known(light: int, t: Tables) -> bool:
    """Return whether what was read of a light holds; a change due now is made in the next step."""
    return bool(t.lights[light].seen_s == t.run[0].now_s or t.run[0].now_s <= t.lights[light].changes_s)


@inner
def _pass_number(i: int, leg: int, t: Tables) -> int:
    """Return how many passes lie before a leg, all along the vehicle's endless way."""
    one = t.vehicles[i]
    first, last = t.legs[one.leg_at], t.legs[one.leg_at + one.legs - 1]
    lap, position = divmod(leg, one.legs)
    return int(lap * (last.pass_end - first.pass_at) + t.legs[one.leg_at + position].pass_at - first.pass_at)


@inner
def _pass_at(i: int, number: int, t: Tables) -> tuple[int, float]:
    """Return the row of a pass by its number, and where its light is on the vehicle's endless way [m]."""
    one = t.vehicles[i]
    first, last = t.legs[one.leg_at], t.legs[one.leg_at + one.legs - 1]
    lap, n = divmod(number, last.pass_end - first.pass_at)
    k = first.pass_at + n
    return int(k), float(lap * one.lap_m + t.passes[k].light_m)


@only_with("signals", otherwise=False)
def unread(t: Tables) -> bool:
    """Return whether lights have to be read before requests are answered, and mark these."""
    missing = False
    for i in range(len(t.vehicles) if len(t.signals) > 0 else 0):
        one = t.vehicles[i]
        for number in range(one.lit, _pass_number(i, one.granted + (1 if one.pending else 0), t)):
            signal = t.passes[_pass_at(i, number, t)[0]].signal
            if signal != NOBODY:
                light = t.signals[signal].light
                if not _is_known(light, t):
                    t.lights[light].unread = missing = True
    return missing


@inner
def _in_next_step(signal: int, t: Tables) -> tuple[int, int, float]:
    """Return letters and phase of a signal's light in the next step, and when it changes after that [s].

    That is certain where the program is fixed. Others are taken to end what they show as soon as they may:
    whoever counts on more stands at a red with its grant now and then, in the way of all others.
    """
    light, now_s = t.lights[t.signals[signal].light], t.run[0].now_s
    if light.fixed and light.changes_s <= now_s:
        phase = t.phases[light.phase].following
        return int(t.phases[phase].letters), int(phase), float(now_s + t.phases[phase].longest_s)
    return int(light.letters), int(light.phase), float(max(now_s, light.changes_s))


@inner
def next_letter(signal: int, t: Tables) -> int:
    """Return what a signal shows in the next step: a change that is due is made at its beginning."""
    return int(t.letters[_in_next_step(signal, t)[0] + t.signals[signal].link])


@inner
def red_at_s(signal: int, t: Tables) -> float:
    """Return when a signal turns red, after the rest of the green and the amber [s]; now if it is red."""
    link, phases = t.signals[signal].link, t.lights[t.signals[signal].light].phases
    letters, phase, change_s = _in_next_step(signal, t)
    red_s = t.run[0].now_s
    for _ in range(phases + 1):
        letter = t.letters[letters + link]
        if letter not in OPEN and letter not in _AMBER:
            return float(red_s)
        red_s = change_s
        if phases > 0:
            phase = t.phases[phase].following
            letters = t.phases[phase].letters
            change_s += t.phases[phase].longest_s
    return math.inf


@inner
def may_be_open(signal: int, from_s: float, to_s: float, t: Tables) -> bool:
    """Return whether a signal is open all the time between two times, as far as can be known.

    That is certain where the program is fixed. Of others, which change as the traffic does, only what they
    show now is known, and when at the latest they have to change.

    Parameters
    ----------
    signal
        Its number.
    from_s, to_s
        From now on [s]; 0 is now.
    t
        The tables.
    """
    link, light, now_s = t.signals[signal].link, t.lights[t.signals[signal].light], t.run[0].now_s
    open_now = t.letters[light.letters + link] in OPEN
    if light.phases == 0 or not (light.fixed or open_now):
        return open_now
    letters, phase = light.letters, light.phase
    left_s = light.changes_s - now_s
    if not light.fixed:
        left_s = t.phases[phase].longest_s - (light.spent_s + now_s - light.seen_s)
    for _ in range(light.phases + 1):
        if left_s > from_s and t.letters[letters + link] not in OPEN:
            return False
        if left_s >= to_s:
            return True
        phase = t.phases[phase].following
        letters = t.phases[phase].letters
        left_s += t.phases[phase].longest_s
    return True


@inner
def _slow_s(i: int, signal: int, distance_m: float, t: Tables) -> float:
    """Return how long a slow driver takes to a light [s]."""
    one = t.vehicles[i]
    top_mps = min(one.top, max(one.speed, t.signals[signal].speed_mps))
    return float(time_s(distance_m, one.speed, _SLOW_ACCEL * one.accel, _SLOW_SPEED * top_mps))


@inner
def _is_at_line(k: int, j: int, t: Tables) -> bool:
    """Return whether the light of pass `k` stands where vehicles are held on leg `j`, and not farther on."""
    return bool(k == t.legs[j].pass_at and t.passes[k].light_m - t.legs[j].end_m <= FAR_M)


@part
def _may_pass(i: int, k: int, j: int, t: Tables) -> bool:
    """Return whether the light of pass `k` is green when the vehicle gets there, set out now."""
    one, signal = t.vehicles[i], t.passes[k].signal
    distance_m = one.line_m - one.front + (t.passes[k].light_m - t.legs[j].end_m)
    slow_s = _slow_s(i, signal, distance_m, t)
    if _is_at_line(k, j, t):
        spare_s = _ARROW_STOP_S if next_letter(signal, t) == _ARROW else _BEFORE_RED_S
        return bool(t.run[0].now_s + slow_s + spare_s <= red_at_s(signal, t))
    fast_s = time_s(distance_m, one.speed, one.accel, one.top)
    return may_be_open(signal, fast_s, _START_S + slow_s, t)


@only_with("signals", otherwise=False)
def keeps(i: int, t: Tables) -> bool:
    """Return whether some light on the crossing before the vehicle does not let it pass, or not in time."""
    one, run, j, first = t.vehicles[i], t.run[0], leg_of(i, t.vehicles[i].granted, t), NOBODY
    patient = not run.now_s - one.red_since_s >= PATIENCE_S  # also where it has not waited
    closed, stops = False, False
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        signal = t.passes[k].signal
        if signal == NOBODY:
            continue
        if first == NOBODY:
            first = signal
            closed = _is_at_line(k, j, t) and next_letter(signal, t) not in OPEN
        near = t.passes[k].light_m - t.legs[j].end_m <= FAR_M
        stops = closed or (patient and near and not _may_pass(i, k, j, t))
        if stops:
            break
    if not stops:
        return False
    if math.isnan(one.red_since_s):
        one.red_since_s = run.now_s
    until_s = run.now_s
    if closed:
        until_s = max(until_s, t.lights[t.signals[first].light].changes_s - run.step_s)
    if until_s - one.red_since_s > run.red_s:
        run.red_s = until_s - one.red_since_s
        run.red_since_s, run.red_at = one.red_since_s, first
    return True


@only_with("signals", otherwise=None)
def let_go(i: int, j: int, t: Tables) -> None:
    """Take note that the vehicle has just been granted what is behind leg `j`."""
    one = t.vehicles[i]
    one.red_since_s = math.nan
    before = 0
    for number in range(one.lit, _pass_number(i, one.granted - 1, t)):
        before += t.passes[_pass_at(i, number, t)[0]].signal != NOBODY
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        signal = t.passes[k].signal
        if signal != NOBODY:
            t.run[0].let_go += 1
            if before < _MOST and _is_at_line(k, j, t) and next_letter(signal, t) != _ARROW:
                one.committed |= 1 << before
            before += 1


@part
def _may_close(signal: int, t: Tables) -> bool:
    """Return whether a signal may not be open in the next step.

    Where vehicles keep SUMO's right of way it counts as such all along: they look at others in another way if
    they are to drive on at red.
    """
    light = t.lights[t.signals[signal].light]
    due = t.run[0].yields or (not light.fixed and light.changes_s <= t.run[0].now_s)
    return bool(due or next_letter(signal, t) not in OPEN)


@part
def _stops(i: int, signal: int, left_m: float, t: Tables) -> bool:
    """Return whether a vehicle whose light has closed can still stop, and may be late if it does not."""
    one, run = t.vehicles[i], t.run[0]
    if left_m < braking_m(one.speed, one.decel, run.step_s):
        return False
    return bool(run.now_s + _slow_s(i, signal, left_m, t) > red_at_s(signal, t))


@part
def _look_at(i: int, signal: int, left_m: float, bit: int, counts: bool, t: Tables) -> None:  # noqa: FBT001  compiled
    """Look at a light before a vehicle that was let go, so many metres ahead."""
    one, run = t.vehicles[i], t.run[0]
    if next_letter(signal, t) in OPEN:
        return
    if one.committed & bit and _stops(i, signal, left_m, t):
        one.committed &= ~bit
    if counts and one.speed < STANDING_MPS:
        run.stood_s += run.step_s
        if not one.stood_at & bit:
            one.stood_at |= bit
            run.stood += 1


@only_with("signals", otherwise=False)
def look(t: Tables) -> bool:
    """Let vehicles stop for a red if they can, and count those who stand at one, once a step.

    SUMO is told who drives on when the light before it closes, and not before. Return whether lights have to
    be read before that. O(vehicles).
    """
    run = t.run[0]
    if len(t.signals) == 0:
        return False
    if unread(t):
        return True
    counts = run.looked_s != run.now_s
    run.looked_s = run.now_s
    for i in range(len(t.vehicles)):
        one, before, drives_on = t.vehicles[i], 0, False
        for number in range(one.lit, _pass_number(i, one.granted, t)):
            k, line_m = _pass_at(i, number, t)
            signal = t.passes[k].signal
            if signal != NOBODY and (before > 0 or one.front <= line_m):
                _look_at(i, signal, line_m - one.front, 1 << min(before, _MOST), counts, t)
                if before == 0:
                    drives_on = bool(one.committed & 1) and _may_close(signal, t)
                before += 1
            elif before == 0:
                one.lit = number + 1
                if signal != NOBODY:
                    letters = t.lights[t.signals[signal].light].letters
                    run.on_red += t.letters[letters + t.signals[signal].link] in _RED
                    one.committed >>= 1
                    one.stood_at >>= 1
        if drives_on != one.heedless:
            one.heedless = drives_on
            act(i, HEEDLESS if drives_on else HEED, t)
    return False
