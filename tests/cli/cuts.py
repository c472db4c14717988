"""Commands cut short by a signal wherever they open, link, rename or remove a file that they write.

``python -m tests.cli.cuts`` reads a task as JSON: command lines by name, the folder that all of them
write into, and what is there before; it prints what every cut has left.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ballplate import cli
from ballplate.planning import campaign

EVENTS = ("open", "os.link", "os.rename", "os.remove")
# Longer than a command has for an orderly end, with another signal before that.
PAUSES = (0.2, 0.5)


def cutting(folder: Path, pipe: int, cut: int, number: int, is_slow: bool) -> Callable[..., None]:
    """A hook that writes each event at a file of the folder into a pipe, and sends a signal at one
    of them.
    """
    count = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        if event in EVENTS and any(str(one).startswith(f"{folder}/") for one in arguments[:2]):
            os.write(pipe, f"{event}\n".encode())
            count += 1
            if count == cut:
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


def main() -> None:
    task = json.load(sys.stdin)
    folder = Path(task["folder"])
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
            there = {one.name: one.read_bytes().decode("latin-1") for one in folder.iterdir()}
            print(json.dumps({"name": name, "there": there, **more}), flush=True)

        prepare()
        # Modules are loaded, and results that take long are there, in all that is forked later.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            cli.main(line)
        report(cut=0)
        prepare()
        events = run(line, folder, 0, 0, False)[1].split()
        for number in task["signals"]:
            for cut, event in enumerate(events, 1):
                if cut % task["every"] == number % task["every"] or event == "os.rename":
                    prepare()
                    is_slow = task["slow"] and (event, number) == ("os.rename", signal.SIGTERM)
                    status = run(line, folder, cut, number, is_slow)[0]
                    report(cut=cut, event=event, number=number, status=status)


if __name__ == "__main__":
    main()
