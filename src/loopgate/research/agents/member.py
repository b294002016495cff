"""One robot among those that keep a witness together: it votes, checks, accepts, and may coordinate."""

from collections.abc import Callable
from dataclasses import replace

from loopgate.gates.certified.broken_robots import Remainder
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.gate import CertifiedGate
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import System
from loopgate.research.agents.messages import Entry, Kind, Message, Note
from loopgate.research.agents.network import MessageNetwork

_ASK = 3
"""Ticks between two requests of a robot, which also show that it is there."""
_REPEAT = 4
"""Ticks until the coordinator repeats what was not answered."""
_MISSED = 30
"""Ticks without a coordinator until a robot wants to take over, times its number, so that one is first."""
_SILENT = 60
"""Ticks without a sign of a robot until the coordinator takes it for broken down."""


class Member:
    """A robot of one component, with its own copy of the agreed entries.

    An entry holds when a majority has accepted it. Only then is the mover told, and nothing new is proposed
    before it has moved. A robot that takes over learns from a majority what was accepted last and goes on
    with that, so an entry that holds is never lost, whichever messages are. (The scheme is that of Paxos and
    Viewstamped Replication.) An entry is accepted only after its move and its witness have been checked.

    Parameters
    ----------
    robot, system
        The robot's number, and the component's system.
    drive
        Makes the robot's move in the world.
    """

    def __init__(
        self, robot: int, system: System, network: MessageNetwork, drive: Callable[[int], None]
    ) -> None:
        self.robot = robot
        self.alive = True
        self.leading = False
        self.entry = Entry(0, 0, system.initial)
        self._system = system
        self._network = network
        self._drive = drive
        self._everybody = range(len(system.robots))
        self._majority = len(system.robots) // 2 + 1
        self._home = SystemIndex(system).home
        self._checker = Checker(system)
        self._promised = 0
        self._executed = 0
        self._heard = 0.0  # of a coordinator
        self._votes: dict[int, Entry] = {}
        self._accepted: set[int] = set()
        self._done = True
        self._asks: dict[int, float] = {}
        self._seen: dict[int, float] = {}
        self._gate = CertifiedGate(system, promise="everyone", patience=0)
        self._remainder: Remainder | None = None
        network.connect(robot, self.receive)

    def fail(self) -> None:
        """Break down for good: no moves and no messages any more."""
        self.alive = self.leading = False
        self._network.disconnect(self.robot)

    def tick(self, now: int) -> None:
        """Do what is due at time `now`."""
        if not self.alive:
            return
        if self.leading:
            self._coordinate(now)
        elif now - self._heard > _MISSED * (1 + self.robot):
            self._stand_for_election(now)
        elif now % _ASK == self.robot % _ASK and self._promised:
            self._send(Kind.ASK, self._promised % len(self._everybody), Note(self._promised))

    def receive(self, message: Message) -> None:
        """Take a message; whatever belongs to an older term is void."""
        note = message.payload
        if not isinstance(note, Note):
            return
        now = self._network.now
        self._seen[message.sender] = now
        handlers = {
            Kind.ASK: self._on_ask,
            Kind.ELECT: self._on_elect,
            Kind.VOTE: self._on_vote,
            Kind.PROPOSE: self._on_propose,
            Kind.ACCEPT: self._on_accept,
            Kind.GRANT: self._on_grant,
            Kind.DONE: self._on_done,
        }
        handlers[message.kind](message.sender, note)

    def _send(self, kind: Kind, receiver: int, note: Note) -> None:
        if receiver == self.robot:
            self.receive(Message(0, kind, self.robot, self.robot, note))
        else:
            self._network.send(kind, self.robot, receiver, note)

    def _broadcast(self, kind: Kind, note: Note) -> None:
        for robot in self._everybody:
            self._send(kind, robot, note)

    def _stand_for_election(self, now: float) -> None:
        n = len(self._everybody)
        self._heard = now
        self._votes.clear()
        term = (self._promised // n + 1) * n + self.robot  # its remainder names the coordinator
        self._broadcast(Kind.ELECT, Note(term))

    def _on_elect(self, sender: int, note: Note) -> None:
        if note.term > self._promised:
            self._promised = note.term
            self.leading = False
            self._heard = self._network.now
            self._send(Kind.VOTE, sender, Note(note.term, self.entry))

    def _on_vote(self, sender: int, note: Note) -> None:
        if note.term != self._promised or self.leading or note.entry is None:
            return
        self._votes[sender] = note.entry
        if len(self._votes) >= self._majority:
            self.leading = True
            self._asks.clear()
            self._seen = dict.fromkeys(self._everybody, self._network.now)
            last = max(self._votes.values(), key=lambda e: (e.version, e.term))
            self._propose(last)

    def _propose(self, entry: Entry) -> None:
        """Make an entry known in this term; it may be one that holds already."""
        self._accepted = set()
        self._done = entry.mover < 0
        self.entry = replace(entry, term=self._promised)
        if entry.broken and (self._remainder is None or not entry.broken <= self._remainder.broken):
            self._remainder = Remainder(self._system, entry.configuration, entry.broken, entry.lost)
        self._broadcast(Kind.PROPOSE, Note(self._promised, self.entry))

    def _on_propose(self, sender: int, note: Note) -> None:
        entry = note.entry
        if entry is None or note.term < self._promised:
            return
        self._promised = note.term
        self.leading = self.leading and sender == self.robot
        self._heard = self._network.now
        mine = self.entry
        if (entry.version, entry.term) < (mine.version, mine.term) or not self._checks(entry):
            return
        self.entry = entry
        self._send(Kind.ACCEPT, sender, Note(note.term, entry))

    def _checks(self, entry: Entry) -> bool:
        """Return whether the entry follows from what this robot knows, and its witness brings all home."""
        mine = self.entry
        follows = True
        if entry.version == mine.version + 1 and entry.mover >= 0 and mine.term == entry.term:
            system = self._system
            follows = system.enabled(mine.configuration, entry.mover)
            follows = follows and system.moved(mine.configuration, entry.mover) == entry.configuration
        if entry.broken or entry.version == 0:
            return follows
        return follows and self._checker.brings_home(entry.configuration, entry.witness, self._home)

    def _on_accept(self, sender: int, note: Note) -> None:
        if self.leading and note.term == self._promised and note.entry == self.entry:
            before = len(self._accepted)
            self._accepted.add(sender)
            if before < self._majority <= len(self._accepted) and not self._done:
                self._send(Kind.GRANT, self.entry.mover, Note(self._promised, self.entry))

    def _on_grant(self, sender: int, note: Note) -> None:
        if note.entry is None or note.entry.mover != self.robot or not self.alive:
            return
        if note.entry.version > self._executed:
            self._executed = note.entry.version
            self._drive(self.robot)
        self._send(Kind.DONE, sender, Note(note.term, note.entry))

    def _on_done(self, sender: int, note: Note) -> None:
        if self.leading and note.entry is not None and note.entry.version == self.entry.version:
            self._done = self._done or sender == self.entry.mover

    def _on_ask(self, sender: int, note: Note) -> None:
        del note
        self._asks.setdefault(sender, self._network.now)

    def _coordinate(self, now: int) -> None:
        self._asks.setdefault(self.robot, now)
        holds = len(self._accepted) >= self._majority
        silent = [i for i in self._everybody if i != self.robot and now - self._seen[i] > _SILENT]
        gone = frozenset(silent) - self.entry.broken
        if holds and gone and (self._done or self.entry.mover in gone):
            self._give_up(gone)
        elif holds and self._done and self._grant_next():
            return
        elif now % _REPEAT == 0:
            if holds and not self._done:
                self._send(Kind.GRANT, self.entry.mover, Note(self._promised, self.entry))
            self._broadcast(Kind.PROPOSE, Note(self._promised, self.entry))

    def _give_up(self, gone: frozenset[int]) -> None:
        """Propose that these robots have broken down; one on its way may stand where it was as well."""
        entry, lost = self.entry, self.entry.lost
        if not self._done:
            system = self._system
            path, p = system.paths[entry.mover], entry.configuration.positions[entry.mover]
            lost = (*lost, path[p - 1])
        broken = entry.broken | gone
        self._propose(Entry(entry.version + 1, 0, entry.configuration, -1, broken, lost))

    def _grant_next(self) -> bool:
        """Propose the oldest request that the gate admits; False if there is none."""
        here = self.entry.configuration
        for robot in sorted(self._asks, key=lambda i: (self._asks[i], i)):
            if robot in self.entry.broken or not self._system.enabled(here, robot):
                continue
            witness: tuple[int, ...] = ()
            if self._remainder is not None:
                if not self._remainder.admits(here, robot):
                    continue
            else:
                certificate = self._gate.certificate(here, robot)
                if certificate is None or certificate["verdict"] != "admitted":
                    continue
                names = {r.id: i for i, r in enumerate(self._system.robots)}
                witness = tuple(names[name] for name in certificate["moves"][1:])
            del self._asks[robot]
            after = self._system.moved(here, robot)
            entry = self.entry
            self._propose(Entry(entry.version + 1, 0, after, robot, entry.broken, entry.lost, witness))
            return True
        return False
