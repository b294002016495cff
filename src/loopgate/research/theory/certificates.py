"""Checks the claims of the certified gate, decision by decision, without its code and without a search.

A certificate says for one configuration and one robot whether its move was admitted or refused, and shows
why. Only the model is used here, so that a mistake of the gate's cannot hide in its own checker.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from loopgate.errors import LoopgateError
from loopgate.model import Configuration, System
from loopgate.research.theory.dead_proofs import Group, follow_proof
from loopgate.research.theory.oracle import Oracle, OracleLimitError
from loopgate.research.theory.places import Places
from loopgate.research.theory.residents import keeps_everyone

_MOST_CONFIGURATIONS = 250_000
"""More than the certified gate looks at for one decision, if its budget is not raised."""


class CertificateError(LoopgateError):
    """A certificate that does not prove its claim."""


def check_certificate(system: System, certificate: Mapping[str, Any]) -> None:
    """Check one certificate.

    Raises `CertificateError` if it does not show what it claims; the text says which step fails.

    Parameters
    ----------
    certificate
        ``positions``, ``queues`` (robots by name), ``robot``, ``verdict`` (``admitted`` or ``refused``) and
        ``kind``:

        - ``home``: after ``moves``, which begin with the robot's, every robot is at home.
        - ``round``: after ``approach``, which begins with the robot's move, the ``circle`` moves everybody
          and leads back to where it began.
        - ``rest``: after ``moves`` every robot rests and no full places wait for one another in a circle.
        - ``room``: after ``moves`` every place that can block has a slot free, and who will end has ended.
        - ``chain``: after the robot's move no full places wait for one another in a circle, and the system
          is one in which everyone can go on for ever then.
        - ``wait``: after the robot's move, ``robots`` can never move again.
        - ``dead``: ``proof`` shows line by line that after the robot's move not all can get home.
        - ``no rest``: ``proof`` shows the same for getting to a rest.
        - ``exhausted``: all configurations that can follow were looked at (checked by doing it again).
        - ``full``: after the robot's move ``places`` would be full and wait for one another.
        - ``reserved``: all slots of ``place`` are taken or kept for robots on their way to it.
    """
    try:
        _Check(system, certificate).run()
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        msg = f"certificate: malformed ({type(error).__name__}: {error})"
        raise CertificateError(msg) from error


class _Check:
    def __init__(self, system: System, certificate: Mapping[str, Any]) -> None:
        self._system = system
        self._certificate = certificate
        self._number: dict[str, int] = {robot.id: i for i, robot in enumerate(system.robots)}
        self._places = Places(system)
        queues = tuple(tuple(self._number[name] for name in queue) for queue in certificate["queues"])
        self._here = Configuration(tuple(certificate["positions"]), queues)
        self._robot = self._number[certificate["robot"]]

    def run(self) -> None:
        """Check the configuration, then the evidence for this kind of certificate."""
        self._possible()
        kind, verdict = self._certificate["kind"], self._certificate["verdict"]
        admitting = {"home": self._home, "round": self._round, "rest": self._rest}
        admitting |= {"room": self._room, "chain": self._chain}
        no_rest: Callable[[], None] = partial(self._dead, rests=True)
        refusing = {"wait": self._wait, "dead": self._dead, "no rest": no_rest, "full": self._full}
        refusing |= {"exhausted": self._exhausted, "reserved": self._reserved}
        checks = {"admitted": admitting, "refused": refusing}[verdict]
        if kind not in checks:
            self._fail(f"kind {kind!r} does not show that a move is {verdict}")
        checks[kind]()

    def _fail(self, what: str) -> None:
        msg = f"certificate for {self._certificate['robot']}: {what}"
        raise CertificateError(msg)

    def _possible(self) -> None:
        system, here = self._system, self._here
        if len(here.positions) != len(system.robots) or not all(
            0 <= p < len(path) for p, path in zip(here.positions, system.paths, strict=True)
        ):
            self._fail("its positions are none of this system's")
        expected = system.configuration(here.positions).queues
        if [sorted(q) for q in expected] != [sorted(q) for q in here.queues]:
            self._fail("its queues do not hold the robots that stand in them")
        if any(n > room for n, room in zip(system.occupancy(here), system.room, strict=True)):
            self._fail("a state holds more robots than it can")

    def _play(self, here: Configuration, names: Iterable[str]) -> Configuration:
        for step, name in enumerate(names, start=1):
            robot = self._number[name]
            if not self._system.enabled(here, robot):
                self._fail(f"move {step}, of {name}, is not possible there")
            here = self._system.moved(here, robot)
        return here

    def _begins(self, names: Sequence[str]) -> None:
        if names[:1] != [self._certificate["robot"]]:
            self._fail("its moves do not begin with the one that was asked for")

    def _home(self) -> None:
        moves = self._certificate["moves"]
        self._begins(moves)
        end = self._play(self._here, moves)
        for i, p in enumerate(end.positions):
            if not self._places.home(i, p):
                self._fail(f"{self._system.robots[i].id} is not at home in the end")

    def _round(self) -> None:
        approach, circle = self._certificate["approach"], self._certificate["circle"]
        self._begins(approach)
        start = self._play(self._here, approach)
        if self._play(start, circle) != start:
            self._fail("its circle does not lead back to where it began")
        for i, robot in enumerate(self._system.robots):
            if robot.id not in circle and not self._system.finished(start, i):
                self._fail(f"{robot.id} does not move in the circle")

    def _rest(self) -> None:
        moves = self._certificate["moves"]
        self._begins(moves)
        end = self._play(self._here, moves)
        for i, p in enumerate(end.positions):
            if not self._places.rest(i, p):
                self._fail(f"{self._system.robots[i].id} does not rest in the end")
        jammed = self._places.jammed(end)
        if jammed:
            names = ", ".join(self._system.states[s] for s in jammed)
            self._fail(f"in the end the full places {names} wait for one another")

    def _room(self) -> None:
        moves, system = self._certificate["moves"], self._system
        self._begins(moves)
        end = self._play(self._here, moves)
        for i, p in enumerate(end.positions):
            ends = self._places.ends_in(i, len(system.paths[i]) - 1)
            if ends and not (self._places.ends_in(i, p) and self._places.hinders_nobody(system.paths[i][p])):
                self._fail(f"{system.robots[i].id} has not ended out of the way in the end")
        for s, inside in enumerate(system.occupancy(end)):
            if inside >= system.room[s] and not self._places.hinders_nobody(s):
                self._fail(f"{system.states[s]} has no slot free in the end")

    def _chain(self) -> None:
        if not keeps_everyone(self._system):
            self._fail("that full places wait in no circle is not enough for everyone to go on here")
        jammed = self._places.jammed(self._after())
        if jammed:
            names = ", ".join(self._system.states[s] for s in jammed)
            self._fail(f"after it the full places {names} wait for one another")

    def _after(self) -> Configuration:
        return self._play(self._here, [self._certificate["robot"]])

    def _wait(self) -> None:
        there = self._after()
        robots = [self._number[name] for name in self._certificate["robots"]]
        if not Group.of(self._places, there).waits_for_good(robots):
            self._fail("its robots can move again some day")

    def _dead(self, *, rests: bool = False) -> None:
        places = Places(self._system, rests=rests)
        follow_proof(places, self._certificate["proof"], self._after(), self._fail)

    def _exhausted(self) -> None:
        try:
            live = Oracle(self._system, limit=_MOST_CONFIGURATIONS).live(self._after())
        except OracleLimitError:
            self._fail(f"more than {_MOST_CONFIGURATIONS} configurations follow, which no gate looks through")
            return
        if live:
            self._fail("everybody can go on for ever from there")

    def _full(self) -> None:
        there = self._after()
        places = [self._system.states.index(name) for name in self._certificate["places"]]
        if not self._places.closed_jam(there, places):
            self._fail("its places are not full, or do not wait for one another")

    def _reserved(self) -> None:
        place = self._system.states.index(self._certificate["place"])
        if self._places.held(self._here, place) < self._system.room[place]:
            self._fail(f"{self._certificate['place']} has a slot left")
