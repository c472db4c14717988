"""Long computations of the studio: each in a process of its own, which can be stopped."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.extensions.repair.written import position_settings
from ballplate.presentation import Data, picked
from ballplate.simulator.computing import Report
from ballplate.simulator.experiment import Position, lay_out
from ballplate.simulator.inputs import ExperimentError

from .actions import ActionError
from .answers import place_data
from .document import DesignDocument
from .drafts import evaluable_of
from .processes import Work, Worker
from .suggestions import next_positions, suggested_repairs
from .sweeping import ensure_possible, swept

# Most computations beside one another.
MOST_RUNNING = 2

# Computations that end with the best result so far when they are stopped for the first time.
WITH_BEST = frozenset({"plan"})

# Data sets of Monte Carlo unless another number is asked for.
TRIALS = 256


def _monte_carlo(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from ballplate.montecarlo import trials
    from ballplate.results import predict

    experiment = evaluable_of(document)
    result = trials(experiment, int(settings.get("trials", TRIALS)), report=report)
    return {"lines": replace(predict(experiment), monte_carlo=result).lines()}


def _plan(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    from ..planning import HOUR, Budget, Request, campaign

    hours = settings.get("hours")
    request = Request(budget=None if hours is None else Budget(HOUR * float(hours)))
    found = campaign(evaluable_of(document, planning=True), request, report=report)
    chosen, lengths = found.chosen_experiment, found.prediction.quantities.get("U6")
    return {
        "lines": found.lines(),
        "words": f"the plan: {found.spent.budget}",
        **({} if lengths is None else picked(lengths, "average", "maximum")),
        "deficiency": found.prediction.verdict.deficiency,
        "places": [place_data(chosen, place) for place in chosen.positions],
        "plan": [position_settings(chosen, place) for place in chosen.positions],
        "calibration": [
            candidate.name for candidate in found.chosen if not isinstance(candidate.item, Position)
        ],
    }


def _fit(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> Any:
    """The fit of readings that were dropped on the page, with their residuals at the balls."""
    from ballplate.results import fit, reading_residuals
    from ballplate.simulator.readings import read_readings

    experiment = evaluable_of(document)
    # In the folder of this process, which is removed with it.
    file = Path(tempfile.mkdtemp()) / (Path(str(settings["name"])).name or "readings.csv")
    file.write_bytes(base64.b64decode(str(settings["content"])))
    observed = read_readings([file], lay_out(experiment), settings=experiment.readings)
    result = fit(experiment, observed)
    data: Data = {"lines": result.lines(), "notes": result.notes}
    if result.converged:
        design = result.design
        readings, residuals, standardised = reading_residuals(
            design, result.solution, result.observed.x
        )
        data["residuals"] = {
            "position": [design.positions.names[k] for k in readings.position],
            "place": result.observed.x[design.plate_readings],
            "value": residuals,
            "standardised": np.abs(standardised).max(axis=1),
        }
    return data


JOBS: Mapping[str, Work] = {
    "suggest": suggested_repairs,
    "next": next_positions,
    "monte carlo": _monte_carlo,
    "plan": _plan,
    "sweep": swept,
    "fit": _fit,
}
"""Computations that can run alongside the studio; to add one, write a function and a line here."""

CHECKS = {"sweep": ensure_possible}
"""Checks of the settings of a computation before it begins."""


@dataclass
class Job:
    """A computation of the design with a `fingerprint` in the `file` of that name, in a process of
    its own: `state` is running, done or failed, `result` its outcome or the reason of its failure,
    and `page` its page, if any. It `is_ending` if it was asked for the best result so far.
    """

    name: str
    file: str
    fingerprint: str
    worker: Worker
    state: str = "running"
    result: Any = None
    page: str = ""
    is_ending: bool = False

    def look(self) -> None:
        """Take the outcome, if there is one."""
        if self.state != "running":
            return
        try:
            result = self.worker.look()
        except (ActionError, ExperimentError) as error:
            self.state, self.result = "failed", in_words(error)
        else:
            if self.worker.is_busy:
                return
            if isinstance(result, dict):
                self.page = result.pop("page", "")
            self.state, self.result = "done", result
        self.worker.stop()

    def end_with_best(self) -> bool:
        """Ask for the best result so far; True if there can be one and it was not asked before."""
        self.look()
        if self.state != "running" or self.name not in WITH_BEST or self.is_ending:
            return False
        self.worker.end()
        self.is_ending = True
        return True

    def to_dict(self, number: int) -> Data:
        return {
            "id": number,
            "job": self.name,
            **picked(self, "file", "fingerprint", "state", "result"),
            "step": self.worker.step,
            "page": bool(self.page),
            "ending": self.state == "running" and self.is_ending,
        }


def started(name: str, document: DesignDocument, settings: Mapping[str, Any]) -> Job:
    """Start a computation with the present document.

    :raises KeyError: there is no such job.
    :raises ActionError: its settings are invalid.
    :raises ExperimentError: the text is invalid, if this is detected before the start.
    """
    if name in CHECKS:
        CHECKS[name](document, settings)
    job = Job(name, document.path.name, document.fingerprint, Worker())
    job.worker.begin(JOBS[name], document, settings)
    return job


def in_words(error: Exception) -> str:
    """Return what is wrong, each message about a file with its path."""
    if not isinstance(error, ExperimentError):
        return str(error)
    return "; ".join(one.text_with_path for one in error.messages)
