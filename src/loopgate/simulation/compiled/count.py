"""Which number is what: counters and words in the pool, reasons, and what is to be done to vehicles."""

from __future__ import annotations

from typing import Final

# Counters, in the pool.
VERSION: Final = 0
"""Of the books: grows with all that may lift a refusal."""
GRANTS: Final = 1
DECIDED: Final = 2
"""Rounds of decisions so far."""
WAITING: Final = 3
FRESH: Final = 4
SLOTS: Final = 5
WAYS: Final = 6
OVERRUNS: Final = 7
TRESPASSES: Final = 8
DECISIONS: Final = 9
"""What the gate itself has decided."""
ROWS: Final = 10
ACTS: Final = 11
LOST: Final = 12
"""Rows and acts of one step that found no room."""

# The trace's words by number, in the pool.
EDGE: Final = 13
LAP: Final = 14
ENTER: Final = 15
LEAVE: Final = 16
HOLD: Final = 17
GO: Final = 18
GRANT: Final = 19
REFUSE: Final = 20
FREE: Final = 21
NOT_GRANTED: Final = 22
CHAIN: Final = 23

# Reasons for a refusal.
NOTHING: Final = 0
OCCUPIED: Final = 1
CROSSING: Final = 2
DEADLOCK: Final = 3
RESERVE: Final = 4
REASONS: Final = 5

REASON: Final = 24
"""From here on, in the pool: their words."""
REFUSED: Final = 29
"""From here on, in the pool: how often each was given."""
COUNTERS: Final = 34

# What is to be done to a vehicle.
STOP: Final = 0
RELEASE: Final = 1
STEER: Final = 2
PIVOT: Final = 3
BRAKE: Final = 4
