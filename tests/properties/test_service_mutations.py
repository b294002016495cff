"""The cases of the service in the drive can fail: each part is broken on purpose, and each time one notices.

The drive is compiled, so this is done to the same steps uncompiled, in a process of its own.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final

import pytest
from service_cases import CASES

from loopgate.drive import requests, service
from loopgate.drive.codes import NOBODY
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.tables import Tables

Function = Callable[..., Any]


def _after(do: Function, spoil: Callable[[Tables], None]) -> Function:
    """Return a function that does what it did, and then spoils the tables, its last argument."""

    def spoiled(*given: Any) -> Any:  # noqa: ANN401  any of them
        found = do(*given)
        spoil(given[-1])
        return found

    return spoiled


def _forget(tables: Tables) -> None:
    for place in tables.states:
        place.served = NOBODY


def _let_go(tables: Tables) -> None:
    for vehicle in tables.vehicles:
        vehicle.mover = False


def _bars_all(_i: int, state: int, t: Tables) -> bool:
    return t.states[state].mover != NOBODY


def _as_it_says(keeper: Gatekeeper, some: list[Any], now_s: float) -> Any:  # noqa: ANN401  requests
    return keeper.negotiation.order(some, keeper, now_s)


MUTATIONS: Final[dict[str, tuple[Any, str, Any]]] = {
    "nothing": (service, "NOBODY", NOBODY),
    "nobody is served": (service, "serve", lambda _t: None),
    "the one served is to move, whoever is before it": (service, "_mover", lambda i, _t: i),
    "anybody may enter": (service, "bars", lambda *_: False),
    "nobody may enter": (
        requests,
        "service",
        SimpleNamespace(**{**vars(service), "bars": _bars_all}),
    ),
    "places are not marked": (service, "_mover", _after(service._mover, _forget)),
    "what was looked at is forgotten": (service, "_begin", _after(service._begin, _forget)),
    "ways are not cleared": (service, "_clear_way", lambda *_: None),
    "no way is kept through red": (service, "_THROUGH_RED_S", math.inf),
    "every way is kept through red": (service, "_THROUGH_RED_S", 0.0),
    "the reserve holds movers": (service, "serve", _after(service.serve, _let_go)),
    "the negotiation holds movers": (Gatekeeper, "_ordered", _as_it_says),
}
"""By name: where something is broken, which name there, and what it is instead."""


def who_notices(mutation: str) -> str:
    """Return the first case that fails, if any."""
    where, name, instead = MUTATIONS[mutation]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(where, name, instead)
        for case in CASES:
            try:
                case()
            except (AssertionError, IndexError):
                return case.__name__
    return ""


@pytest.fixture(scope="module")
def noticed() -> dict[str, str]:
    """Break everything, uncompiled."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, __file__]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, str] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("mutation", [name for name in MUTATIONS if name != "nothing"])
def test_what_is_broken_is_noticed(mutation: str, noticed: dict[str, str]) -> None:
    """By some case."""
    assert noticed[mutation]


def test_nothing_is_noticed_where_nothing_is_broken(noticed: dict[str, str]) -> None:
    """So what is noticed is what was broken."""
    assert not noticed["nothing"]


if __name__ == "__main__":
    sys.stdout.write(json.dumps({mutation: who_notices(mutation) for mutation in MUTATIONS}, indent=1))
