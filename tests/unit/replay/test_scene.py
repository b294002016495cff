"""Names of streets stand where the replay names a place."""

from typing import Any, cast

import pytest

from loopgate.replay.scene import Scene

NAMES = {"52081075#6": "Rudower Chaussee", "-a_b": "", "c": "C Street"}


@pytest.mark.parametrize(
    ("place", "shown"),
    [
        ("52081075#6_1", "Rudower Chaussee (52081075#6_1)"),
        ("c_0/2", "C Street (c_0/2)"),
        ("-a_b_0", "-a_b_0"),
        ("zone1", "zone1"),
        ("elsewhere_0", "elsewhere_0"),
    ],
)
def test_a_place_has_the_name_of_its_street(place: str, shown: str) -> None:
    """The id stays beside it; where there is no name, or no lane, there is the id alone."""
    nothing = cast("Any", None)
    scene = Scene({}, nothing, nothing, nothing, nothing, {}, NAMES)
    assert scene._shown(place) == shown
