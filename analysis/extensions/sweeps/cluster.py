"""Execution of a sweep's tasks on a dask.distributed cluster; workers may come and go."""

from __future__ import annotations

import hashlib
import importlib.metadata
import logging
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import ballplate.simulator
from ballplate.simulator.inputs import OPENED, UnusableError, own_modules

from .bundle import Bundle, unpack
from .execute import Runner
from .load import load_sweep
from .local import with_relative_paths
from .model import Sweep
from .task import CellResult, CellTask, compute, lost

# Tasks in the queue of each thread of a worker, so that it never idles.
WAITING = 4
# Tries of a task that is lost with a worker, in addition to dask's own.
TRIES = 10
# Prefix of the folders with unpacked files.
PREFIX = "ballplate-sweep-"
# Seconds to wait for a scheduler's answer, and for a worker.
CONNECTION_TIMEOUT = 10.0
PATIENCE = 30.0

LOGGERS = ("distributed", "tornado", "asyncio")

REMEDY = "install the same ballplate on every worker"
RESTART = "finished cases are stored, and the same command continues from there"


class ClusterError(UnusableError):
    """The cluster cannot be used."""


class OtherVersionError(Exception):
    """A worker has other code than the process that sent it a task."""


@contextmanager
def cluster_runner(address: str, sweep: Sweep, bundle: Bundle) -> Iterator[Runner]:
    """Return a runner on the cluster of a scheduler such as tcp://127.0.0.1:8786.

    :raises ClusterError: dask is not installed, the scheduler does not answer (any more), or a
        worker has another version of ballplate, or none.
    """
    with _quiet():
        yield from _runner(address, sweep, bundle)


def _runner(address: str, sweep: Sweep, bundle: Bundle) -> Iterator[Runner]:
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise ClusterError(
            "dask is not installed; install it with: python -m pip install 'ballplate[dask]'"
        ) from None
    try:
        get_address_host_port(address)
    except ValueError:
        text = (
            f"{address}: is not the address of a scheduler; give one such as tcp://127.0.0.1:8786"
        )
        raise ClusterError(text) from None
    try:
        client = Client(address, timeout=CONNECTION_TIMEOUT, set_as_default=False)
    except Exception as error:
        # A senseless address may raise anything.
        text = (
            f"{address}: there is no scheduler ({type(error).__name__}); start one with: dask"
            " scheduler"
        )
        raise ClusterError(text) from None

    def run(tasks: Sequence[CellTask]) -> Iterator[CellResult]:
        try:
            yield from _rows(client, sweep, bundle, tasks)
        except (OSError, CancelledError, TimeoutError) as error:
            if _is_there(client):
                text = (
                    f"the cluster of {address} fails ({type(error).__name__}: {error}); see the log"
                    " of its scheduler"
                )
            else:
                text = f"the scheduler at {address} has ended"
            raise ClusterError(f"{text}; {RESTART}") from None

    try:
        _check_versions(client)
        yield run
    finally:
        with suppress(Exception):
            # A dead scheduler may raise anything.
            client.close(timeout=5)


def _is_there(client: Any) -> bool:
    """Return whether the scheduler still answers."""
    if client.status != "running":
        return False
    try:
        client.run_on_scheduler(importlib.metadata.version, "distributed")
    except Exception:
        return False
    return True


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence dask's logs, which include tracebacks: errors are reported as ClusterError."""
    with suppress(ImportError):
        import distributed  # noqa: F401
    # Each of dask's loggers has a level of its own, once dask is loaded.
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in LOGGERS]
    loggers = [logging.getLogger(name) for name in (*LOGGERS, *names)]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _check_versions(client: Any) -> None:
    """Check that all present workers have this version of ballplate, before anything is sent.

    :raises ClusterError: one has not, or there is no worker.
    """
    own = f"ballplate {importlib.metadata.version('ballplate')}"
    _wait(client)
    # A worker without ballplate can still run a function of Python itself.
    versions = client.run(importlib.metadata.version, "ballplate", on_error="return")
    _refuse(
        {
            name: f"ballplate {answer}" if isinstance(answer, str) else "no ballplate"
            for name, answer in versions.items()
        },
        own,
    )
    code, other = code_digest(), f"other code of {own}"
    digests = client.run(code_digest, on_error="return")
    _refuse({name: own if digest == code else other for name, digest in digests.items()}, own)


def _refuse(versions: dict[str, str], own: str) -> None:
    different = [(name, text) for name, text in versions.items() if text != own]
    if different:
        name, text = different[0]
        more = f", and {len(different) - 1} more differ" if len(different) > 1 else ""
        remedy = f"{REMEDY}, and start it again"
        raise ClusterError(f"the worker {name} has {text}, and this is {own}{more}; {remedy}")


@cache
def code_digest() -> str:
    """Return a hash of the code of ballplate: versions under development have the same number."""
    total = hashlib.blake2b(digest_size=20)
    # In a checkout the parts of the package are not in one folder.
    for package in (ballplate, ballplate.simulator):
        folder = Path(str(package.__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            name = path.relative_to(folder)
            if name.parts[0] not in ("simulator", "designs"):
                total.update(f"{package.__name__} {name.as_posix()}\n".encode())
                total.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return total.hexdigest()


def _rows(
    client: Any, sweep: Sweep, bundle: Bundle, tasks: Sequence[CellTask]
) -> Iterator[CellResult]:
    from distributed import KilledWorker, as_completed

    code = code_digest()
    sent = [_sent(client, bundle)]
    room = WAITING * max(sum(client.nthreads().values()), 1)
    remaining, under_way, tries = iter(tasks), {}, Counter[tuple[int, int]]()

    def submit(task: CellTask) -> object:
        future = client.submit(_on_worker, sent[0], code, task, pure=False, retries=0)
        under_way[future.key] = task
        return future

    completed = as_completed(
        [submit(task) for _, task in zip(range(room), remaining, strict=False)], loop=client.loop
    )
    for future in completed:
        task = under_way.pop(future.key)
        try:
            row = future.result()
        except KilledWorker:
            row = lost(sweep, task)
        except OtherVersionError:
            text = "a later worker has other code than this process"
            raise ClusterError(f"{text}; {REMEDY}; {RESTART}") from None
        except CancelledError:
            if client.status != "running":
                raise
            # The files were lost with the last worker that held them.
            tries[task.number, task.block] += 1
            if tries[task.number, task.block] > TRIES:
                row = lost(sweep, task)
            else:
                sent[0] = _sent(client, bundle)
                completed.add(submit(task))
                continue
        except (ImportError, AttributeError, TypeError) as error:
            # Without ballplate, a later worker cannot even read the task.
            text = f"a later worker cannot compute ({type(error).__name__}: {error})"
            raise ClusterError(f"{text}; {REMEDY}; {RESTART}") from None
        following = next(remaining, None)
        if following is not None:
            completed.add(submit(following))
        yield row
        future.release()


def _sent(client: Any, bundle: Bundle) -> Any:
    """Send the files to all workers.

    :raises ClusterError: there is no worker.
    """
    _wait(client)
    return client.scatter([bundle], broadcast=True)[0]


def _wait(client: Any) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise ClusterError(
            "the cluster has no workers; start some with: dask worker ADDRESS"
        ) from None


def _on_worker(bundle: Bundle, code: str, task: CellTask) -> CellResult:
    if code != code_digest():
        raise OtherVersionError
    folder, source = _unpacked(bundle)
    return with_relative_paths(compute(_loaded(source, Path(folder.name)), task), source)


@cache
def _loaded(source: Path, folder: Path) -> Sweep:
    return load_sweep(source, folders=(folder,), trust=OPENED)


@cache
def _unpacked(bundle: Bundle) -> tuple[tempfile.TemporaryDirectory[str], Path]:
    """Return a folder with the files, kept as long as the worker, and the sweep file in it."""
    from distributed import get_worker

    # In the worker's own folder, which dask deletes also where the worker was killed.
    folder = tempfile.TemporaryDirectory(prefix=PREFIX, dir=get_worker().local_directory)
    # Otherwise Python would reuse the modules of an earlier sweep.
    for name, module in list(sys.modules.items()):
        if PREFIX in (getattr(module, "__file__", None) or ""):
            del sys.modules[name]
    folders = own_modules().folders
    folders[:] = [path for path in folders if PREFIX not in path]
    return folder, unpack(bundle, Path(folder.name))
