"""The replay: a page that plays finished runs with positions, places, waits and deadlocks on one clock."""

from loopgate.replay.page import Replay, make_replay

__all__ = ["Replay", "make_replay"]
