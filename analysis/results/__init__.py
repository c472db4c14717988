"""Results of check, run and fit, with their tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .adjustments import FEW, Adjustment, adjusted, few_degrees_of_freedom, freedom_words
    from .checked_designs import PlannedUncertainty, check, planned_uncertainty, predict
    from .checked_files import (
        CheckedDesign,
        CheckedFile,
        Wanted,
        advised,
        check_files,
        checked_design,
    )
    from .diagnosis import has_exact_values
    from .error_functions import estimated_curves
    from .estimates import (
        ESTIMATE_COLUMNS,
        ParameterEstimate,
        labels,
    )
    from .estimator_choice import COMPARED, EstimatorName
    from .fits import Fit
    from .fitting import fit
    from .plates import axes_of_plates
    from .prediction import Prediction
    from .qualifications import (
        Qualification,
        given_words,
        of_pool,
        qualification_data,
        qualifications_of,
    )
    from .residuals import reading_residuals
    from .text_blocks import (
        MOST_BALLS,
        adjustment_data,
        adjustment_lines,
        coordinates_data,
        iteration_lines,
        scale_lines,
        target_lines,
        verdict_lines,
    )

__getattr__, __dir__ = lazily(__name__, __file__)
