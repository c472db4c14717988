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
from ballplate.simulator.inputs import OPENED, UnusableError

from .bundle import Bundle, unpack
from .execute import Runner
from .load import load_sweep
from .local import told
from .model import Sweep
from .task import CellResult, CellTask, compute, lost

# Tasks that a thread of a worker has waiting, so that it never waits itself.
WAITING = 4
# Tries of a task that is lost with a worker, beyond those of dask itself.
TRIES = 10
# Of the folders that files are unpacked in.
PREFIX = "ballplate-sweep-"
# Seconds until a scheduler answers, and until a worker comes.
CONNECTION_TIMEOUT = 10.0
PATIENCE = 30.0

LOGGERS = ("distributed", "tornado", "asyncio")

RESTART = (
    "install the same wherever a worker runs; finished cells are stored, and the same command"
    " continues from there"
)


class ClusterError(UnusableError):
    """No cluster can be used."""


class OtherVersionError(Exception):
    """A worker has other code than the process that sent it a task."""


@contextmanager
def cluster_runner(address: str, sweep: Sweep, bundle: Bundle) -> Iterator[Runner]:
    """A runner on the cluster of a scheduler such as tcp://127.0.0.1:8786, for as long as it is
    needed.

    :raises ClusterError: dask is not installed, there is no scheduler at the address or not any
        longer, or its workers have another version of ballplate, or none.
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
        # Of an address that makes no sense there may come anything.
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
            raise ClusterError(
                f"{text}; finished cells are stored, and the same command continues from there"
            ) from None

    try:
        _check_versions(client)
        yield run
    finally:
        with suppress(Exception):
            # Of a scheduler that is gone there may come anything.
            client.close(timeout=5)


def _is_there(client: Any) -> bool:
    """Whether the scheduler still answers."""
    if client.status != "running":
        return False
    try:
        client.run_on_scheduler(importlib.metadata.version, "distributed")
    except Exception:
        return False
    return True


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep to ourselves what dask logs, tracebacks among it: errors are reported in words."""
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
    """Check that all workers there are, and the scheduler, have this version of ballplate, before
    anything is sent.

    :raises ClusterError: they have not, or no worker comes.
    """
    own = importlib.metadata.version("ballplate")
    _wait(client)
    # By functions of Python itself, which are there whatever a worker has.
    found = client.run(importlib.metadata.version, "ballplate", on_error="return")
    _refuse({name: _version(answer) for name, answer in found.items()}, f"ballplate {own}")
    code = code_digest()
    digests = client.run(code_digest, on_error="return")
    told = {
        name: "" if answer == code else f"other code of ballplate {own}"
        for name, answer in digests.items()
    }
    _refuse({name: text or f"ballplate {own}" for name, text in told.items()}, f"ballplate {own}")


def _version(answer: object) -> str:
    return f"ballplate {answer}" if isinstance(answer, str) else "no ballplate"


def _refuse(found: dict[str, str], own: str) -> None:
    others = [(name, text) for name, text in found.items() if text != own]
    if others:
        name, text = others[0]
        more = f", and {len(others) - 1} more differ" if len(others) > 1 else ""
        remedy = "install the same wherever a worker runs, and start it again"
        raise ClusterError(f"the worker {name} has {text}, and this is {own}{more}; {remedy}")


@cache
def code_digest() -> str:
    """A hash of the code of ballplate: versions under development have the same number."""
    found = hashlib.blake2b(digest_size=20)
    # In a checkout the parts of the package are not in one folder.
    for package in (ballplate, ballplate.simulator):
        folder = Path(str(package.__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            name = path.relative_to(folder)
            if name.parts[0] not in ("simulator", "designs"):
                found.update(f"{package.__name__} {name.as_posix()}\n".encode())
                found.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return found.hexdigest()


def _rows(
    client: Any, sweep: Sweep, bundle: Bundle, tasks: Sequence[CellTask]
) -> Iterator[CellResult]:
    from distributed import KilledWorker, as_completed

    code = code_digest()
    sent = [_sent(client, bundle)]
    room = WAITING * max(sum(client.nthreads().values()), 1)
    left, under_way, tries = iter(tasks), {}, Counter[tuple[int, int]]()

    def submit(task: CellTask) -> object:
        future = client.submit(_on_worker, sent[0], code, task, pure=False, retries=0)
        under_way[future.key] = task
        return future

    completed = as_completed(
        [submit(task) for _, task in zip(range(room), left, strict=False)], loop=client.loop
    )
    for future in completed:
        task = under_way.pop(future.key)
        try:
            row = future.result()
        except KilledWorker:
            row = lost(sweep, task)
        except OtherVersionError:
            raise ClusterError(
                f"a worker that came later has other code than this; {RESTART}"
            ) from None
        except CancelledError:
            if client.status != "running":
                raise
            # The files went with the last worker that held them.
            tries[task.number, task.block] += 1
            if tries[task.number, task.block] > TRIES:
                row = lost(sweep, task)
            else:
                sent[0] = _sent(client, bundle)
                completed.add(submit(task))
                continue
        except (ImportError, AttributeError, TypeError) as error:
            # A worker that came later cannot even read what it is sent.
            text = (
                f"a worker that came later cannot compute ({type(error).__name__}: {error}),"
                " perhaps for lack of"
            )
            raise ClusterError(f"{text} ballplate; {RESTART}") from None
        following = next(left, None)
        if following is not None:
            completed.add(submit(following))
        yield row
        future.release()


def _sent(client: Any, bundle: Bundle) -> Any:
    """The files, with all workers.

    :raises ClusterError: no worker comes.
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
    return told(compute(_loaded(source, Path(folder.name)), task), source)


@cache
def _loaded(source: Path, folder: Path) -> Sweep:
    return load_sweep(source, folders=(folder,), trust=OPENED)


@cache
def _unpacked(bundle: Bundle) -> tuple[tempfile.TemporaryDirectory[str], Path]:
    """A folder with the files, which lasts as long as the worker, and the sweep file in it."""
    from distributed import get_worker

    # In the worker's own folder, which dask deletes also where the worker was killed.
    folder = tempfile.TemporaryDirectory(prefix=PREFIX, dir=get_worker().local_directory)
    # Modules of an earlier sweep would be taken for those of this one.
    for name, module in list(sys.modules.items()):
        if PREFIX in (getattr(module, "__file__", None) or ""):
            del sys.modules[name]
    sys.path[:] = [path for path in sys.path if PREFIX not in path]
    return folder, unpack(bundle, Path(folder.name))
