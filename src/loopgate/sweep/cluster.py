"""Sweeps on a Dask cluster that exists already.

A scheduler and workers started by hand, or by dask-jobqueue on a batch system::

    dask scheduler --port 8786
    dask worker tcp://host:8786 --nworkers 8 --nthreads 1

Workers need the same `loopgate` and nothing else: networks and routes travel with the runs.
"""

import re
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager

from loopgate.errors import SweepError
from loopgate.reading import shown
from loopgate.sweep.task import own_code
from loopgate.versions import versions

_CONNECT_S = 10
_ADDRESS = re.compile(r"((tcp|tls|ucx|ws|wss)://)?[^\s/]+:\d+/?")
_CODE = "__import__('loopgate.sweep.task', fromlist=['own_code']).own_code()"
"""Asks a worker which code it runs, in words that a worker of any version can read."""


@contextmanager
def dask_executor(address: str) -> Iterator[tuple[Executor, int]]:
    """Connect to the scheduler at `address` and yield an executor with its number of worker threads.

    Raises `SweepError` if Dask is not installed, the address is none, nobody answers, there are no workers,
    or a worker has no loopgate or runs other code of it.
    """
    try:
        from distributed import Client  # noqa: PLC0415 - an extra, needed here only
    except ImportError as error:
        msg = "the dask executor needs dask.distributed; pip install 'sumo-loopgate[dask]'"
        raise SweepError(msg) from error
    # Dask's client of an address that it cannot read never ends, and prints its traceback much later.
    if not _ADDRESS.fullmatch(address):
        msg = f"scheduler {shown(address)}: no address; expected tcp://host:port, such as tcp://host:8786"
        raise SweepError(msg)
    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        msg = f"scheduler {address}: no connection within {_CONNECT_S} s ({error}); expected tcp://host:port"
        raise SweepError(msg) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_CONNECT_S)
        except TimeoutError as error:
            msg = (
                f"scheduler {address}: it has no workers; start some with: dask worker {address} --nthreads 1"
            )
            raise SweepError(msg) from error
        _check_workers(client.run(eval, _CODE, on_error="return"))
        # Runs are no pure functions to Dask: two equal calls are two attempts.
        yield client.get_executor(pure=False), sum(client.nthreads().values())


def _check_workers(codes: Mapping[str, object]) -> None:
    """Refuse workers that run other code; a later worker is refused at its first run."""
    for worker, code in sorted(codes.items()):
        if code != own_code():
            has = f"has no loopgate ({shown(code)})" if isinstance(code, BaseException) else "runs other code"
            told = f" ({code}, here {own_code()})" if isinstance(code, str) else ""
            msg = (
                f"worker {worker} {has}{told}; install loopgate {versions()['loopgate']} there as it is here"
            )
            raise SweepError(msg)
