"""What a check of a gate found."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Any

__all__ = ["Counterexample", "Verification"]


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A way to where the gate breaks its promise.

    Attributes
    ----------
    kind
        ``unsafe``: the last move was admitted though it is not safe. ``stuck``: nothing is admitted there
        though not all have finished. ``disabled``: the last move breaks a capacity or an order.
    moves
        The robots that move, from the start on; in an exhaustive check there is no shorter way.
    configuration
        The states in which the robots then stand.
    """

    kind: str
    moves: tuple[str, ...]
    configuration: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Verification:
    """What a check of a gate found; adding two adds their counts.

    Attributes
    ----------
    method
        ``exhaustive`` or ``walks``.
    judge
        Where the exact answer comes from: ``oracle``, ``homing`` or ``sat``; for a gate that promises that
        somebody can always move ``somebody``, exact too, or, where that does not fit, ``deadlocks``
        (circular waits only).
    systems
        Systems checked.
    configurations
        Configurations in which every robot was asked about; in walks, with repetitions.
    decisions
        Enabled moves decided.
    safe, safe_admitted
        Safe ones among them, and how many of these the gate admitted; 0 without a judge of safety.
    unsafe_admitted, stuck, disabled_admitted
        Broken promises; see `Counterexample`.
    budget_stops
        Refusals for want of budget.
    starts_refused, live_starts_refused, dead_starts_accepted
        Starts that the gate refused, those among them that are live, and starts that it did not refuse
        though they are not live (these are not walked from).
    explored, reachable_live
        Configurations that the gate lets come about, and that some gate could let come about without ever
        being unsafe (exhaustive checks only).
    deadlocks
        Configurations with a circular wait that the gate lets come about (exhaustive checks only).
    starving
        Configurations that the gate lets come about and from which, by moves that it admits, not every robot
        can go on for ever (exhaustive checks of systems that fit into words only). Not part of `holds`: a
        gate that promises that somebody can move does not promise more.
    counterexample
        The first found, if any.
    """

    method: str
    judge: str
    systems: int = 1
    configurations: int = 0
    decisions: int = 0
    safe: int = 0
    safe_admitted: int = 0
    unsafe_admitted: int = 0
    stuck: int = 0
    disabled_admitted: int = 0
    budget_stops: int = 0
    starts_refused: int = 0
    live_starts_refused: int = 0
    dead_starts_accepted: int = 0
    explored: int = 0
    reachable_live: int = 0
    deadlocks: int = 0
    starving: int = 0
    counterexample: Counterexample | None = field(default=None)

    @property
    def holds(self) -> bool:
        """Whether no promise was seen broken."""
        broken = self.unsafe_admitted + self.stuck + self.disabled_admitted
        return not broken + self.live_starts_refused + self.dead_starts_accepted

    @property
    def permissiveness(self) -> float | None:
        """Accepted over safe moves; None where safety was not judged."""
        return self.safe_admitted / self.safe if self.safe else None

    @property
    def coverage(self) -> float | None:
        """Configurations the gate lets come about, over those that could; None for walks."""
        return self.explored / self.reachable_live if self.reachable_live else None

    def __add__(self, other: Verification) -> Verification:
        mine = {f.name: getattr(self, f.name) for f in fields(self)}
        for name, value in mine.items():
            theirs = getattr(other, name)
            if isinstance(value, int):
                mine[name] = value + theirs
            elif name == "counterexample":
                mine[name] = value or theirs
            elif value != theirs:
                mine[name] = "mixed"
        return Verification(**mine)

    def as_dict(self) -> dict[str, Any]:
        """Return all figures as a JSON object."""
        data = asdict(self)
        data.update(holds=self.holds, permissiveness=self.permissiveness, coverage=self.coverage)
        return data
