"""Departures of a route file: single vehicles and flows."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, islice, takewhile
from math import ceil, inf
from random import Random
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import as_number, time_of
from loopgate.reading import shown

_PER_HOUR = ("vehsPerHour", "perHour")
_OFTEN = ("period", *_PER_HOUR, "probability")

FLOW_ATTRIBUTES = frozenset({"begin", "end", "number", *_OFTEN})
"""Attributes of ``<flow>`` that say when its vehicles depart."""

_BEYOND_COUNTING = 1e18
"""More vehicles than in any run: a period may be so short that their number is infinite."""

_HOUR_S = 3600.0
_WHY = ", since nothing else starts it"


@dataclass(frozen=True, slots=True)
class Flow:
    """Vehicles that depart one after another by a rule."""

    begin_s: float = 0.0
    end_s: float | None = None
    """`begin_s` and `end_s`: first and last time of departures [s]; `end_s` is None for the end of the
    run."""
    number: int | None = None
    """Number of departures; None for no limit."""
    period_s: float | None = None
    """Time between two departures [s]; None to spread `number` departures up to the end."""
    rate_per_s: float | None = None
    """How many depart in a second on average, at random (a Poisson process), instead of every period."""
    probability: float | None = None
    """Of a departure in each second, instead of both."""

    def departures_s(self, since_s: float, run_end_s: float, rng: Random) -> Iterator[tuple[int, float]]:
        """Yield numbers, counted from 0, and times [s] of its departures from a time until the run ends."""
        until_s = self._until_s(run_end_s)
        times: Iterator[float]
        first = 0
        if self.probability is not None:
            draws, probability = int(max(0.0, until_s - self.begin_s)) + 1, self.probability
            times = (self.begin_s + k for k in range(draws) if rng.random() < probability)
        elif self.rate_per_s is not None:
            times = _drawn_s(self.begin_s, self.rate_per_s, rng)
        else:
            period_s = self._every_s(run_end_s)
            first = max(0, self._number_before(since_s, run_end_s) - 1)  # one less, for quotients are rounded
            times = (self.begin_s + k * period_s for k in count(first))
        numbered = enumerate(takewhile(lambda at_s: at_s < until_s, times), first)
        most = None if self.number is None else max(0, self.number - first)
        return ((k, at_s) for k, at_s in islice(numbered, most) if at_s >= since_s)

    def expected(self, since_s: float, run_end_s: float) -> float:
        """Return the number of departures from a time to the end of the run; the mean if they are random."""
        most = inf if self.number is None else float(self.number)
        until_s = self._until_s(run_end_s)
        lasts_s = max(0.0, until_s - max(self.begin_s, since_s))
        if self.probability is not None:
            return min(most, self.probability * lasts_s)
        if self.rate_per_s is not None:
            return min(most, self.rate_per_s * lasts_s)
        before = self._number_before(since_s, run_end_s)
        return max(0.0, min(most, self._number_before(until_s, run_end_s)) - before)

    def _until_s(self, run_end_s: float) -> float:
        if self.end_s is None or (self._by_number and self.end_s == self.begin_s):
            return run_end_s  # of the latter, as SUMO has it, all depart at once
        return min(self.end_s, run_end_s)

    @property
    def _by_number(self) -> bool:
        return self.period_s is None and self.rate_per_s is None and self.probability is None

    def _every_s(self, run_end_s: float) -> float:
        if self.period_s is not None:
            return self.period_s
        return max(0.0, (run_end_s if self.end_s is None else self.end_s) - self.begin_s) / (self.number or 1)

    def _number_before(self, at_s: float, run_end_s: float) -> int:
        """Return the number of periodic departures before a time."""
        every_s, lasts_s = self._every_s(run_end_s), at_s - self.begin_s
        if lasts_s <= 0.0 or (every_s == 0.0 and self.number is None):
            return 0
        number = min(lasts_s / every_s, _BEYOND_COUNTING) if every_s > 0.0 else _BEYOND_COUNTING
        return ceil(number) if self.number is None else ceil(min(number, self.number))


def _drawn_s(begin_s: float, rate_per_s: float, rng: Random) -> Iterator[float]:
    while True:
        begin_s += rng.expovariate(rate_per_s)
        yield begin_s


def read_flow(element: ET.Element, what: str) -> Flow:
    """Read how often the vehicles of a ``<flow>`` depart.

    Raises `RouteError` if it does not say so, says it twice, or a figure is none.
    """
    said = [name for name in _OFTEN if name in element.attrib]
    number = element.get("number")
    if len(said) > 1 or not (said or number):
        listed = ", ".join(said) or "neither number nor period"
        msg = f"{what}: it says {listed}; expected one of period, vehsPerHour and probability, or a number"
        raise RouteError(msg)
    if said and number and "end" in element.attrib:
        msg = f"{what}: it says {said[0]}, number and end; with the first, SUMO takes one of the others only"
        raise RouteError(msg)
    flow = Flow(
        time_of(element, "begin", what, why=_WHY) or 0.0,
        time_of(element, "end", what, why=_WHY),
        None if number is None else int(_figure(number, "number", what, least=1.0)),
    )
    if not said:
        return flow
    text = element.attrib[said[0]]
    period_s = rate_per_s = probability = None
    if said[0] == "probability":
        probability = _figure(text, "probability", what, most=1.0)
    elif text.startswith("exp("):
        rate_per_s = _figure(text[4:].rstrip(") "), said[0], what)
    elif said[0] in _PER_HOUR:
        period_s = _HOUR_S / _figure(text, said[0], what)
    else:
        clock_s = time_of(element, said[0], what) if ":" in text else None
        period_s = _figure(text if clock_s is None else str(clock_s), said[0], what)
    return Flow(flow.begin_s, flow.end_s, flow.number, period_s, rate_per_s, probability)


def depart_s(element: ET.Element, what: str) -> float:
    """Return when a ``<vehicle>`` departs [s].

    Raises `RouteError` if that is no time.
    """
    if element.get("depart") in {"begin", "now"}:
        return 0.0
    return time_of(element, "depart", what, why=_WHY) or 0.0


def _figure(text: str, attribute: str, what: str, *, least: float = 0.0, most: float = 1e9) -> float:
    figure = as_number(text)
    if not least <= figure <= most or figure <= 0.0:
        above = f"from {least:g}" if least else "above 0"
        msg = f"{what}: {attribute} is {shown(text)}; expected a number {above} and up to {most:g}"
        raise RouteError(msg)
    return figure
