"""What a run says of itself: each figure of ``summary.json``, its words, and its rows for a person."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from loopgate.errors import ResultsError
from loopgate.reading import counted, refusing
from loopgate.results.columns import NOT_GATED, STRANGE
from loopgate.results.headings import clock

Summary = Mapping[str, Any]
"""The content of ``summary.json``."""

Rows = list[tuple[str, str]]
"""Rows of a table: name, and value with its unit."""

_DISTRICTS = 10

_WHOSE = {"ordinary": ", of ordinary traffic alone", "both": ", of gated and ordinary ones together"}


class Figure(NamedTuple):
    """Figures of ``summary.json`` that belong together.

    `keys`: their keys, with blanks between. `means`: the words of the reference, in Markdown, with units;
    empty where another figure says them. `rows`: returns their rows for a person; None for none. `holds`: the
    Arrow type of a single figure that is a column of a sweep too, where `loopgate.results.columns` has no
    constant for it.
    """

    keys: str
    means: str
    rows: Callable[[Summary], Rows] | None = None
    holds: str = ""


def summary_rows(summary: Summary) -> Rows:
    """Return the rows of the table: name, and value with its unit.

    Raises `ResultsError` if the summary lacks a figure, or holds what no run has.
    """
    with refusing("summary.json", "summary of a run", ResultsError, wrong=STRANGE):
        return [row for figure in FIGURES if figure.rows is not None for row in figure.rows(summary)]


def _mishaps(summary: Summary) -> Rows:
    known = summary["collisions"] is not None
    return [
        (
            "collisions, teleports",
            f"{summary['collisions']}, {summary['teleports']}" if known else "not known",
        )
    ]


def _vehicles(summary: Summary) -> Rows:
    on = f" on {counted(summary['loops'], 'loop')}" if summary["loops"] else ""
    return [("vehicles", f"{summary['vehicles']}{on}")]


def _measured(summary: Summary) -> Rows:
    return [("time measured", f"{summary['duration_s']:.0f} s")]


def _driven(summary: Summary) -> Rows:
    return [
        *([("laps", f"{summary['laps']}")] if summary["loops"] else []),
        ("distance", f"{summary['distance_km']:.1f} km"),
        ("mean speed", f"{summary['mean_speed_mps']:.2f} m/s"),
        ("throughput", _throughput(summary)),
    ]


def _hold(summary: Summary) -> Rows:
    if summary["audit"] == NOT_GATED:
        return []
    text = f"{summary['hold_s']:.0f} s in all, longest wait {summary['longest_wait_s']:.0f} s"
    return [("hold time", text)]


def _promise(summary: Summary) -> Rows:
    promise = summary.get("promise")
    return [("promise", f"{promise}, as long as {summary['promise_if']}")] if promise else []


def _decisions(summary: Summary) -> Rows:
    if not summary["decisions"]:
        return []
    reasons = ", ".join(f"{reason} {count}" for reason, count in summary["refusals"].items())
    return [("decisions", f"{summary['decisions']}"), ("refusals", reasons or "none")]


def _decision_time(summary: Summary) -> Rows:
    if not summary["decisions"]:
        return []
    took = summary["decision_us"]
    text = f"median {took['median']:.0f} us, p99 {took['p99']:.0f} us, max {took['max']:.0f} us"
    return [("decision time", text)]


def _wall(summary: Summary) -> Rows:
    wall = summary["wall_s"]
    ahead = f"looking ahead {wall['ahead']:.1f} s, " if wall.get("ahead") else ""
    text = f"SUMO {wall['sumo']:.1f} s, gate {wall['gate']:.1f} s, {ahead}total {wall['total']:.1f} s"
    return [("wall time", text)]


def _throughput(summary: Summary) -> str:
    """Say how much was driven per hour; of a run that stopped at its deadlock over both times."""
    laps = f"{summary['laps_per_h']:.1f} laps/h, " if summary["loops"] else ""
    text = f"{laps}{summary['km_per_h']:.1f} vehicle-km/h"
    cut = summary.get("truncated")
    if not cut:
        return text
    return f"{text} until the deadlock; {cut['km_per_h']:.1f} over the {cut['asked_s']:.0f} s asked for"


def _standing(summary: Summary) -> Rows:
    """Return the row about time standing, where it is known as a share."""
    if "stood_share" not in summary:
        return []
    until = ", until the deadlock" if summary.get("truncated") else ""
    text = f"{summary['stood_s']:.0f} s, {summary['stood_share']:.0%} of vehicle time{until}"
    if vehicle := summary.get("longest_stood"):
        text += f"; longest {summary['longest_stood_s']:.0f} s ({vehicle})"
    return [("time standing", text)]


def _longest_wait(summary: Summary) -> Rows:
    """Return the row with the causes of the longest wait, if a vehicle waited."""
    wait = summary.get("longest_wait")
    if not wait:
        return []
    parts = ", ".join(f"{cause} {time_s:.0f} s" for cause, time_s in wait["by_cause_s"].items())
    on = f" ({wait['street']})" if wait.get("street") else ""
    return [("longest wait", f"{wait['vehicle']} for {wait['place']}{on}: {parts}")]


def _trips(summary: Summary) -> Rows:
    """Return the rows about trips, if there are trips."""
    if "trips" not in summary:
        return []
    mean, loss, depart = (summary[f"mean_{name}_s"] for name in ("delay", "time_loss", "depart_delay"))
    worst = f"{summary['worst_delay_s']:.0f} s ({summary['worst_trip']})"
    return [
        ("trips", f"{summary['arrived']} arrived, {summary['unfinished']} unfinished"),
        ("delay of trips", f"mean {mean:.1f} s: {loss:.1f} under way, {depart:.1f} to depart; worst {worst}"),
    ]


def _blocked(summary: Summary) -> Rows:
    """Return the row about places that were closed or blocked, if there are any."""
    standing = summary.get("standing")
    if not standing or not standing["blocked"]:
        return []
    when = clock if summary.get("begins_s") else lambda time_s: f"{time_s:.0f} s"
    told = (
        f"{one.get('street') or one['place']} ({one['why']}) from {when(one['from_s'])}"
        + (f" to {when(one['to_s'])}" if one["to_s"] is not None else " on")
        for one in standing["blocked"]
    )
    text, *more = dict.fromkeys(told)  # a street has many lanes
    others = f", and {len(more)} more" if more else ""
    return [("blocked", f"{text}{others}; {counted(standing['led_round'], 'vehicle')} led round")]


def _stops_made(summary: Summary) -> Rows:
    """Return the row about stops, if there are any."""
    stops = summary.get("stops")
    if not stops:
        return []
    missed = f", {stops['missed']} missed" if stops["missed"] else ""
    return [("stops", f"{stops['served']} made, {stops['stopped_s']:.0f} s in all{missed}")]


def _departures(summary: Summary) -> Rows:
    """Return the row about later departures, if there are any."""
    if "departed" not in summary:
        return []
    mean_s, max_s = summary["mean_depart_delay_s"], summary["max_depart_delay_s"]  # of trips, if any
    waiting = summary["waiting_to_depart"]
    later = f", {waiting} still wait to" if waiting else ""
    text = f"{summary['departed']} under way, delay mean {mean_s:.0f} s, longest {max_s:.0f} s{later}"
    return [("departures", text)]


def _lights(summary: Summary) -> Rows:
    """Return the row about obeyed lights, if they were obeyed."""
    lights = summary.get("at_lights")
    if not lights:
        return []
    stood = f"{lights['stood']} with a grant stood at a red, {lights['stood_s']:.0f} s in all"
    if lent := lights.get("lent"):
        stood += f", {lent} times others went over the crossing first"
    text = f"{lights['grants']} grants into green; {stood}; longest red {lights['longest_red_s']:.0f} s"
    return [("lights", text)]


def _lane_choice(summary: Summary) -> Rows:
    """Return the row about trips that took other lanes than planned, if any could."""
    chosen = summary.get("lane_choice", {})
    if not any(chosen.values()):
        return []
    text = f"{counted(chosen['at_departure'], 'trip')} departed on other lanes than planned"
    return [("lane choice", f"{text}; on the way lanes were chosen anew {chosen['on_the_way']} times")]


def _others(summary: Summary) -> Rows:
    """Return the rows about ordinary traffic, if there is any."""
    others = summary.get("others")
    if not others:
        return []
    seen = f"{counted(others['vehicles'], 'ordinary vehicle')}; " if "vehicles" in others else ""
    said = f"{seen}{counted(others['collisions'], 'collision')} between them"
    if judged := len(others.get("verdicts", ())):
        erred = f"the ordinary driver erred in {summary['collisions_by_others']}"
        said += f", {judged} with gated vehicles; {erred}"
    rows = [("other traffic", said)]
    return [*rows, ("promise", others["promise"])] if "promise" in others else rows


def _messages(summary: Summary) -> Rows:
    """Return the rows about messages, if vehicles decided by them."""
    found = summary.get("by_messages")
    if not found:
        return []
    kinds = ", ".join(f"{kind} {many}" for kind, many in found["by_kind"].items())
    sizes = ", ".join(f"{kind} {many}" for kind, many in found["bytes_by_kind"].items())
    sizes = f"{found['bytes']}, {found['bytes_per_move']:.0f} for each move: {sizes}"
    why = ", ".join(f"{reason} {many}" for reason, many in found["refused"].items()) or "none"
    other = sum(found["central_otherwise"].values())
    lost = f"{found['lost']} lost, {found['too_far']} too far; longest way {found['longest_m']:.0f} m"
    return [
        (
            "messages",
            f"{found['messages']}, {found['per_move']:.2f} for each of {found['moves']} moves; {lost}",
        ),
        ("messages by kind", kinds),
        ("bytes by kind", sizes),
        ("refused by posts", f"{why}; {other} of them a central gate would have granted"),
    ]


def _spacing(summary: Summary) -> Rows:
    """Return the row about even spacing, if spacing was on."""
    done = {"hold": "gates hold vehicles that are ahead", "advice": "each vehicle is told a speed"}
    said = done.get(summary.get("spacing", "none"))
    return [("spacing", said)] if said else []


def _drivers(summary: Summary) -> Rows:
    """Return the row about drivers, if machines drove."""
    machine = summary.get("drivers") == "machine"
    return [("drivers", "machines: no dawdling, one desired speed, short headway")] if machine else []


def _strange(summary: Summary) -> Rows:
    """Return the row about vehicles that broke a refusal, in a gated run."""
    if summary.get("clean") is None:
        return []
    return [("overruns, trespasses", f"{summary['overruns']}, {summary['trespasses']}")]


def closed_at_s(deadlock: Mapping[str, Any]) -> float:
    """Return when the circle of a deadlock closed [s]; folders before 0.2 know only when it was noticed."""
    return float(deadlock["closed_at_s"] if "closed_at_s" in deadlock else deadlock["at_s"])


def _deadlocks(summary: Summary) -> Rows:
    return [("deadlocks", _deadlock_text(summary["deadlocks"]))]


def _deadlock_text(found: Sequence[Mapping[str, Any]]) -> str:
    if not found:
        return "none"
    first = found[0]
    whose = _WHOSE.get(first.get("by", ""), "")
    size = len(first["vehicles"])
    came = f", {first['last']['vehicle']} the last to come" if "last" in first else ""
    closed = f"the first closed at {closed_at_s(first):.0f} s"
    behind = first.get("held_up", size) - size
    more = f", {behind} behind it" if behind else ""
    return f"{len(found)}; {closed}, {size} vehicles in a circle{whose}{more}{came}"


def _roots(summary: Summary) -> Rows:
    """Return the row about vehicles that others stand behind, if there are any."""
    found = summary.get("roots")
    if not found:
        return []
    first = found[0]
    more = f"; {len(found) - 1} more such vehicles" if len(found) > 1 else ""
    text = (
        f"{first['vehicle']} on {first['lane']} since {first['since_s']:.0f} s ({first['why']}), "
        f"{first['behind']} behind it{more}"
    )
    return [("stands by itself", text)]


def _starving(summary: Summary) -> Rows:
    """Return the row about starved vehicles, if there are any."""
    sinks = summary.get("starving")
    if not sinks:
        return []
    most = max(sinks, key=lambda sink: len(sink["vehicles"]))
    count = len({vehicle for sink in sinks for vehicle in sink["vehicles"]})
    first = most["behind"] in most["vehicles"]  # it waits itself, and is the first of those that do
    behind = (
        f"{'with' if first else 'behind'} {most['behind']} on {most['lane']}"
        if most["behind"]
        else "at gates"
    )
    who = (
        f", {len(most['vehicles'])} {behind}"
        if count > 1 or not first
        else f", {most['behind']} on {most['lane']}"
    )
    text = f"{counted(count, 'vehicle')}{who} ({most['why']})"
    return [("starving", f"{text}, noticed at {most['noticed_s']:.0f} s")]


def _coverage(summary: Summary) -> Rows:
    if not summary["loops"]:
        return []
    edges, lane_km = summary["coverage_edges"] or 0.0, summary["coverage_lane_km"] or 0.0
    return [("coverage", f"loops reach {edges:.0%} of the network's edges, {lane_km:.0%} of its lane-km")]


def _idleness(summary: Summary) -> Rows:
    return [("idleness on loops", _idleness_text(summary))] if summary["loops"] else []


def _idleness_text(summary: Summary) -> str:
    if summary["idleness_s"] is None:
        return "nothing measured"
    mean, worst, never = summary["idleness_s"], summary["worst_idleness_s"], summary["unvisited_edges"]
    text = f"mean {mean:.0f} s, worst {worst:.0f} s (edge {summary['worst_idleness_edge']}"
    text += f", {summary['worst_idleness_street']})" if summary.get("worst_idleness_street") else ")"
    return f"{text}, {never} edge{'s' if never != 1 else ''} never visited" if never else text


def _seen(summary: Summary) -> Rows:
    """Return the row about which streets were seen, also streets on no loop, if they were measured."""
    watch = summary.get("watch") or {}
    if not watch:
        return []
    never = watch["never_seen"]
    text = f"{watch['streets'] - never} of {counted(watch['streets'], 'street')} seen"
    if watch["worst_idleness_of_seen_s"] is not None:
        text += f"; the worst of these {watch['worst_idleness_of_seen_s']:.0f} s"
    if never:
        missed = min(never, summary["unvisited_edges"] or 0)
        why = (
            [f"{never - missed} {'is' if never - missed == 1 else 'are'} on no loop"]
            if never > missed
            else []
        )
        why += [f"no vehicle came to {missed} on loops"] if missed else []
        why = why if summary["loops"] else ["no vehicle came"]
        text += f"; {never} never, because {' and '.join(why)}"
    return [("streets", text)]


def _watch(summary: Summary) -> Rows:
    """Return the rows about all streets, also streets on no loop, if they were measured."""
    watch = summary.get("watch")
    if not watch:
        return []
    rows = []
    if watch["headway_cv"] is not None:
        text = f"coefficient of variation {watch['headway_cv']:.2f}, {watch['bunched']:.0%} bunched"
        rows.append(("revisit intervals", text))
    if "bound_s" in watch and watch["within_of_seen"] is not None:
        broken = [f"{_named(row)} {row['worst_idleness_s']:.0f} s" for row in watch["broken"][:3]]
        promise = f"kept {watch['within_of_seen']:.1%} of the time, over seen streets"
        worst = f"; broken on {watch['streets_over']}, worst: {', '.join(broken)}" if broken else ""
        rows.append((f"seen every {watch['bound_s']:g} s", promise + worst))
    for row in watch.get("districts", ())[:_DISTRICTS]:
        never = f", {row['never_seen']} never seen" if row["never_seen"] else ""
        text = f"{counted(row['streets'], 'street')}{never}; idleness mean {row['idleness_s']:.0f} s"
        rows.append((f"in {row['district']}", f"{text}, worst {row['worst_idleness_s']:.0f} s"))
    return rows


def _named(row: Mapping[str, Any]) -> str:
    return f"{row['street']} ({row['edge']})" if row["street"] else str(row["edge"])


def _audit(summary: Summary) -> Rows:
    audit = summary["audit"]
    text = audit if isinstance(audit, str) else f"{len(audit)} findings, the first: {audit[0]}"
    return [("audit", text)]


FIGURES: Final[tuple[Figure, ...]] = (
    Figure(
        "network abstraction gate negotiation decide lights spacing drivers starts seed vehicles loops",
        "the scenario",
        _vehicles,
    ),
    Figure(
        "duration_s",
        "measured simulated time [s]; shorter after a deadlock",
        _measured,
    ),
    Figure(
        "begins_s",
        "begin of the simulation [s]; times in the trace are SUMO's",
    ),
    Figure(
        "outcome",
        "`done`, `starving`, `deadlock` or `interrupted`",
    ),
    Figure(
        "laps distance_km mean_speed_mps laps_per_h km_per_h",
        "laps, distance, speed, throughput",
        _driven,
    ),
    Figure(
        "stood_s stood_share",
        "time slower than 0.1 m/s [s], and its share of all vehicle time",
        _standing,
    ),
    Figure(
        "longest_stood_s longest_stood",
        "longest time for which a vehicle stood at once, for whatever cause [s]; the vehicle",
    ),
    Figure(
        "truncated",
        "after a deadlock: the duration asked for (`asked_s` [s]) and the throughput over it (`km_per_h`)",
    ),
    Figure(
        "hold_s longest_wait_s",
        "hold time of all vehicles; longest time from request to grant [s]: of the first vehicle "
        "in a line, since only the first asks",
        _hold,
    ),
    Figure(
        "longest_wait",
        "the longest wait: `vehicle`, `place` it waited for and its `street`, `since_s`, `by_cause_s` "
        "(seconds for each reason), or `null`",
        _longest_wait,
    ),
    Figure(
        "longest_waits_s",
        "longest wait for each reason [s]",
    ),
    Figure(
        "vehicles_without_a_lap",
        "vehicles without a completed lap",
    ),
    Figure(
        "trips arrived unfinished mean_time_loss_s mean_delay_s worst_delay_s worst_trip "
        "mean_waiting_s mean_trip_s",
        "with [trips](any-traffic.md#figures)",
        _trips,
    ),
    Figure(
        "stops",
        "with [stops](stops.md): numbers `served`, `missed`, `under_way`; time at stops "
        "(`stopped_s`) and parked beyond the stop (`late_back_s`, `longest_late_back_s`) [s]",
        _stops_made,
    ),
    Figure(
        "departed waiting_to_depart mean_depart_delay_s max_depart_delay_s",
        "with later [departures](stops.md#departures): vehicles, and the delay [s]",
        _departures,
    ),
    Figure(
        "standing",
        "`blocked` places with `street`, `why`, `vehicle`, `from_s`, `to_s` and `unwatched` streets; "
        "vehicles `led_round`, in how many `turns`; loops with `no_way_round`",
        _blocked,
    ),
    Figure(
        "rerouting",
        "with [rerouting](any-traffic.md#led-another-way): `vehicles`, `rerouted` vehicles, `times`",
    ),
    Figure(
        "lane_choice",
        "trips that took [other lanes than planned](any-traffic.md#what-is-read): how many `at_departure`, "
        "how often `on_the_way`",
        _lane_choice,
    ),
    Figure("spacing", "", _spacing),
    Figure("drivers", "", _drivers),
    Figure(
        "coverage_edges coverage_lane_km",
        "share of passenger edges, and of their lane length, on loops",
        _coverage,
    ),
    Figure("watch", "", _seen),
    Figure(
        "idleness_s worst_idleness_s worst_idleness_edge worst_idleness_street",
        "mean and worst [idleness](methods.md#of-a-watched-district) of the edges on loops [s], "
        "and the worst edge with its street",
        _idleness,
    ),
    Figure(
        "unvisited_edges",
        "edges on loops that no vehicle entered",
    ),
    Figure("watch", "all streets together, and each district", _watch),
    Figure(
        "deadlocks",
        "when each circle closed (`closed_at_s`) and was noticed (`noticed_at_s`); its `vehicles` "
        "in order, the `places` that they want, the vehicles `held_up`. With ordinary traffic the "
        "cause (`by`: `gated`, `ordinary` or `both`), and the vehicle that came `last`",
        _deadlocks,
    ),
    Figure(
        "roots",
        "vehicles in no deadlock that stood at the end for 300 s or more while no vehicle kept them back, "
        "with others behind them: `vehicle`, its `lane`, `since_s`, `why` (`breakdown`, `stop`, `gate`, "
        "`light`, `lane change`, `right of way` or `no reason known`), how many stand `behind`",
        _roots,
    ),
    Figure(
        "starving",
        "vehicles without a grant and within 100 m for 600 s: the vehicle ahead (`behind`), its "
        "`lane`, `why` it stands, `noticed_s`, `until_s`, `vehicles`",
        _starving,
    ),
    Figure(
        "collisions teleports",
        "as SUMO counts them",
        _mishaps,
    ),
    Figure(
        "collisions_by_others",
        "collisions in which an [ordinary driver erred](studies/queues.md#other-traffic)",
    ),
    Figure(
        "overruns trespasses",
        "held vehicles that passed their line; vehicles that entered a state without a grant",
        _strange,
    ),
    Figure(
        "strays",
        "vehicles led back from a lane outside their loop",
    ),
    Figure(
        "clean",
        "no collision, overrun, trespass or finding of the audit; `null` without a gate",
    ),
    Figure(
        "promise promise_if promise_of",
        "`everyone`, `somebody` or empty: who can always go on [as proved for such a run]"
        "(gates.md#what-certified-promises), empty with ordinary vehicles on the road; on which conditions; "
        "both in words",
        _promise,
    ),
    Figure(
        "decisions refusals stages messages",
        "answers of the gate; refusals by reason; answers by stage; messages between robots",
        _decisions,
    ),
    Figure(
        "decision_us",
        "`median`, `p99` and `max` of the time per decision [us]",
        _decision_time,
    ),
    Figure(
        "stage_us",
        "for each stage: `count` of decisions, `median`, `p99` and `max` of their time [us]",
    ),
    Figure(
        "wall_s",
        "wall time [s] of `sumo`, of the `gate` with the drive, before the first step "
        "(`prepared`), and in `total`",
        _wall,
    ),
    Figure(
        "by_messages",
        "with [`decide` vehicles](vehicles.md#on-the-road), warm-up included: range, loss and "
        "delay; `moves`, `messages` (transmissions), `per_move`, `by_kind`; their size as JSON: "
        "`bytes`, `bytes_per_move`, `bytes_by_kind`; messages `lost` at random, sent `too_far`, "
        "or `cut_off`; the longest distance (`longest_m` [m]); grants `given_back`, of these with "
        "an ended lease (`leases_over`); requests `refused` by reason, and of these granted by a "
        "central gate (`central_otherwise`); grants that a central gate refuses (`unsafe`, always "
        "0); the longest time without a move (`longest_still_s` [s]); on segments vehicles "
        "`found_per_decision`; with processes `processes`, `killed`, `started_again`, `datagrams`",
        _messages,
    ),
    Figure(
        "at_lights",
        "with lights obeyed: `grants` into green; vehicles that `stood` at red with a grant "
        "(`stood_s` [s]), and how often they [let others over the crossing first]"
        "(studies/queues.md#traffic-lights) (`lent`); vehicles that crossed a line `on_red`; "
        "the longest wait for green (`longest_red_s` [s], `longest_red_at`)",
        _lights,
    ),
    Figure(
        "others",
        "with ordinary traffic: `vehicles` seen, `collisions` among them, the remaining "
        "`promise`, and `verdicts`: for each collision with a gated vehicle `at_s`, `lane`, "
        "`gated`, `ordinary`, which vehicle `erred`, `why`, and both positions `before`",
        _others,
    ),
    Figure(
        "audit",
        "`clean`, the findings, or `not gated`",
        _audit,
    ),
    Figure(
        "audited",
        "checks made: `places`, `capacities`, `progress`, `entries`; with positions also "
        "`crossings`, `bodies`",
    ),
    Figure(
        "positions",
        "figures of [the audit](audit.md) of positions",
    ),
    Figure(
        "fault",
        "the fault of your own gate or negotiation that interrupted the run",
    ),
    Figure(
        "warnings versions command",
        "warnings, versions, and the command that repeats the run",
    ),
)
"""All figures, in the order in which a person reads them."""
