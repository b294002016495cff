"""The model of `docs/proofs/Posts.v`, run beside posts and vehicles: whether each change is a step of it.

`Beside` is handed to a walk as what posts do. It compares what a post does with a message with the steps that
the model has, and raises `NoStepError` where there is none. What is so (who has asked, come, gone on, is out)
it takes from the vehicles of the walk after each step.
"""

from __future__ import annotations

from collections import defaultdict
from typing import NamedTuple

from loopgate.research.vehicles.walk import RandomWalk
from loopgate.research.vehicles.world import Receive
from loopgate.vehicles import post as posts
from loopgate.vehicles.messages import Ask, Clear, Message, Probe, ToPost
from loopgate.vehicles.post import Entry, Kept, Post
from loopgate.vehicles.vehicle import AskingVehicle


class Stay(NamedTuple):
    """One visit of a vehicle to a place: the number is used once."""

    vehicle: int
    number: int
    place: int


class NoStepError(AssertionError):
    """A post did what no step of the model does."""


def must(so: object, rule: str) -> None:
    """Raise unless it is so."""
    if not so:
        raise NoStepError(rule)


class Truth:
    """What is so: the facts of the model, and who stands where."""

    def __init__(self, vehicles: list[AskingVehicle]) -> None:
        self.asked: dict[Stay, Stay] = {}
        """The stay from which each was asked for."""
        self.now = {car.id: Stay(car.id, car.inside, car.place) for car in vehicles}
        self.used, self.gone, self.out = set(self.now.values()), set[Stay](), set[Stay]()
        self.inside: dict[int, list[Stay]] = defaultdict(list)
        """Stays whose rears are still inside, the oldest first."""
        self._before = list(vehicles)

    def look(self, walk: RandomWalk) -> None:
        """Take note of what has happened in a step of the walk."""
        for number, (before, after) in enumerate(zip(self._before, walk.vehicles, strict=True)):
            if before is not after:
                self._changed(number, before, after)
        self._before = list(walk.vehicles)
        for message in walk.flight:
            stay = Stay(message.vehicle, message.number, message.place) if isinstance(message, Ask) else None
            if stay is not None and stay not in self.asked and stay not in self.gone:
                src = self.now[stay.vehicle]
                must(walk.ground[src.place][0] == stay.vehicle, "asks: only the first in line")
                self.asked[stay] = src

    def _changed(self, number: int, before: AskingVehicle, after: AskingVehicle) -> None:
        goes = after.at != before.at
        outs = len(before.rears) + goes - len(after.rears)
        for _ in range(outs):
            self.out.add(self.inside[number].pop(0))
        wishes = [wish for wish, src in self.asked.items() if src == self.now[number]]
        if goes:
            come = Stay(number, after.number, after.place)
            self.gone |= {self.now[number], *wishes} - {come}
            self.out |= set(wishes) - {come}
            self.inside[number].append(self.now[number])
            self.now[number] = come
            self.used.add(come)
        elif after.number != before.number:  # it has given a grant back, or forgotten all that it asked for
            self.gone |= set(wishes)
            self.out |= set(wishes)


class Beside:
    """What posts do with messages, each change looked up among the steps of the model."""

    def __init__(self, truth: Truth, receive: Receive = posts.receive) -> None:
        self.truth, self._receive = truth, receive
        self.granted: set[Stay] = set()
        self.probes: set[tuple[int, int, int, int, int, int]] = set()
        """From, number, place of the asker, to, by way of, vehicle that is head there."""
        self.clears: set[tuple[int, int]] = set()
        self.steps = 0

    def __call__(self, post: Post, message: ToPost) -> posts.Answer:
        """Do what posts do."""
        after, out = self._receive(post, message)
        if after != post:
            self._changed(post, after)
        for said in out:
            self._said(after, message, said)
        return after, out

    def _changed(self, before: Post, after: Post) -> None:
        truth, place = self.truth, before.place
        left = [entry for entry in before.line if entry not in after.line]
        for entry in left:
            must(self._stay(entry, place) in truth.gone, "hears_gone: only who has gone on or given up")
        were = {(e.vehicle, e.number) for e in left} | set(before.rears)
        for vehicle, number in were - set(after.rears):
            must(Stay(vehicle, number, place) in truth.out, "hears_out: only who is out")
        must(set(after.rears) <= were, "nobody else is inside")
        stayed = [entry for entry in before.line if entry in after.line]
        must(list(after.line[: len(stayed)]) == stayed, "lines keep their order")
        kept = None if left else before.kept
        for entry in after.line[len(stayed) :]:
            self._enters(after, stayed, kept, entry, dropped=before.kept is not None and kept is None)
            kept = None
        if after.kept is not None and after.kept != before.kept:
            self._keeps(after, kept)
        self.steps += 1

    def _enters(
        self, after: Post, stayed: list[Entry], kept: Kept | None, entry: Entry, *, dropped: bool
    ) -> None:
        stay, place = self._stay(entry, after.place), after.place
        must(stay in self.truth.asked, "enters: only who has asked")
        must(stay not in self.granted, "enters: only once")
        must(len(stayed) + 1 == len(after.line), "enters: one at a time")
        self._settled(stayed, place)
        self.granted.add(stay)
        here = self.truth.asked[stay].place
        if kept is None:
            must(len(stayed) + len(after.rears) < after.slots, "enters: into a slot")
            if len(stayed) + 1 >= after.slots:
                must(
                    not dropped and stayed[0].then == here, "keeps, ends, clears: the probe would end at once"
                )
        elif kept.entry is None:
            must((kept.vehicle, kept.here) == (stay.vehicle, here), "takes: who brought the probe")
        else:
            must(kept.entry == entry, "clears: for whom the slot is kept")
            must((place, kept.probe) in self.clears, "clears: only when the answer is there")

    def _keeps(self, after: Post, before: Kept | None) -> None:
        kept, place = after.kept, after.place
        assert kept is not None
        if kept.entry is None:
            must(before is not None and before.entry is not None, "comes_back: while the slot is kept")
            assert before is not None
            way = (place, before.probe, before.here, place, kept.here, kept.vehicle)
            must(way in self.probes and kept.probe == before.probe, "comes_back: to who brought the probe")
            return
        stay = self._stay(kept.entry, place)
        must(stay in self.truth.asked and stay not in self.granted, "keeps: only who has asked")
        must(before is None and len(after.line) + 1 == after.slots, "keeps: the last slot")
        must(len(after.line) + len(after.rears) < after.slots, "keeps: a slot")
        must(kept.here == self.truth.asked[stay].place, "keeps: where the asker stands")
        self._settled(list(after.line), place)

    def _settled(self, line: list[Entry], place: int) -> None:
        known = self.truth.used | self.truth.gone
        must(all(self._stay(entry, place) in known for entry in line), "only once the last has come")

    def _said(self, after: Post, heard: ToPost, said: Message) -> None:
        place = after.place
        came = isinstance(heard, Probe) and any(
            way[:4] == (heard.origin, heard.number, heard.here, place) for way in self.probes
        )
        if isinstance(said, Probe) and said.origin == place:
            kept, head = after.kept, after.head
            must(kept is not None and kept.entry is not None and head is not None, "keeps: with a probe")
            assert kept is not None
            assert head is not None
            must(
                (said.number, said.here, said.place) == (kept.probe, kept.here, head.then), "keeps: its probe"
            )
            self.probes.add((place, said.number, said.here, said.place, place, head.vehicle))
        elif isinstance(said, Probe):
            head = after.head
            must(came and after.full and head is not None, "passes: over full places")
            assert head is not None
            must(
                place not in (said.origin, said.here) and said.place == head.then, "passes: as the head goes"
            )
            self.steps += 1
            self.probes.add((said.origin, said.number, said.here, said.place, place, head.vehicle))
        elif isinstance(said, Clear):
            assert isinstance(heard, Probe)
            must(came and place != heard.origin, "ends: where a probe has come")
            must(place == heard.here or not after.full, "ends: at the asker's place, or where there is room")
            self.steps += 1
            self.clears.add((said.place, said.number))

    @staticmethod
    def _stay(entry: Entry, place: int) -> Stay:
        return Stay(entry.vehicle, entry.number, place)
