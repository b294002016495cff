"""When the vehicles of a route file depart: single ones, and the flows that they come in."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, islice, takewhile
from random import Random
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import as_number, time_of
from loopgate.reading import shown

_PER_HOUR = ("vehsPerHour", "perHour")
_OFTEN = ("period", *_PER_HOUR, "probability")

FLOW_ATTRIBUTES = frozenset({"begin", "end", "number", *_OFTEN})
"""Attributes of ``<flow>`` that say when its vehicles depart."""

_MOST = 100_000
"""Vehicles of one flow; no loop holds as many."""

_HOUR_S = 3600.0
_WHY = ", since nothing else starts it"


@dataclass(frozen=True, slots=True)
class Flow:
    """Vehicles that depart one after the other."""

    begin_s: float = 0.0
    end_s: float | None = None
    """`begin_s` and `end_s`: from when and until when they depart [s]; `end_s` is None for the end of the
    run."""
    number: int | None = None
    """How many there are; None for as many as depart until the end."""
    period_s: float | None = None
    """Time between two [s]; None for as much as `number` of them have until the end."""
    rate_per_s: float | None = None
    """How many depart in a second on average, at random (a Poisson process), instead of every period."""
    probability: float | None = None
    """Of a departure in each second, instead of both."""

    def departures_s(self, run_end_s: float, rng: Random) -> list[float]:
        """Return when its vehicles depart before the run ends [s]."""
        end_s = run_end_s if self.end_s is None else self.end_s
        times = takewhile(lambda at_s: at_s < min(end_s, run_end_s), self._times_s(end_s, rng))
        return list(islice(times, _MOST if self.number is None else self.number))

    def _times_s(self, end_s: float, rng: Random) -> Iterator[float]:
        if self.probability is not None:
            draws = int(max(0.0, end_s - self.begin_s)) + 1
            return (self.begin_s + k for k in range(draws) if rng.random() < self.probability)
        if self.rate_per_s is not None:
            return _drawn_s(self.begin_s, self.rate_per_s, rng)
        period_s = self.period_s
        if period_s is None:
            period_s = max(0.0, end_s - self.begin_s) / (self.number or 1)
        return (self.begin_s + k * period_s for k in count())


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
        period_s = _figure(text, said[0], what)
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
