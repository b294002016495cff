"""Which calls a running SUMO gets, by its version."""

from __future__ import annotations

from unittest.mock import MagicMock

import pytest

from loopgate.errors import TrafficError
from loopgate.traffic.running import RunningSumo
from loopgate.traffic.sumo import SumoTraffic, sumo_version


def sumo(version: str) -> MagicMock:
    """Return a SUMO of a version, with a vehicle on the only lane of an edge, which all may leave."""
    api = MagicMock()
    api.getVersion.return_value = (22, f"SUMO {version}")
    api.vehicle.getLaneID.return_value = "e_0"
    api.vehicle.getStops.side_effect = lambda *_: (
        (MagicMock(),) if api.vehicle.insertStop.called or api.vehicle.setStop.called else ()
    )
    api.vehicle.getVehicleClass.return_value = "passenger"
    api.edge.getLaneNumber.return_value = 1
    api.lane.getChangePermissions.return_value = ["passenger"]
    return api


@pytest.mark.parametrize(("version", "inserts"), [("1.20.0", False), ("1.27.1", False), ("1.28.0", True)])
def test_old_sumo_is_not_asked_to_insert_a_stop(version: str, inserts: bool) -> None:  # noqa: FBT001  a case
    """Before 1.28 that leads a vehicle another way to the end of its route."""
    api = sumo(version)
    assert SumoTraffic(api, RuntimeError).hold("v", "e", 0, 40.0)
    assert (api.vehicle.insertStop.called, api.vehicle.setStop.called) == (inserts, not inserts)


def test_a_sumo_that_is_too_old_is_refused() -> None:
    """In one line, with the version that is needed; a version in development counts by its numbers."""
    with pytest.raises(TrafficError, match=r"this is SUMO 1\.16\.0; attach needs 1\.20 or newer"):
        RunningSumo(sumo("1.16.0"))
    with pytest.raises(TrafficError, match="'libsumo' is no simulation; give the module"):
        RunningSumo("libsumo")
    assert sumo_version(sumo("v1_29_0+0123-abc")) >= (1, 29)
