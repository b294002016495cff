"""A vehicle's controller as a process, which exchanges UDP datagrams with the simulation.

A thin shell around `Controller`. What goes over the wire is in ``wire.schema.json``.
"""

from __future__ import annotations

import socket
from typing import Any

from loopgate.vehicles.controller import Answer, Controller
from loopgate.vehicles.messages import Grant, Offer, Refuse, Room
from loopgate.vehicles.wire import WireError, decode, pack, unpack, write_answer

__all__ = ["LARGEST", "serve"]

LARGEST = 65_507
"""Most bytes of a datagram."""

_HELLO_S, _IDLE_S = 0.5, 10.0


def serve(host: str, port: int, number: int) -> None:
    """Run the controller of one vehicle until the simulation ends it.

    Datagrams that do not fit the schema get no answer. The simulation then treats the vehicle as silent, and
    the vehicle stops at its stop line.

    Raises
    ------
    OSError
        If no simulation listens at the address.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.connect((host, port))  # datagrams of other senders are ignored
        hello = pack({"vehicle": number, "hello": True})
        controller, turn, last = None, 0, hello
        wire.send(hello)
        while True:
            wire.settimeout(_HELLO_S if controller is None else _IDLE_S)
            try:
                said = unpack(wire.recv(LARGEST))
                if said.get("event") == "end":
                    return
                if controller is not None and said.get("turn") == turn:
                    wire.send(last)  # the same again: the answer was lost
                    continue
                turn = int(said["turn"])
                if said["event"] == "start":
                    controller = _start(number, said)
                    answer = controller.remind()
                else:
                    answer = _told(controller, said)
            except TimeoutError:
                wire.send(hello)  # whether the bridge is still there
                continue
            except (WireError, KeyError, TypeError, ValueError):
                continue
            last = pack(write_answer(number, turn, answer))
            wire.send(last)


def _start(number: int, said: dict[str, Any]) -> Controller:
    """Return a controller with this knowledge."""
    loop, rears = (tuple(map(int, said[name])) for name in ("loop", "rears"))
    crowded = float(said["crowded"])
    return Controller.start(number, loop, int(said["at"]), rears, int(said["clock"]), crowded)


def _told(controller: Controller | None, said: dict[str, Any]) -> Answer:
    """Return the answer to a datagram of the bridge."""
    event = said["event"]
    if controller is None:
        msg = "the bridge has not said where the vehicle is"
        raise WireError(msg)
    if event == "line":
        stamp = float(said["since_s"]), controller.vehicle.id
        shares = float(said["ahead"]), float(said["here"])
        return controller.at_line(stamp, float(said["now_s"]), shares, free=said["free"] is True)
    if event == "hear":
        message = decode(said["message"])
        return controller.hear(message) if isinstance(message, Grant | Refuse | Offer | Room) else Answer()
    if event == "crossing":
        return controller.crossing(float(said["now_s"]), free=said["free"] is True)
    if event == "rear":
        return controller.rear_out()
    return controller.remind() if event == "patience" else Answer()
