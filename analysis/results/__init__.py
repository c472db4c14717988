"""Results that show themselves, and how they are written."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .adjustments import ARCSECOND, FEW, coverage_factor, few_degrees_of_freedom, freedom_words
    from .campaign_tests import (
        HELD,
        TOO_ALIKE,
        TOO_RARE,
        EstimatedSigma,
        JointDifference,
        Roots,
        SigmaPair,
        joint_difference,
        orthonormal,
        single_chances,
        with_common,
    )
    from .estimates import (
        EstimatedFunctions,
        Function,
        ParameterEstimate,
        estimated_functions,
        labels,
    )
    from .fit_files import fit_of_file, kind_of_file
    from .fits import Fit
    from .groupings import GROUPINGS, Grouping
    from .map_of_fit import FRAMES, MappedFit, data_of, left_out_words, maps_known
    from .observation_groups import ObservationGroup, groups_of, kinds_of_rows
    from .prediction import Prediction, length_headline, rank_words
    from .residuals import reading_residuals
    from .sigmas_by_campaign import campaign_sigmas, with_sigmas
    from .study import PlannedUncertainty, check, fit, planned_uncertainty, predict
    from .text_blocks import scale_lines, scale_warnings, target_lines

__getattr__, __dir__ = lazily(__name__, __file__)
