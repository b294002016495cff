"""``loopgate vehicle``: the controller of one vehicle, as a process of its own."""

from __future__ import annotations

import os

import click

from loopgate.errors import LoopgateError


@click.command()
@click.option("--bridge", required=True, metavar="HOST:PORT", help="Where the bridge to the vehicle listens.")
@click.option("--number", required=True, type=click.IntRange(min=0), help="The number of the vehicle.")
def vehicle(bridge: str, number: int) -> None:
    """Decide for one vehicle, over UDP; runs with --decide processes start these themselves."""
    from loopgate.vehicles.process import serve
    from loopgate.vehicles.wire import KEY

    host, _, port = bridge.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        msg = f"--bridge is {bridge!r}; expected HOST:PORT, as 127.0.0.1:40000"
        raise LoopgateError(msg)
    try:
        key = bytes.fromhex(os.environ.get(KEY, ""))
    except ValueError:
        key = b""
    if not key:
        msg = f"{KEY} holds no key; expected the hexadecimal digits that the run gives its controllers"
        raise LoopgateError(msg)
    try:
        serve(host, int(port), number, key)
    except OSError as error:
        msg = f"--bridge {bridge}: {error.strerror or error}"
        raise LoopgateError(msg) from error
