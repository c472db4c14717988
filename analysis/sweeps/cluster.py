"""Runs tasks of a sweep on a dask.distributed cluster; workers may come and go."""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from .bundle import Bundle, unpack
from .execute import Runner
from .load import load_sweep
from .local import told
from .model import Sweep
from .task import Row, Task, compute, lost

# Tasks that a thread of a worker has waiting, so that it never waits itself.
WAITING = 4
# Tries of a task that is lost with a worker, beyond those of dask itself.
TRIES = 10
# Of the folders that files are unpacked in.
PREFIX = "ballplate-sweep-"


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
    except Exception as error:
        # Of an address that makes no sense there may come anything.
        text = f"there is no scheduler at {address} ({type(error).__name__}); start one with: dask scheduler"
        raise ClusterError(text) from None

    def run(tasks: Sequence[Task]) -> Iterator[Row]:
        yield from _rows(client, sweep, bundle, tasks)

    try:
        yield run
    finally:
        client.close()


def _rows(client: Any, sweep: Sweep, bundle: Bundle, tasks: Sequence[Task]) -> Iterator[Row]:
    from concurrent.futures import CancelledError

    from distributed import KilledWorker, as_completed

    sent = [_sent(client, bundle)]
    room = WAITING * max(sum(client.nthreads().values()), 1)
    left, under_way, tries = iter(tasks), {}, Counter[tuple[int, int]]()

    def submit(task: Task) -> object:
        future = client.submit(_on_worker, sent[0], task, pure=False, retries=0)
        under_way[future.key] = task
        return future

    completed = as_completed([submit(task) for _, task in zip(range(room), left, strict=False)], loop=client.loop)
    for future in completed:
        task = under_way.pop(future.key)
        try:
            row = future.result()
        except KilledWorker:
            row = lost(sweep, task)
        except CancelledError:
            # The files went with the last worker that held them.
            tries[task.number, task.block] += 1
            if tries[task.number, task.block] > TRIES:
                row = lost(sweep, task)
            else:
                sent[0] = _sent(client, bundle)
                completed.add(submit(task))
                continue
        following = next(left, None)
        if following is not None:
            completed.add(submit(following))
        yield row
        future.release()


def _sent(client: Any, bundle: Bundle) -> Any:
    """The files, with all workers.

    :raises ClusterError: no worker comes.
    """
    try:
        client.wait_for_workers(1, timeout=30)
        return client.scatter([bundle], broadcast=True)[0]
    except TimeoutError:
        raise ClusterError("the cluster has no workers; start some with: dask worker ADDRESS") from None


def _on_worker(bundle: Bundle, task: Task) -> Row:
    folder, source = _unpacked(bundle)
    return told(compute(_loaded(source, Path(folder.name)), task), source)


@cache
def _loaded(source: Path, folder: Path) -> Sweep:
    return load_sweep(source, folders=(folder,))


@cache
def _unpacked(bundle: Bundle) -> tuple[tempfile.TemporaryDirectory[str], Path]:
    """A folder with the files, which lasts as long as the worker, and the sweep file in it."""
    folder = tempfile.TemporaryDirectory(prefix=PREFIX)
    # Modules of an earlier sweep would be taken for those of this one.
    for name, module in list(sys.modules.items()):
        if PREFIX in (getattr(module, "__file__", None) or ""):
            del sys.modules[name]
    sys.path[:] = [path for path in sys.path if PREFIX not in path]
    return folder, unpack(bundle, Path(folder.name))
