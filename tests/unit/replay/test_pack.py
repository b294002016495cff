"""Columns come back as they were."""

import base64
import json
import zlib

import numpy as np
import pytest

from loopgate.replay.pack import Pack


def unpacked(pack: Pack, places: list[list[int]]) -> list[list[int]]:
    content = zlib.decompress(base64.b64decode(pack.text({"here": places})))
    size = int.from_bytes(content[:4], "little")
    assert json.loads(content[4 : 4 + size]) == {"here": places}
    columns = []
    for at, length, width, differences in places:
        planes = np.frombuffer(content, np.uint8, width * length, 4 + size + at).reshape(width, length)
        folded = np.zeros(length, dtype=np.int64)
        for k, plane in enumerate(planes):
            folded |= plane.astype(np.int64) << (8 * k)
        values = (folded >> 1) ^ -(folded & 1)
        for _ in range(differences):
            values = np.cumsum(values)
        columns.append(values.tolist())
    return columns


def test_columns_come_back() -> None:
    """Whatever their size and sign, and however often differences are taken."""
    numbers = [[3, 1, 4, 1, -5], [0, 10**8, -(10**8)], [], [7]]
    pack = Pack()
    places = [pack.column(column, differences=times) for times, column in enumerate(numbers)]
    assert unpacked(pack, places) == numbers


def test_even_driving_costs_next_to_nothing() -> None:
    """Second differences of even motion are zeros: a hundred thousand positions in a few hundred bytes."""
    pack = Pack()
    pack.column(np.arange(100_000) * 137, differences=2)
    assert len(pack.text({})) < 500


def test_numbers_that_the_page_cannot_hold_are_refused() -> None:
    """The page reads 32 bits."""
    with pytest.raises(ValueError, match="too large"):
        Pack().column([2**40])
