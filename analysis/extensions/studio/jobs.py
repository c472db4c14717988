"""Long computations of the studio: each in a process of its own, which can be stopped."""

from __future__ import annotations

import base64
import multiprocessing
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.extensions.repair.written import position_settings
from ballplate.presentation import Data, finite, picked
from ballplate.simulator.computing import (
    EnoughError,
    ProgressStep,
    Report,
    begin_worker,
    interruptions_blocked,
)
from ballplate.simulator.experiment import Position, lay_out
from ballplate.simulator.inputs import ExperimentError, number_of

from .answers import place_data
from .document import DesignDocument
from .drafts import evaluable_of

Work = Callable[[DesignDocument, Mapping[str, Any], Report], Any]

# Most computations beside one another.
MOST_RUNNING = 2

# Seconds for a process that is asked to end.
PATIENCE = 2.0

# Computations that end with the best result so far when they are stopped for the first time.
WITH_BEST = frozenset({"plan"})

# Data sets of Monte Carlo unless another number is asked for.
TRIALS = 256


def _suggest(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from .suggestions import suggested_repairs

    return suggested_repairs(document, report)


def _next(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from .suggestions import next_positions

    return next_positions(document, report)


def _monte_carlo(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from ballplate.montecarlo import trials
    from ballplate.results import predict

    experiment = evaluable_of(document)
    result = trials(experiment, int(settings.get("trials", TRIALS)), report=report)
    return {"lines": replace(predict(experiment), monte_carlo=result).lines()}


def _plan(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from ballplate.planning import HOUR, Budget, Request, campaign

    hours = settings.get("hours")
    request = Request(budget=None if hours is None else Budget(HOUR * float(hours)))
    found = campaign(evaluable_of(document, planning=True), request, report=report)
    chosen, lengths = found.chosen_experiment, found.prediction.quantities.get("U6")
    return {
        "lines": found.lines(),
        "words": f"the plan: {number_of(len(chosen.positions), 'position')}, {found.spent.budget}",
        "average": None if lengths is None else finite(lengths.average),
        "maximum": None if lengths is None else finite(lengths.maximum),
        "deficiency": found.prediction.verdict.deficiency,
        "places": [place_data(chosen, place) for place in chosen.positions],
        "plan": [position_settings(chosen, place) for place in chosen.positions],
        "calibration": [
            candidate.name for candidate in found.chosen if not isinstance(candidate.item, Position)
        ],
    }


def _sweep(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from .sweeping import swept

    return swept(document, settings.get("axes"), report)


def _ensure_sweep(document: DesignDocument, settings: Mapping[str, Any]) -> None:
    from .sweeping import ensure_possible

    ensure_possible(document, settings.get("axes"))


def _fit(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    """The fit of readings that were dropped on the page, with their residuals at the balls."""
    from ballplate.results import fit, reading_residuals
    from ballplate.simulator.readings import read_readings

    experiment = evaluable_of(document)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / (Path(str(settings["name"])).name or "readings.csv")
        file.write_bytes(base64.b64decode(str(settings["content"])))
        observed = read_readings([file], lay_out(experiment), settings=experiment.readings)
    result = fit(experiment, observed)
    data: Data = {"lines": result.lines(), "notes": list(result.notes)}
    if result.converged:
        design = result.design
        readings, residuals, standardised = reading_residuals(
            design, result.solution, result.observed.x
        )
        data["residuals"] = {
            "position": [design.positions.names[k] for k in readings.position],
            "place": result.observed.x[design.plate_readings].tolist(),
            "value": residuals.tolist(),
            "standardised": np.abs(standardised).max(axis=1).tolist(),
        }
    return data


JOBS: Mapping[str, Work] = {
    "suggest": _suggest,
    "next": _next,
    "monte carlo": _monte_carlo,
    "plan": _plan,
    "sweep": _sweep,
    "fit": _fit,
}
"""Computations that can run alongside the studio; to add one, write a function and a line here."""

CHECKS: Mapping[str, Callable[[DesignDocument, Mapping[str, Any]], None]] = {"sweep": _ensure_sweep}
"""Checks of the settings of a computation before it begins."""


@dataclass
class Job:
    """A computation in a process of its own, of the design with a `fingerprint`: `state` is
    running, done or failed, `step` its progress, `result` its outcome or the reason of its
    failure, and `page` its page, if any. It is asked by the event `enough` to end with the best
    result so far. Its temporary files are in a `folder` that is removed
    with it, since a stopped process removes no file.
    """

    name: str
    fingerprint: str
    process: BaseProcess
    connection: Connection
    folder: str
    enough: Event
    state: str = "running"
    step: str = ""
    result: Any = None
    page: str = ""

    def look(self) -> None:
        """Receive messages of the process."""
        try:
            while self.state == "running" and self.connection.poll():
                kind, message = self.connection.recv()
                if kind == "step":
                    self.step = message
                elif kind == "page":
                    self.page = message
                else:
                    self.state, self.result = kind, message
        except (EOFError, OSError):
            self.state, self.result = "failed", "the computation ended without a result"

    def end_with_best(self) -> bool:
        """Ask for the best result so far; True if there can be one and it was not asked before."""
        self.look()
        can_end = self.state == "running" and self.name in WITH_BEST and not self.enough.is_set()
        if can_end:
            self.enough.set()
        return can_end

    def stop(self) -> None:
        """End the process, which may be one that does not listen."""
        self.process.terminate()
        self.process.join(PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.connection.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def to_dict(self, number: int) -> Data:
        return {
            "id": number,
            "job": self.name,
            **picked(self, "fingerprint", "state", "step", "result"),
            "page": bool(self.page),
            "ending": self.state == "running" and self.enough.is_set(),
        }


def started(name: str, document: DesignDocument, settings: Mapping[str, Any]) -> Job:
    """Start a computation with the present document.

    :raises KeyError: there is no such job.
    :raises ActionError: its settings are invalid.
    :raises ExperimentError: the text is invalid, if this is detected before the start.
    """
    JOBS[name]
    if name in CHECKS:
        CHECKS[name](document, settings)
    # A new interpreter: a copy of this process would have its threads' locks without the threads.
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    folder = tempfile.mkdtemp(prefix="ballplate-studio-")
    enough = context.Event()
    arguments = (folder, sender, name, document, dict(settings), enough)
    process = context.Process(target=_work_in, args=arguments, daemon=True)
    with interruptions_blocked():
        process.start()
    sender.close()
    return Job(name, document.fingerprint, process, receiver, folder, enough)


def _work_in(
    folder: str,
    connection: Connection,
    name: str,
    document: DesignDocument,
    settings: Mapping[str, Any],
    enough: Event,
) -> None:
    """Work in a process of its own, with its temporary files in a folder."""
    begin_worker(os.getppid())
    tempfile.tempdir = folder
    _work(connection, name, document, settings, enough)


def _work(
    connection: Connection,
    name: str,
    document: DesignDocument,
    settings: Mapping[str, Any],
    enough: Event | None = None,
) -> None:
    def report(step: ProgressStep) -> None:
        connection.send(("step", str(step)))
        if step.can_end and enough is not None and enough.is_set():
            raise EnoughError

    try:
        result = JOBS[name](document, settings, report)
        if isinstance(result, dict) and (page := result.pop("page", "")):
            connection.send(("page", page))
    except ExperimentError as error:
        connection.send(("failed", "\n".join(map(str, error.messages))))
    except Exception as error:
        # Whatever it is, a person who waits is told of it.
        connection.send(("failed", str(error) or type(error).__name__))
    else:
        connection.send(("done", result))
    finally:
        connection.close()
