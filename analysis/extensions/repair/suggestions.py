"""What is suggested of a design that is checked: repairs, and a certificate that carries scale."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ballplate.rank import Verdict
from ballplate.results import Prediction
from ballplate.simulator.computing import Report
from ballplate.simulator.experiment import Experiment

from .repair_search import Repairs, repairs
from .repair_tables import certificate_data, certificate_lines, repair_data, repair_lines
from .scale import ScaleCertificate, scale_certificate


@dataclass(frozen=True)
class Suggestions:
    """Repairs, None where nothing is open, and the certificate, None where none is needed."""

    repairs: Repairs | None = None
    certificate: ScaleCertificate | None = None

    def lines(self, judged: Verdict) -> list[str]:
        """What is suggested for a design that is so judged."""
        return [*certificate_lines(self.certificate), *repair_lines(self.repairs, judged)]

    def data(self) -> dict[str, Any]:
        """The same as plain data in metres."""
        return {
            "repairs": repair_data(self.repairs),
            "scale_certificate": certificate_data(self.certificate),
        }


def suggested(experiment: Experiment, prediction: Prediction, report: Report) -> Suggestions:
    """What is suggested for an experiment with its pool, whose design is so predicted."""
    suggestions = repairs(experiment, report=report)
    return Suggestions(suggestions, scale_certificate(experiment, prediction.scale))
