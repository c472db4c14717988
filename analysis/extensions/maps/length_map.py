"""Lengths between the points of a grid over the volume, by their ends, against the target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from ballplate.presentation import Data, as_data, records
from ballplate.simulator.computing import ProgressStep, Report, single_threaded, unreported
from ballplate.simulator.estimation import Linearisation, MeasuredPoints, displacements, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.geometry import even_grid
from ballplate.simulator.inputs import LengthFunction, format_length
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import expansion, pair_tiles


@dataclass(frozen=True, eq=False)
class LengthMap:
    """Lengths between all `points` (n, d) of a grid, scale readings in metres, grouped by the
    points at which they start or end.

    For each point, `undetermined` (n,) are numbers of lengths, `maximum` (n,) largest standard
    uncertainties in metres, NaN without a determined length, and `maximum_ratio` (n,) the largest
    of `coverage_factor` standard uncertainties to the target. `missed` (n,) are shares of lengths
    that miss it, undetermined ones included. Both are NaN without a target.
    """

    probe: str
    coverage_factor: float
    points: Array
    undetermined: Integers
    maximum: Array
    maximum_ratio: Array
    missed: Array

    def to_dict(self) -> Data:
        """Return plain data in metres; None where undetermined."""
        by_point = records(
            point=self.points,
            undetermined=self.undetermined,
            maximum=self.maximum,
            share_missed=self.missed,
        )
        return {
            "probe": self.probe,
            "coverage_factor": self.coverage_factor,
            "lengths": comb(len(self.points), 2),
            # Each has two ends.
            "undetermined": int(self.undetermined.sum()) // 2,
            "by_point": as_data(by_point),
        }


@single_threaded
def length_map(
    experiment: Experiment,
    grid: Sequence[int],
    report: Report = unreported,
    at: Linearisation | None = None,
) -> LengthMap:
    """Return uncertainties of all lengths between points of a grid over the volume, with numbers
    along each axis, at zero machine error.

    `report` gets the number of finished lengths; `at` is the linearised design, if known.
    """
    at = at or linearise(lay_out(experiment))
    design, probe, target = at.design, experiment.evaluation.probe, experiment.target_uncertainty
    points = even_grid(*design.machine.volume.corners, grid)
    probes = np.full(len(points), design.probes.names.index(probe))
    factor = expansion(experiment.coverage_factor) if target is None else target.coverage_factor
    n = len(points)
    undetermined, missed = np.zeros((2, n), np.int64)
    maximum, maximum_ratio = np.full((2, n), np.nan)
    finished, count = 0, comb(n, 2)
    report(ProgressStep("lengths", finished, count))
    for tile in pair_tiles(displacements(at, MeasuredPoints(points, probes))):
        values = np.where(tile.is_open, np.nan, tile.uncertainties)
        ratios = (
            np.full(len(values), np.nan)
            if target is None
            else factor * (values / target.stated.at(tile.lengths))
        )
        for ends in (tile.first, tile.second):
            undetermined += np.bincount(ends[tile.is_open], minlength=n)
            missed += np.bincount(ends[~(ratios <= 1.0)], minlength=n)
            np.fmax.at(maximum, ends, values)
            np.fmax.at(maximum_ratio, ends, ratios)
        finished += len(values)
        report(ProgressStep("lengths", finished, count))
    shares = np.full(n, np.nan) if target is None else missed / (n - 1)
    return LengthMap(probe, factor, points, undetermined, maximum, maximum_ratio, shares)


def target_words(target: LengthFunction) -> str:
    """Return the target as text.

    >>> target_words(LengthFunction(5e-7, 1e-6))
    '0.5 µm + L/1000000'
    """
    return format_length(target.constant) + (f" + L/{1 / target.slope:.9g}" if target.slope else "")
