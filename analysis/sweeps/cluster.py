"""Runs tasks of a sweep on a dask.distributed cluster; workers may come and go."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from .bundle import Bundle, unpack
from .execute import Runner
from .local import compute_in
from .model import Sweep
from .task import Row, Task, lost

# Tasks that a thread of a worker has waiting, so that it never waits itself.
WAITING = 4


class ClusterError(Exception):
    """No cluster can be used; the text says why, and what would help."""


@contextmanager
def cluster_runner(address: str, sweep: Sweep, bundle: Bundle) -> Iterator[Runner]:
    """A runner on the cluster of a scheduler such as tcp://127.0.0.1:8786, for as long as it is needed.

    :raises ClusterError: dask is not installed, or there is no scheduler at the address.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ClusterError("dask is not installed; install it with: python -m pip install 'ballplate[dask]'") from None
    try:
        client = Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        text = f"there is no scheduler at {address} ({type(error).__name__}); start one with: dask scheduler"
        raise ClusterError(text) from None

    def run(tasks: Sequence[Task]) -> Iterator[Row]:
        from distributed import KilledWorker, as_completed

        (sent,) = client.scatter([bundle], broadcast=True)
        room = WAITING * max(sum(client.nthreads().values()), 1)
        left = iter(tasks)
        under_way = {}

        def submit(task: Task) -> object:
            future = client.submit(_on_worker, sent, task, pure=False, retries=0)
            under_way[future.key] = task
            return future

        first = [submit(task) for _, task in zip(range(room), left, strict=False)]
        completed = as_completed(first, loop=client.loop)
        for future in completed:
            task = under_way.pop(future.key)
            following = next(left, None)
            if following is not None:
                completed.add(submit(following))
            try:
                yield future.result()
            except KilledWorker:
                yield lost(sweep, task)
            future.release()

    try:
        yield run
    finally:
        client.close()


def _on_worker(bundle: Bundle, task: Task) -> Row:
    _, source = _unpacked(bundle)
    return compute_in(source, task)


@cache
def _unpacked(bundle: Bundle) -> tuple[tempfile.TemporaryDirectory[str], Path]:
    """A folder with the files, which lasts as long as the worker, and the sweep file in it."""
    folder = tempfile.TemporaryDirectory(prefix="ballplate-")
    return folder, unpack(bundle, Path(folder.name))
