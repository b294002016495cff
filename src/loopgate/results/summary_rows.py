"""The figures of a run in words, for terminal and notebook."""

from collections.abc import Mapping, Sequence
from typing import Any

from loopgate.errors import ResultsError
from loopgate.reading import counted, refusing
from loopgate.results.row_columns import NOT_GATED, STRANGE

_DISTRICTS = 10

_WHOSE = {"ordinary": ", of ordinary traffic alone", "both": ", of gated and ordinary ones together"}


def summary_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the rows of the table: name, and value with its unit.

    Raises `ResultsError` if the summary lacks a figure, or holds what no run has.
    """
    with refusing("summary.json", "summary of a run", ResultsError, wrong=STRANGE):
        return _rows(summary)


def _rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    decision = summary["decision_us"]
    wall = summary["wall_s"]
    rows = [
        (
            "vehicles",
            f"{summary['vehicles']}" + (f" on {summary['loops']} loops" if summary["loops"] else ""),
        ),
        ("time measured", f"{summary['duration_s']:.0f} s"),
        ("laps", f"{summary['laps']}"),
        ("distance", f"{summary['distance_km']:.1f} km"),
        ("mean speed", f"{summary['mean_speed_mps']:.2f} m/s"),
        ("throughput", _throughput(summary)),
        *_standing(summary),
        ("hold time", f"{summary['hold_s']:.0f} s in all, longest wait {summary['longest_wait_s']:.0f} s"),
        *_longest_wait(summary.get("longest_wait")),
        *_trips(summary),
        *_stops(summary),
        *_blocked(summary),
        *_spacing(summary),
        *_drivers(summary),
        ("coverage", _coverage(summary)),
        *_seen(summary),
        ("idleness on loops", _idleness(summary)),
        *_watch(summary.get("watch") or {}),
        ("deadlocks", _deadlocks(summary)),
        *_starving(summary.get("starving") or []),
        ("collisions, teleports", _mishaps(summary)),
        *_strange(summary),
        *(
            [("promise", f"{summary['promise']}, as long as no vehicle stands for good")]
            if summary.get("promise")
            else []
        ),
        ("decisions", f"{summary['decisions']}"),
        ("refusals", ", ".join(f"{k} {v}" for k, v in summary["refusals"].items()) or "none"),
        (
            "decision time",
            f"median {decision['median']:.0f} us, p99 {decision['p99']:.0f} us, max {decision['max']:.0f} us",
        ),
        ("wall time", f"SUMO {wall['sumo']:.1f} s, gate {wall['gate']:.1f} s, total {wall['total']:.1f} s"),
        *_messages(summary.get("by_messages")),
        *_surroundings(summary),
        ("audit", _audit(summary["audit"])),
    ]
    if summary["audit"] == NOT_GATED:
        rows = [row for row in rows if row[0] != "hold time"]
    if not summary["loops"]:
        rows = [row for row in rows if row[0] not in {"coverage", "idleness on loops", "laps"}]
    if not summary["decisions"]:
        rows = [row for row in rows if row[0] not in {"decisions", "refusals", "decision time"}]
    return rows


def _mishaps(summary: Mapping[str, Any]) -> str:
    """Say how many collisions and teleports there were, where that is known."""
    if summary["collisions"] is None:
        return "not known"
    return f"{summary['collisions']}, {summary['teleports']}"


def _throughput(summary: Mapping[str, Any]) -> str:
    """Say how much was driven per hour; of a run that stopped at its deadlock over both times."""
    laps = f"{summary['laps_per_h']:.1f} laps/h, " if summary["loops"] else ""
    text = f"{laps}{summary['km_per_h']:.1f} vehicle-km/h"
    cut = summary.get("truncated")
    if not cut:
        return text
    return f"{text} until the deadlock; {cut['km_per_h']:.1f} over the {cut['asked_s']:.0f} s asked for"


def _standing(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the row about time standing, where it is known as a share."""
    if "stood_share" not in summary:
        return []
    until = ", until the deadlock" if summary.get("truncated") else ""
    text = f"{summary['stood_s']:.0f} s, {summary['stood_share']:.0%} of vehicle time{until}"
    if vehicle := summary.get("longest_stood"):
        text += f"; longest {summary['longest_stood_s']:.0f} s ({vehicle})"
    return [("time standing", text)]


def _longest_wait(wait: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return the row with the causes of the longest wait, if a vehicle waited."""
    if not wait:
        return []
    parts = ", ".join(f"{cause} {time_s:.0f} s" for cause, time_s in wait["by_cause_s"].items())
    return [("longest wait", f"{wait['vehicle']} for {wait['place']}: {parts}")]


def _trips(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the rows about trips, if there are trips."""
    if "trips" not in summary:
        return []
    mean, loss, depart = (summary[f"mean_{name}_s"] for name in ("delay", "time_loss", "depart_delay"))
    worst = f"{summary['worst_delay_s']:.0f} s ({summary['worst_trip']})"
    return [
        ("trips", f"{summary['arrived']} arrived, {summary['unfinished']} unfinished"),
        ("delay of trips", f"mean {mean:.1f} s: {loss:.1f} under way, {depart:.1f} to depart; worst {worst}"),
    ]


def _blocked(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the row about places that were closed or blocked, if there are any."""
    standing = summary.get("standing")
    if not standing or not standing["blocked"]:
        return []
    first, *more = standing["blocked"]
    text = f"{first['place']} ({first['why']}) from {first['from_s']:.0f} s"
    others = f", and {len(more)} more" if more else ""
    return [("blocked", f"{text}{others}; {counted(standing['led_round'], 'vehicle')} led round")]


def _stops(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the rows about stops and departures, if there are any."""
    rows, stops = [], summary.get("stops")
    if stops:
        missed = f", {stops['missed']} missed" if stops["missed"] else ""
        rows.append(("stops", f"{stops['served']} made, {stops['stopped_s']:.0f} s in all{missed}"))
    if "departed" in summary:
        mean_s, max_s = summary["mean_depart_delay_s"], summary["max_depart_delay_s"]  # of trips, if any
        waiting = summary["waiting_to_depart"]
        later = f", {waiting} still wait to" if waiting else ""
        rows.append(
            (
                "departures",
                f"{summary['departed']} under way, delay mean {mean_s:.0f} s, longest {max_s:.0f} s{later}",
            )
        )
    return rows


def _surroundings(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the rows about obeyed lights and ordinary traffic, if there are any."""
    rows = []
    lights, others = summary.get("at_lights"), summary.get("others")
    if lights:
        stood = f"{lights['stood']} with a grant stood at a red, {lights['stood_s']:.0f} s in all"
        rows.append(
            (
                "lights",
                f"{lights['grants']} grants into green; {stood}; longest red {lights['longest_red_s']:.0f} s",
            )
        )
    if others:
        seen = f"{others['vehicles']} ordinary vehicles; " if "vehicles" in others else ""
        said = f"{seen}{others['collisions']} collisions between them"
        if judged := len(others.get("verdicts", ())):
            erred = f"the ordinary driver erred in {summary['collisions_by_others']}"
            said += f", {judged} with gated vehicles; {erred}"
        rows.append(("other traffic", said))
        if "promise" in others:
            rows.append(("promise", others["promise"]))
    return rows


def _messages(found: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return the rows about messages, if vehicles decided by them."""
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


def _spacing(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the row about even spacing, if spacing was on."""
    done = {"hold": "gates hold vehicles that are ahead", "advice": "each vehicle is told a speed"}
    said = done.get(summary.get("spacing", "none"))
    return [("spacing", said)] if said else []


def _drivers(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the row about drivers, if machines drove."""
    machine = summary.get("drivers") == "machine"
    return [("drivers", "machines: no dawdling, one desired speed, short headway")] if machine else []


def _strange(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the row about vehicles that broke a refusal, in a gated run."""
    if summary.get("clean") is None:
        return []
    return [("overruns, trespasses", f"{summary['overruns']}, {summary['trespasses']}")]


def closed_at_s(deadlock: Mapping[str, Any]) -> float:
    """Return when the circle of a deadlock closed [s]; folders before 0.2 know only when it was noticed."""
    return float(deadlock["closed_at_s"] if "closed_at_s" in deadlock else deadlock["at_s"])


def _deadlocks(summary: Mapping[str, Any]) -> str:
    found = summary["deadlocks"]
    if not found:
        return "none"
    first = found[0]
    whose = _WHOSE.get(first.get("by", ""), "")
    size = len(first["vehicles"])
    came = f", {first['last']['vehicle']} the last to come" if "last" in first else ""
    closed = f"the first closed at {closed_at_s(first):.0f} s"
    return f"{len(found)}; {closed}, {size} vehicles in a circle{whose}{came}"


def _starving(sinks: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Return the row about starved vehicles, if there are any."""
    if not sinks:
        return []
    most = max(sinks, key=lambda sink: len(sink["vehicles"]))
    count = len({vehicle for sink in sinks for vehicle in sink["vehicles"]})
    behind = f"behind {most['behind']} on {most['lane']}" if most["behind"] else "at gates"
    text = f"{count} vehicles, {len(most['vehicles'])} {behind} ({most['why']})"
    return [("starving", f"{text}, noticed at {most['noticed_s']:.0f} s")]


def _coverage(summary: Mapping[str, Any]) -> str:
    edges, lane_km = summary["coverage_edges"] or 0.0, summary["coverage_lane_km"] or 0.0
    return f"loops reach {edges:.0%} of the network's edges, {lane_km:.0%} of its lane-km"


def _idleness(summary: Mapping[str, Any]) -> str:
    if summary["idleness_s"] is None:
        return "nothing measured"
    mean, worst, never = summary["idleness_s"], summary["worst_idleness_s"], summary["unvisited_edges"]
    text = f"mean {mean:.0f} s, worst {worst:.0f} s (edge {summary['worst_idleness_edge']})"
    return f"{text}, {never} edge{'s' if never != 1 else ''} never visited" if never else text


def _seen(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the row about which streets were seen, also streets on no loop, if they were measured."""
    watch = summary.get("watch") or {}
    if not watch:
        return []
    never = watch["never_seen"]
    text = f"{watch['streets'] - never} of {watch['streets']} streets seen"
    if watch["worst_idleness_of_seen_s"] is not None:
        text += f"; the worst of these {watch['worst_idleness_of_seen_s']:.0f} s"
    if never:
        missed = min(never, summary["unvisited_edges"] or 0)
        why = [f"{never - missed} are on no loop"] if never > missed else []
        why += [f"no vehicle came to {missed} on loops"] if missed else []
        why = why if summary["loops"] else ["no vehicle came"]
        text += f"; {never} never, because {' and '.join(why)}"
    return [("streets", text)]


def _watch(watch: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the rows about all streets, also streets on no loop, if they were measured."""
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
        text = f"{row['streets']} streets{never}; idleness mean {row['idleness_s']:.0f} s"
        rows.append((f"in {row['district']}", f"{text}, worst {row['worst_idleness_s']:.0f} s"))
    return rows


def _named(row: Mapping[str, Any]) -> str:
    return f"{row['street']} ({row['edge']})" if row["street"] else str(row["edge"])


def _audit(audit: str | list[str]) -> str:
    if isinstance(audit, str):
        return audit
    return f"{len(audit)} findings, the first: {audit[0]}"
