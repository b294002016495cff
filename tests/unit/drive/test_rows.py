"""Tables whose rows are described by a class."""

import numpy as np

from loopgate.drive.rows import table


class Plain:
    """Two columns."""

    length_m: float
    held: bool


class More(Plain):
    """And one more."""

    legs: int


def test_columns_are_those_of_the_class_and_its_bases() -> None:
    """What is not given is zero, one value fills a column."""
    made = table(More, {"legs": [3, 4], "length_m": 5.0})
    assert made.dtype.names == ("length_m", "held", "legs")
    assert [made.dtype[name] for name in made.dtype.names] == [np.float64, np.bool_, np.int64]
    assert made["legs"].tolist() == [3, 4]
    assert made["length_m"].tolist() == [5.0, 5.0]
    assert not made["held"].any()


def test_a_length_may_be_given_instead() -> None:
    """Also none at all."""
    assert len(table(Plain, length=0)) == 0
    assert table(Plain, {"length_m": np.nan}, length=2)["held"].tolist() == [False, False]
