"""Result of a fit to readings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation.files import write_file
from ballplate.presentation.formatting import Data
from ballplate.presentation.scenes import Vectors, box_edges, draw_vectors, projection
from ballplate.presentation.table_columns import MainTable
from ballplate.simulator.inputs.arguments import ensure_positive, ensure_type
from ballplate.simulator.inputs.extensions import function, service
from ballplate.simulator.inputs.number_arrays import Array

from ._fit_findings import FitFindings
from ._fit_tables import fit_data, fit_lines
from .estimates import (
    ESTIMATE_COLUMNS,
    CorrectedPoints,
    ParameterEstimate,
    correct,
    ensure_points,
    labels,
    probe_places,
)
from .extension_results import IssuedCertificate
from .prediction import by_label
from .residuals import reading_residuals

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Fit(FitFindings):
    """An estimate from readings, with all that can be made of it: texts and data, covariances,
    corrected points, map, certificate, page and drawing.
    """

    def lines(self) -> list[str]:
        return fit_lines(self)

    def data(self) -> Data:
        return fit_data(self)

    def columns(self) -> MainTable:
        """One row per parameter."""
        return ESTIMATE_COLUMNS, self.estimates

    def __getitem__(self, name: str) -> ParameterEstimate:
        """The estimate of a parameter: value, standard uncertainty and unit.

        :raises KeyError: the fit has no parameter of that name.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit["EXX[1]"].unit
        'm'
        """
        return by_label(dict(zip(labels(self.estimates), self.estimates, strict=True)), name)

    def report(self, path: str | Path) -> None:
        """Write the page of the fit, a self-contained file of HTML.

        :raises OSError: the file cannot be written.
        """
        write_file(path, self.page().encode("utf-8", "replace"))

    def page(self) -> str:
        """The page of the fit as text: verdict, curves, residuals, diagnosis, reliability,
        plate.

        :raises ValueError: the fit has no experiment.
        """
        return str(function("page")(self))

    def covariance(self, *chosen: str) -> pandas.DataFrame:
        """Covariance of estimates and measuring tasks, in products of their units; NaN if
        undetermined.

        Each of `chosen` is a name or a kind: machine, pose (or origin, rotation), offset, length,
        ball, task; without any, all are chosen. `sigma` multiplies the uncertainties.

        :raises ValueError: an unknown name, or the estimate has not converged.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.covariance("machine", "r1c2: x").shape
        (70, 70)
        """
        import pandas

        functions = self.functions.choose(chosen)
        return pandas.DataFrame(
            self.sigma**2 * functions.covariance(), functions.labels, functions.labels
        )

    def correlation(self, *chosen: str) -> pandas.DataFrame:
        """Correlation coefficients of the functions of `covariance`; NaN without uncertainty.

        :raises ValueError: an unknown name, or the estimate has not converged.
        """
        covariance = self.covariance(*chosen)
        spread = np.sqrt(np.diagonal(covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            return covariance / np.outer(spread, spread)

    def correct(self, points: Array, probe: str | Sequence[str] | None = None) -> CorrectedPoints:
        """Scale readings (n, d) in metres, corrected for the estimated errors, with their joint
        covariance.

        `probe` is one name, or one for each point; by default the probe of the evaluation points.
        Corrections outside the volume are extrapolated; points farther outside than the volume's
        size are refused, since their unit is wrong.

        :raises ValueError: points of another shape or far outside the volume, an unknown probe, or
            an estimate that has not converged.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.correct([[0.1, 0.2, 0.3], [0.4, 0.2, 0.3]], "down").covariance.shape
        (6, 6)
        """
        design, names = self.design, self.design.probes.names
        checked = ensure_points(points, design.machine.volume)
        probe = names[design.evaluation.probe] if probe is None else probe
        probes = probe_places(probe, names, len(checked))
        return correct(self.functions.at, checked, probes, self.sigma)

    def to_map(self, date: str | None = None) -> Any:
        """The error map of the fit with its covariance, to be saved and applied; `date` is the day
        of the campaign, such as "2026-11-22".

        :raises ValueError: the estimate has not converged, or the date is no day.

        >>> import ballplate as bp
        >>> bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map()
        <FittedMap 5 x 5 ball plate in six positions: 69 parameters>
        """
        return service("map_of")(self, date)

    def certificate(
        self,
        plate: str | None = None,
        datum: str | Sequence[str] = (),
        coverage_factor: float | None = None,
        about: Mapping[str, str] | None = None,
    ) -> IssuedCertificate:
        """The co-ordinates of a plate's balls in its own axes with their full covariance, to be
        written as a page, tables or a digital calibration certificate.

        `datum` names the ball at the origin, one on an axis and, in space, one in the xy plane, or
        is "all"; by default corners of the plate. The coverage factor is by default that of the
        experiment, or 2. `about` has texts about date, country, laboratory and so on.

        :raises ExperimentError: no calibrated value determines the plate's lengths.
        :raises ValueError: the fit has not converged; unknown balls, plate, factor or keys.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.certificate(datum=("r1c1", "r5c1", "r1c5")).datum
        'origin: ball r1c1, y axis through ball r5c1, xy plane through ball r1c5'
        """
        names = (datum,) if isinstance(datum, str) else datum
        ensure_type(Iterable, 'names of balls, or "all"', datum=names)
        if coverage_factor is not None:
            ensure_positive("a coverage factor above 0", coverage_factor=coverage_factor)
        certificate: IssuedCertificate = service("plate_certificate")(
            self, plate, tuple(names), coverage_factor, about
        )
        return certificate

    def residual_vectors(self) -> tuple[Vectors, ...]:
        """Residuals of a converged fit, by position; in three dimensions projected, seen from the
        front and above.
        """
        design = self.design
        view, _ = projection(design.dimension)
        readings, residuals, _ = reading_residuals(design, self.solution, self.observed.x)
        places = self.observed.x[design.plate_readings]
        return tuple(
            Vectors(
                design.positions.names[k],
                places[of_position] @ view.T,
                residuals[of_position] @ view.T,
                tuple(design.balls.names[ball] for ball in readings.ball[of_position]),
            )
            for k in np.unique(readings.position)
            for of_position in [readings.position == k]
        )

    def plot(self, path: str | Path | None = None) -> Figure:
        design, vectors = self.design, self.residual_vectors() if self.converged else ()
        if not vectors:
            reason = (
                "no ball of a plate was read"
                if self.converged
                else f"the estimate has {self.solution.status}"
            )
            raise ValueError(f"there are no residuals to draw: {reason}")
        if design.dimension == 2:
            return draw_vectors(vectors, self.title, path)
        view, towards = projection(3)
        volume = design.machine.volume
        edges, _ = box_edges(volume.lower, volume.upper, towards)
        return draw_vectors(vectors, self.title, path, edges @ view.T)
