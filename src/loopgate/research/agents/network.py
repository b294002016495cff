"""A simulated network that delays, loses and duplicates messages, with a limited range."""

import heapq
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from loopgate.research.agents.messages import Kind, Message, Payload


def _everywhere(_sender: int, _receiver: int) -> bool:
    return True


@dataclass(frozen=True, slots=True)
class Link:
    """The delay, loss and duplication of messages between agents."""

    delay: tuple[float, float] = (0.0, 0.0)
    """Smallest and largest delay [time units], drawn for each copy, so that messages overtake each other."""
    loss: float = 0.0
    """Probability that a copy is lost."""
    duplicate: float = 0.0
    """Probability that a copy comes twice."""
    copies: int = 1
    """How many copies the sender sends of each message, against loss."""
    reaches: Callable[[int, int], bool] = _everywhere
    """Whether a message of the first robot reaches the second, for a limited range."""


class MessageNetwork:
    """Delivers messages in order of arrival time; ties in order of sending.

    Attributes
    ----------
    now
        Time [units of `Link.delay`].
    sent, delivered, dropped
        Copies, by kind; out of range counts as dropped.
    """

    def __init__(self, link: Link, rng: random.Random) -> None:
        self.now = 0.0
        self.sent: Counter[Kind] = Counter()
        self.delivered: Counter[Kind] = Counter()
        self.dropped: Counter[Kind] = Counter()
        self._link = link
        self._rng = rng
        self._queue: list[tuple[float, int, Message]] = []
        self._numbers = 0
        self._order = 0
        self._receivers: dict[int, Callable[[Message], None]] = {}

    def connect(self, robot: int, receive: Callable[[Message], None]) -> None:
        """Give `robot` its mailbox."""
        self._receivers[robot] = receive

    def send(self, kind: Kind, sender: int, receiver: int, payload: Payload) -> int:
        """Send a message; return its number."""
        self._numbers += 1
        message = Message(self._numbers, kind, sender, receiver, payload)
        link = self._link
        for _ in range(link.copies):
            self.sent[kind] += 1
            if not link.reaches(sender, receiver) or self._rng.random() < link.loss:
                self.dropped[kind] += 1
                continue
            self._post(message)
            if self._rng.random() < link.duplicate:
                self._post(message)
        return self._numbers

    def _post(self, message: Message) -> None:
        self._order += 1
        arrival = self.now + self._rng.uniform(*self._link.delay)
        heapq.heappush(self._queue, (arrival, self._order, message))

    def run(self, until: float) -> None:
        """Deliver all messages that arrive up to the time `until`, answers included."""
        while self._queue and self._queue[0][0] <= until:
            self.now, _, message = heapq.heappop(self._queue)
            receive = self._receivers.get(message.receiver)
            if receive is None:
                self.dropped[message.kind] += 1
            else:
                self.delivered[message.kind] += 1
                receive(message)
        self.now = max(self.now, until)
