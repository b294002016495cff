"""Finished runs as a page that moves: positions, places, waits and deadlocks on one clock."""

from loopgate.replay.page import Replay, make_replay

__all__ = ["Replay", "make_replay"]
