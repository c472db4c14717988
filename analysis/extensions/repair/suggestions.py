"""Suggestions for a checked design: repairs, and a certificate that provides scale."""

from __future__ import annotations

from dataclasses import dataclass

from ballplate.presentation import Data
from ballplate.rank import Verdict
from ballplate.results import Prediction
from ballplate.simulator.computing import Report
from ballplate.simulator.experiment import Experiment

from .repair_search import Repairs, repairs
from .repair_tables import certificate_data, certificate_lines, repair_data, repair_lines
from .scale import ScaleCertificate, scale_certificate


@dataclass(frozen=True)
class Suggestions:
    """Repairs and certificate, each only if needed."""

    repairs: Repairs | None = None
    certificate: ScaleCertificate | None = None

    def lines(self, judged: Verdict) -> list[str]:
        """Return lines of suggestions for a design with this verdict."""
        return [*certificate_lines(self.certificate), *repair_lines(self.repairs, judged)]

    def data(self) -> Data:
        """The same as plain data in metres."""
        return {
            "repairs": repair_data(self.repairs),
            "scale_certificate": certificate_data(self.certificate),
        }


def suggested(experiment: Experiment, prediction: Prediction, report: Report) -> Suggestions:
    """Return suggestions for an experiment with its pool, whose design has this prediction."""
    suggestions = repairs(experiment, report=report)
    return Suggestions(suggestions, scale_certificate(experiment, prediction.scale))
