"""Commands cut short by a signal wherever they open, link, rename or remove a file that they write,
and before every statement to a store.

``python -m tests.cli.cuts`` reads a task as JSON: command lines by name, the folder that all of them
write into, what is there before, and what is done in a studio; it prints what every cut has left.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ballplate import cli
from ballplate.extensions.planning import campaign_choice as campaign
from ballplate.extensions.sweeps import task as sweep_task

EVENTS = ("open", "os.link", "os.rename", "os.remove")
# Further events, which are raised here: statements to stores, and that a studio has acted.
OURS = "ballplate."
ACTED, COMMIT = f"{OURS}acted", f"{OURS}COMMIT"
# Those at which there is always a cut.
ALWAYS = ("os.rename", COMMIT)
# Longer than a command has for an orderly end, with another signal before that.
PAUSES = (0.2, 0.5)


def cutting(folder: Path, pipe: int, cut: int, number: int, is_slow: bool) -> Callable[..., None]:
    """A hook that writes each event at a file of the folder into a pipe, and sends a signal at one
    of them; of an opening that empties the file, when it is empty.
    """
    count = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        is_one = event in EVENTS or event.startswith(OURS)
        if is_one and any(str(one).startswith(f"{folder}/") for one in arguments[:2]):
            os.write(pipe, f"{event}\n".encode())
            count += 1
            if count == cut:
                if event == "open" and arguments[2] & os.O_TRUNC and Path(arguments[0]).exists():
                    os.truncate(arguments[0], 0)
                os.kill(os.getpid(), number)
                for pause in PAUSES if is_slow else ():
                    time.sleep(pause)
                    os.kill(os.getpid(), number)

    return hook


def run(line: list[str], folder: Path, cut: int, number: int, is_slow: bool) -> tuple[int, str]:
    """The status of a command that is cut, and its events."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        status = 99
        try:
            for stream in range(3):
                os.dup2(os.open(os.devnull, os.O_RDWR), stream)
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.addaudithook(cutting(folder, writer, cut, number, is_slow))
            sys.argv = ["ballplate", *line]
            status = cli.main()
        finally:
            os._exit(status)
    os.close(writer)
    with open(reader, encoding="utf-8") as events:
        said = events.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said


def remains(**task: object) -> list[dict[str, Any]]:
    """What a process of its own prints of a task, an undisturbed run first."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.cli.cuts"],
        input=json.dumps(task),
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def edit(actions: list[dict[str, str]]) -> None:
    """Let the studio do what its page would ask for instead of serving, in a thread as its server
    does, and compute no figures.
    """
    from ballplate.extensions.studio import processes, serving

    def serve(session: Any, *_: object) -> None:
        def act() -> None:
            for action in actions:
                session.act(action)
                sys.audit(ACTED, session.path)

        thread = threading.Thread(target=act)
        thread.start()
        thread.join()

    vars(serving)["serve"] = serve
    type.__setattr__(processes.Worker, "begin", lambda *_: 0)


def trace(blocks: int) -> None:
    """Raise an event before each statement to a store, and let sweeps have small blocks."""
    connect = sqlite3.connect

    def connected(*arguments: Any, **options: Any) -> sqlite3.Connection:
        connection = connect(*arguments, **options)
        path = connection.execute("PRAGMA database_list").fetchone()[2]
        connection.set_trace_callback(lambda text: sys.audit(OURS + text.split()[0], path))
        return connection

    vars(sqlite3)["connect"] = connected
    vars(sweep_task)["BLOCK"] = blocks


def content(folder: Path) -> dict[str, str]:
    return {one.name: one.read_bytes().decode("latin-1") for one in folder.iterdir()}


def main() -> None:
    task = json.load(sys.stdin)
    folder = Path(task["folder"])
    if "actions" in task:
        edit(task["actions"])
    if "blocks" in task:
        trace(task["blocks"])
    search = campaign.campaign
    found: list[Any] = []

    def once(*arguments: Any) -> Any:
        found[:] = found or [search(*arguments)]
        return found[0]

    # What is tested comes after the search.
    vars(campaign)["campaign"] = once
    for name, line in task["lines"].items():

        def prepare(name: str = name) -> None:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for file, text in task["before"][name].items():
                (folder / file).write_text(text, encoding="utf-8")

        def report(name: str = name, **more: Any) -> None:
            print(json.dumps({"name": name, "there": content(folder), **more}), flush=True)

        prepare()
        # Modules are loaded, and results that take long are there, in all that is forked later.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            cli.main(line)
        prepare()
        events = run(line, folder, 0, 0, False)[1].split()
        report(cut=0, met=events)
        for number in task["signals"]:
            for cut, event in enumerate(events, 1):
                if cut % task["every"] == number % task["every"] or event in ALWAYS:
                    prepare()
                    is_slow = task["slow"] and (event, number) == ("os.rename", signal.SIGTERM)
                    status, said = run(line, folder, cut, number, is_slow)
                    more = {"event": event, "number": number, "status": status}
                    report(cut=cut, met=said.split(), **more)
                    if "blocks" in task:
                        # The same command continues.
                        status, said = run(line, folder, 0, 0, False)
                        report(cut=cut, met=said.split(), **more | {"status": status})


if __name__ == "__main__":
    main()
