"""The findings of a report in words; all numbers come from its tables."""

import math
from collections.abc import Collection, Mapping, Sequence

import pandas as pd

from loopgate.analysis.statistics import wilson_interval
from loopgate.plots.style import open_first
from loopgate.reading import counted
from loopgate.report.content import Section
from loopgate.results import columns as c
from loopgate.results.columns import SERIES
from loopgate.results.headings import clock

DASH = "\N{EN DASH}"
_MOST_NAMES = 4
_EQUAL = 1.005  # ratios below this print as 1.00
_APART = "\N{NO-BREAK SPACE}"
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"
_UNEVEN = 0.01  # of half the interval
_TWO_DIGITS = 3.0


def number(value: float) -> str:
    """Return a number with three significant digits and separated thousands; a dash for NaN."""
    if math.isnan(value):
        return DASH
    if value and abs(value) < 100:  # noqa: PLR2004 - from here on, three digits need no decimals
        return f"{value:.3g}"
    return f"{value:,.0f}".replace(",", _APART)


def with_interval(mean: float, low: float, high: float) -> str:
    """Return an estimate with its interval, as papers write it.

    Half the interval has one digit that counts, two if it begins with 1 or 2; an interval that is not even
    on both sides has its ends.

    Examples
    --------
    >>> with_interval(4.1234, 3.81, 4.44), with_interval(117.31, 96.0, 138.6), with_interval(2.0, 0.0, 7.5)
    ('4.1 ± 0.3', '117 ± 21', '2 (0 to 7.5)')
    """
    half = (high - low) / 2.0
    if abs(mean - low - half) > _UNEVEN * half:
        return f"{number(mean)} ({number(low)} to {number(high)})"
    if half <= 0.0:
        return f"{number(mean)} {PLUS_MINUS} 0"
    place = math.floor(math.log10(half))
    digits = max(0, (1 if half / 10.0**place < _TWO_DIGITS else 0) - place)
    return f"{mean:,.{digits}f} {PLUS_MINUS} {half:,.{digits}f}".replace(",", _APART)


def title(sections: Sequence[Section]) -> str:
    """Return the title of the page: the rules compared, and the network."""
    names = {name for section in sections for name in (*section.names, *section.hidden)}
    if sections[0].watch is not None:
        return f"Watch of {_listed([section.network for section in sections])}"
    where = _listed([section.network for section in sections])
    runs = pd.concat([section.runs[[c.GATE, c.NEGOTIATION]] for section in sections])
    gates = sorted({name.partition(", ")[0] for name in names}, key=open_first)
    several = [name for name in sorted(names) if _several(name, names)]
    differ = {_aspect(part, runs): None for name in several for part in name.split(", ")[1:]}
    return f"{_listed(gates)} on {where}{f', compared by {_listed(list(differ))}' if differ else ''}"


def _several(name: str, names: Collection[str]) -> bool:
    """Return whether another series has the same rule."""
    rule = name.partition(", ")[0]
    return sum(other.partition(", ")[0] == rule for other in names) > 1


def _aspect(part: str, runs: pd.DataFrame) -> str:
    """Return the setting that a part of a series' name is about: ``lights`` of ``lights off``."""
    if part == "its lights":
        return "lights"
    name, _, value = part.removeprefix("no ").partition(" ")
    if value or part.startswith("no "):
        return name.removesuffix("_s").replace("_", " ")
    return "negotiation" if part in set(runs[c.NEGOTIATION]) else "abstraction"


def lead(sections: Sequence[Section]) -> str:
    """Return the page's first sentences: how runs were compared, and the result on the first network."""
    section = sections[0]
    if section.watch is not None:
        return " ".join(watch_sentences(section.watch)[:2])
    runs = section.runs
    counts = sorted(runs[c.VEHICLES].unique())
    vehicles = f"{counts[0]:g}" if len(counts) == 1 else f"{counts[0]:g} to {counts[-1]:g}"
    seeds = runs[c.SEED].nunique()
    of_each = f"{_span(runs[c.DURATION].max())}{' each' if len(runs) > 1 else ''}"
    noun = "vehicle" if vehicles == "1" else "vehicles"
    what = f"{vehicles} {noun}, {counted(seeds, 'seed')}, {of_each}"
    gates = runs[SERIES].str.partition(", ")[0]
    of, locked = gates.value_counts(), gates[runs[c.DEADLOCKS] > 0].value_counts()
    found = ", ".join(
        f"{name} in {locked.get(name, 0)} of {of[name]}" for name in sorted(of.index, key=open_first)
    )
    ended = f"Runs that lock up: {found}"
    if len(runs) == 1:
        ended = "It locks up" if len(locked) else "No deadlock"
    tables = {item.name: item.table for item in section.tables}
    where = f" on {section.network}" if len(sections) > 1 else ""
    best = _throughput(tables, runs, every=False)[0]
    return f"{what}{where}: {best[0].lower()}{best[1:]} {ended}."


def _listed(names: Sequence[str]) -> str:
    if len(names) > _MOST_NAMES:
        return f"{', '.join(names[:_MOST_NAMES])} and {len(names) - _MOST_NAMES} more"
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _span(seconds: float) -> str:
    hours = seconds / 3600.0
    return f"{hours:g} hour{'s' if hours > 1 else ''}" if hours == round(hours, 1) else f"{seconds:g} s"


def headline(section: Section, said: str = "") -> list[str]:
    """Return sentences on throughput, deadlocks, idleness and collisions on one network.

    What the page has `said` already is left out.
    """
    tables = {item.name: item.table for item in section.tables}
    if section.watch is not None:
        mishaps = _mishaps(section.runs)
        return [text for text in (*watch_sentences(section.watch), *mishaps) if text not in said]
    fresh = [text for text in _throughput(tables, section.runs) if text[1:] not in said]
    return [
        *_service(tables, section.begins_s),
        *fresh,
        *_truncated(section.runs),
        *_pairs(tables),
        *([_deadlocks(section.runs)] if len(section.runs) > 1 else []),
        *_watching(section.runs, section.count),
        *_mishaps(section.runs),
    ]


def _service(tables: Mapping[str, pd.DataFrame], begins_s: float) -> list[str]:
    """Say of a single run whether its stops were kept, where most time was lost, and what was closed."""
    sentences = []
    if "stops" in tables:
        stops = tables["stops"]
        visits, timed = int(stops[c.VISITS].sum()), int(stops[c.TIMED].sum())
        text = f"Stops: {counted(visits, 'visit')} at {counted(stops[c.STOP].nunique(), 'stop')}"
        if timed:
            share = float((stops[c.ON_TIME_60] * stops[c.TIMED]).sum()) / timed
            text += f"; of the {timed} with a time in the timetable {share:.0%} went on within a minute of it"
            text += f" (the latest {number(float(stops[c.WORST_LATENESS].max()))} s late)"
        if stops[c.LONGEST_HEADWAY].notna().any():
            longest = stops.iloc[int(stops[c.LONGEST_HEADWAY].fillna(-1.0).to_numpy().argmax())]
            text += f"; longest headway {number(longest[c.LONGEST_HEADWAY])} s, at {longest[c.STOP]}"
        sentences.append(f"{text}.")
    if "movements" in tables:
        worst = tables["movements"].iloc[0]
        why = f", waiting mostly for {worst[c.CAUSE]}" if worst[c.CAUSE] else ""
        sentences.append(
            f"Most time was lost on the way {worst[c.MOVEMENT]} (junction {worst[c.JUNCTION]}): "
            f"{number(worst[c.DELAY])} s a vehicle, level of service {worst[c.SERVICE_LEVEL]}{why}."
        )
    if "blocked" in tables:
        blocked = tables["blocked"]
        blocked = blocked.assign(
            **{c.PLACE: blocked[c.STREET].where(blocked[c.STREET] != "", blocked[c.PLACE])}
        )
        blocked = blocked.drop_duplicates([c.PLACE, c.CAUSE, c.FROM, c.UNTIL])  # a street has many lanes
        when = clock if begins_s > 0.0 else lambda time_s: f"{number(time_s)} s"
        parts = [
            f"{row[c.PLACE]} ({row[c.CAUSE]}) from {when(row[c.FROM])} "
            + ("to the end" if pd.isna(row[c.UNTIL]) else f"to {when(row[c.UNTIL])}")
            for _, row in blocked.head(_MOST_NAMES).iterrows()
        ]
        more = f" and {len(blocked) - len(parts)} more" if len(blocked) > len(parts) else ""
        sentences.append(f"Nobody was let in to {', '.join(parts)}{more}.")
        sentences += _changed(tables)
    return sentences


def _changed(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """Say what it changed that some place was shut, by the events of the run: ways, waits, lateness."""
    sentences = []
    if "delayed" in tables:
        delayed = tables["delayed"]
        parts = []
        led = delayed[delayed[c.LED] > 0]
        if len(led):
            times = int(led[c.LED].sum())
            known = led[led[c.LATER].notna()]
            each = f"{counted(len(led), 'vehicle')} led round it {counted(times, 'time')}"
            if len(known):
                of = int(known[c.LED].sum())
                only = f" (mean of the {of} of which it is known)" if of < times else ""
                mean = [float(known[name].sum()) / of for name in (c.LONGER, c.LATER)]
                each += f", each time by {_more(mean[0], 'm')} and {_more(mean[1], 's')}{only}"
            parts.append(each)
        waited = delayed[delayed[c.SHUT_WAIT] > 0]
        if len(waited):
            worst = waited.iloc[int(waited[c.SHUT_WAIT].to_numpy().argmax())]
            longest = f"{worst[c.VEHICLE]} longest, {number(float(worst[c.SHUT_WAIT]))} s"
            parts.append(f"{counted(len(waited), 'vehicle')} waited before it ({longest})")
            queued = int((delayed[c.SHUT_QUEUE] > 0).sum())
            if queued:
                parts.append(f"{counted(queued, 'vehicle')} stood behind these")
        if parts:
            sentences.append(f"What that changed: {'; '.join(parts)}.")
    if "stop-phases" in tables:
        phases = tables["stop-phases"]
        late = []
        for phase, some in phases.groupby(c.PHASE, sort=False):
            timed = int(some[c.TIMED].sum())
            worst_late = (
                f"at most {number(float(some[c.WORST_LATENESS].max()))} s late" if timed else "not known"
            )
            late.append(f"{phase} it {worst_late} at {counted(int(some[c.VISITS].sum()), 'visit')}")
        none = phases[(phases[c.PHASE] == "during") & (phases[c.VISITS] == 0)][c.STOP].unique()
        nobody = f"; nobody went on from {_listed(list(none))} during it" if len(none) else ""
        if phases[c.TIMED].sum():
            sentences.append(f"Stops {', '.join(late)}{nobody}.")
    return sentences


def _more(much: float, unit: str) -> str:
    return f"{number(abs(much))} {unit} {'more' if much >= 0 else 'less'}"


def watch_sentences(streets: pd.DataFrame) -> list[str]:
    """Say which promises to see streets again were kept and which broken, by name of street.

    `streets` is from `compute_promises`.
    """
    count = streets[c.PROMISE].value_counts()
    bounds = sorted(bound for bound in set(streets[c.BOUND]) if math.isfinite(bound))
    every = f"{number(bounds[0])} s" if len(bounds) == 1 else f"{number(bounds[0])} to {number(bounds[-1])} s"
    kept, broken = int(count.get("kept", 0)), int(count.get("broken", 0))
    never, partly = int(count.get("never seen", 0)), int(count.get("partly seen", 0))
    outcome = f"Kept on {kept} of {len(streets)} streets, broken on {broken}"
    edges, seen, late = (int(streets[name].sum()) for name in (c.EDGES, c.SEEN, c.LATE))
    sentences = [
        f"Promised: every street is seen again within {every}.",
        f"{outcome}; {partly} were seen in part, {never} never.",
        f"By edges: {seen} of {edges} were seen, and on {seen - late} of these the promise was kept.",
    ]
    if broken:
        worst = streets[streets[c.PROMISE] == "broken"].head(_MOST_NAMES)
        names = [f"{row[c.STREET]} ({number(row[c.WORST_IDLENESS])} s)" for _, row in worst.iterrows()]
        sentences.append(f"Broken by most: {', '.join(names)}.")
    return sentences


def _said(name: str) -> str:
    """Return a series' name as part of a sentence, in quotes if it has commas."""
    return f"\N{LEFT DOUBLE QUOTATION MARK}{name}\N{RIGHT DOUBLE QUOTATION MARK}" if ", " in name else name


def _throughput(tables: Mapping[str, pd.DataFrame], runs: pd.DataFrame, *, every: bool = True) -> list[str]:
    """Return sentences on the rule with the greatest throughput, compared with the other rules."""
    peaks = tables["capacity"].sort_values(c.PEAK, ascending=False, kind="stable")
    if runs[c.VEHICLES].min() == runs[c.VEHICLES].max():  # one count is no border of what was tried
        peaks = peaks.assign(**{c.AT_BORDER: False})
    if not every:
        peaks = peaks[~peaks[SERIES].str.partition(", ")[0].duplicated()]
    best = peaks.iloc[0]
    much = f"{number(best[c.PEAK])} vehicle-km/h"
    if len(runs) == 1:
        return [f"{much} with {_said(best[SERIES])}."]
    most = f"Vehicles drive most with {_said(best[SERIES])}: {much} with {best[c.CAPACITY]} vehicles."
    others = []
    for _, row in peaks.iloc[1:].iterrows():
        ratio = best[c.PEAK] / row[c.PEAK] if row[c.PEAK] > 0 else math.inf
        times = f"{ratio:.2f} times as much as" if ratio < math.inf else "more than"
        if best[c.PEAK] <= row[c.PEAK] * _EQUAL:
            times = "as much as"
        peak = f"{number(row[c.PEAK])} with {row[c.CAPACITY]} vehicles"
        others.append(f"{times} with {_said(row[SERIES])} at its best ({peak})")
    return [f"{most} That is {', '.join(others)}." if others else most, *_unreached(peaks)]


def _unreached(peaks: pd.DataFrame) -> list[str]:
    """Say with which rules vehicles drove most at the largest number of vehicles that was tried."""
    return [
        f"The capacity was not reached with {_listed([_said(name) for name in part[SERIES]])}: "
        f"more than {most} vehicles were not tried."
        for most, part in peaks[peaks[c.AT_BORDER].eq(other=True)].groupby(c.CAPACITY, sort=True)
    ]


def _truncated(runs: pd.DataFrame) -> list[str]:
    """Say both rates of runs that stopped at their deadlock: until then, and over the time asked for."""
    parts = []
    for series, group in runs[runs[c.TRUNCATED].eq(other=True)].groupby(SERIES, sort=True):
        rates = [number(float(group[name].mean())) for name in (c.KM_PER_H_MEASURED, c.KM_PER_H)]
        parts.append(
            f"{_said(str(series))} in {len(group)}, with {rates[0]} vehicle-km/h until then and {rates[1]} "
            "over the time asked for, which is what figures and tables compare"
        )
    return [f"Runs that stopped at their deadlock: {'; '.join(parts)}."] if parts else []


def _pairs(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    if "paired" not in tables:
        return []
    sentences = []
    for series, part in tables["paired"].groupby(SERIES, sort=True):
        sure = part[part[c.LOW].notna()]
        up, down = sure[sure[c.LOW] > 0], sure[sure[c.HIGH] < 0]
        if sure.empty:
            plural = "s" if len(part) > 1 else ""
            pairs = int(part[c.PAIRS].max())
            of = "one run" if pairs == 1 else f"at most {pairs} runs"
            counts = f"{of} of each at {len(part)} vehicle count{plural}, so the difference may be chance"
        else:
            counts = (
                f"more at {len(up)} and less at {len(down)} of {len(sure)} vehicle counts "
                f"(95 % interval of the difference, {' and '.join(sorted(set(sure[c.KIND])))}, clear of zero)"
            )
        baseline = part[c.BASELINE].iloc[0]
        sentences.append(
            f"On the same seeds, with {_said(str(series))} vehicles drive {_extremes(part)} as with "
            f"{_said(baseline)}: {counts}."
        )
    return sentences


def _extremes(part: pd.DataFrame) -> str:
    known = part[part[c.RATIO].notna()].sort_values(c.RATIO, kind="stable")
    if known.empty:
        return "a distance without a defined ratio"
    low, high = known.iloc[0], known.iloc[-1]
    if low[c.VEHICLES] == high[c.VEHICLES]:
        return f"{high[c.RATIO]:.2f} times as much"
    return (
        f"{low[c.RATIO]:.2f} (with {low[c.VEHICLES]:g} vehicles) to {high[c.RATIO]:.2f} times as much "
        f"(with {high[c.VEHICLES]:g})"
    )


def _deadlocks(runs: pd.DataFrame) -> str:
    parts = []
    for series, group in runs.groupby(SERIES, sort=True):
        locked = int((group[c.DEADLOCKS] > 0).sum())
        interval = wilson_interval(locked, len(group))
        first = group.loc[group[c.DEADLOCKS] > 0, c.VEHICLES].min()
        since = f", from {first:g} vehicles on" if locked else ""
        parts.append(
            f"{_said(str(series))} in {locked} of {len(group)} (95 % interval {100 * interval.low:.0f} to "
            f"{100 * interval.high:.0f} %{since})"
        )
    return f"Runs that lock up: {'; '.join(parts)}."


def _watching(runs: pd.DataFrame, count: int) -> list[str]:
    """Say how long roads go without a visit, by series at one vehicle count."""
    parts = []
    for series, group in runs[runs[c.VEHICLES] == count].groupby(SERIES, sort=True):
        mean, worst = group[c.IDLENESS].mean(), group[c.WORST_IDLENESS].max()
        if mean == mean and worst == worst:  # noqa: PLR0124 - NaN is what differs from itself
            never = group[c.UNVISITED].max()
            missed = f", up to {never:g} edges never" if never > 0 else ""
            said = f"{number(mean)} s on average, {number(worst)} s at worst{missed}"
            parts.append(f"{_said(str(series))} {said}")
    where = "edges on loops" if runs[c.LOOPS].gt(0).any() else "edges that vehicles drive on"
    told = f"How long {where} wait for a visit with {count} vehicles: {'; '.join(parts)}."
    return [told] if parts else []


def _mishaps(runs: pd.DataFrame) -> list[str]:
    """Say by series whether deadlocks, collisions or teleports happened."""
    parts = []
    for series, group in runs.groupby(SERIES, sort=True):
        known = group[c.COLLISIONS].notna().any()
        collisions, teleports = int(group[c.COLLISIONS].sum()), int(group[c.TELEPORTS].sum())
        found = f"{counted(collisions, 'collision')}, {counted(teleports, 'teleport')}"
        mishaps = found if known else "collisions not known"
        audited = group[group[c.AUDIT].notna() & (group[c.AUDIT] != c.NOT_GATED)]
        clean = int((audited[c.AUDIT] == "clean").sum())
        audit = f", audit clean in {clean} of {counted(len(audited), 'run')}" if len(audited) else ""
        starving = int(group[c.STARVING].sum()) if c.STARVING in group else 0
        starved = f", {counted(starving, 'vehicle')} starved" if starving else ""
        kinds = (c.CLOSURES, "closed edge"), (c.BREAKDOWNS, "breakdown")
        planned = [(int(group[name].fillna(0).sum()), noun) for name, noun in kinds if name in group]
        incidents = " and ".join(counted(number, noun) for number, noun in planned if number)
        incidents = f", with {incidents}" if incidents else ""
        parts.append(f"{_said(str(series))} {mishaps}{starved}{audit}{incidents}")
    return [f"What must not happen: {'; '.join(parts)}."]
