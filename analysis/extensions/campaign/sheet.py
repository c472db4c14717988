"""Run sheet of an experiment, planned or not, with tables for the laboratory."""

from __future__ import annotations

from dataclasses import dataclass

from ballplate.presentation import Data, Result
from ballplate.simulator.experiment import Candidate, ChangeTimes, Experiment
from ballplate.simulator.inputs import refused

from ..planning import (
    RunSheet,
    in_lengths,
    settings_as_drawn,
    sheet_data,
    sheet_lines,
    steps_of,
    summary,
)
from .reading_lists import planned_readings, points_csv, points_dmis, template_csv
from .sheet_page import sheet_page


@dataclass(frozen=True, repr=False, eq=False)
class Sheet(Result):
    """A run sheet to print, the table of its readings to fill in, and the points of a program."""

    experiment: Experiment
    sheet: RunSheet

    @property
    def label(self) -> str:
        return self.experiment.label

    @property
    def title(self) -> str:
        return self.experiment.title

    def headline(self) -> str:
        return summary(self.sheet)

    def lines(self) -> list[str]:
        return [self.heading, "", *sheet_lines(self.sheet)]

    def data(self) -> Data:
        return {"experiment": self.label, **sheet_data(self.sheet)}

    def rows(self) -> list[Data]:
        """One row for each position, times in seconds."""
        return list(sheet_data(self.sheet)["steps"])

    def page(self) -> str:
        """Return the run sheet as a page of HTML to print."""
        return sheet_page(self.sheet, self.experiment, self.experiment.title)

    def template(self) -> str:
        """Return the CSV file of readings in order with empty cells, for `fit`."""
        return template_csv(planned_readings(self.sheet, self.experiment), self.experiment)

    def points(self, diameter: float | None = None) -> str:
        """Return the centres of the balls in order as a CSV file, or with a `diameter` of the balls
        (m) as DMIS.

        :raises ExperimentError: two readings would have the same name, or DMIS is asked for in two
            dimensions.
        """
        readings = planned_readings(self.sheet, self.experiment)
        if diameter is None:
            return points_csv(readings, self.experiment.dimension)
        if self.experiment.dimension == 2:
            text = "spheres in DMIS are for three dimensions; write a .csv file of points"
            raise refused(self.experiment.source, text, "machine.volume")
        styli = {name: probe.offset for name, probe in self.experiment.probes.items()}
        return points_dmis(readings, self.experiment.title, diameter, styli)


def sheet_of(experiment: Experiment) -> Sheet:
    """Return the run sheet of an experiment, in the order of its positions."""
    by_name = settings_as_drawn(experiment)
    pool = experiment.pool
    candidates = () if pool is None else pool.candidates
    timed = {candidate.name: candidate.seconds for candidate in candidates if candidate.drawn}
    sequence = []
    for position in experiment.positions:
        settings = in_lengths(by_name[position.name], position)
        plane = (settings.get("plane") if experiment.dimension == 3 else None) or ""
        seconds = timed.get(position.name, 0.0)
        candidate = Candidate(position.name, position, seconds, plane, "", True, settings)
        sequence.append((candidate, position.probes))
    changes = ChangeTimes(0.0, 0.0) if pool is None else pool.changes
    return Sheet(experiment, RunSheet(tuple(steps_of(sequence, changes)), (), bool(timed)))
