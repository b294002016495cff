"""A vehicle's controller as a process, which exchanges UDP datagrams with the simulation.

A thin shell around `Controller`. What goes over the wire is in ``wire.schema.json``.
"""

from __future__ import annotations

import socket
from dataclasses import astuple

from loopgate.vehicles.controller import Answer, Controller
from loopgate.vehicles.messages import Room, ToVehicle
from loopgate.vehicles.wire import Told, WireError, pack, read_told, unpack, write_answer

__all__ = ["LARGEST", "serve"]

LARGEST = 65_507
"""Most bytes of a datagram."""

_HELLO_S, _IDLE_S = 0.5, 10.0


def serve(host: str, port: int, number: int, key: bytes) -> None:
    """Run the controller of one vehicle until the simulation ends it.

    Datagrams that are not sealed with the key, do not fit the schema, or belong to a turn that is over, get
    no answer. The simulation then treats the vehicle as silent, and the vehicle stops at its stop line.

    Raises
    ------
    OSError
        If no simulation listens at the address.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.connect((host, port))  # datagrams of other senders are ignored
        hello = pack({"vehicle": number, "hello": True}, key)
        controller, turn, last = None, 0, hello
        wire.send(hello)
        while True:
            wire.settimeout(_HELLO_S if controller is None else _IDLE_S)
            try:
                told = read_told(unpack(wire.recv(LARGEST), key))
            except TimeoutError:
                wire.send(hello)  # whether the bridge is still there
                continue
            except WireError:
                continue
            if told.event == "end":
                return
            if controller is not None and told.turn == turn:
                wire.send(last)  # the same again: the answer was lost
                continue
            if told.turn <= turn:
                continue
            if told.start is not None:
                controller = Controller.start(number, *astuple(told.start))
                answer = controller.remind()
            elif controller is None:
                continue  # the bridge has not said where the vehicle is
            else:
                answer = _react(controller, told)
            turn = told.turn
            last = pack(write_answer(number, turn, answer), key)
            wire.send(last)


def _react(controller: Controller, told: Told) -> Answer:
    """Return the answer to what the bridge tells."""
    if told.event == "line":
        since_s, now_s, ahead, here = told.figures
        return controller.at_line((since_s, controller.vehicle.id), now_s, (ahead, here), free=told.free)
    if told.event == "hear":
        message = told.message
        mine = isinstance(message, Room) or getattr(message, "vehicle", -1) == controller.vehicle.id
        return controller.hear(message) if mine and isinstance(message, ToVehicle) else Answer()
    if told.event == "crossing":
        return controller.crossing(told.figures[0], free=told.free)
    if told.event == "rear":
        return controller.rear_out()
    return controller.remind()
