# Public names of this package, each loaded from its module when it is first used.
from .adjustments import (
    FEW as FEW,
    Adjustment as Adjustment,
    adjusted as adjusted,
    adjustment_data as adjustment_data,
    adjustment_lines as adjustment_lines,
    few_degrees_of_freedom as few_degrees_of_freedom,
    freedom_words as freedom_words,
)
from .checked_files import (
    CheckedDesign as CheckedDesign,
    CheckedFile as CheckedFile,
    Wanted as Wanted,
    checked_design as checked_design,
)
from .estimates import (
    ESTIMATE_COLUMNS as ESTIMATE_COLUMNS,
    ParameterEstimate as ParameterEstimate,
    ensure_points as ensure_points,
    labels as labels,
    probe_places as probe_places,
)
from .estimator_choice import COMPARED as COMPARED, EstimatorName as EstimatorName
from .extension_results import has_exact_values as has_exact_values
from .fits import Fit as Fit
from .fitting import fit as fit
from .plates import (
    MOST_BALLS as MOST_BALLS,
    PlateAxes as PlateAxes,
    axes_of_plates as axes_of_plates,
    axes_words as axes_words,
    coordinates_data as coordinates_data,
    in_plate_axes as in_plate_axes,
    plate_axes as plate_axes,
)
from .prediction import (
    PlannedUncertainty as PlannedUncertainty,
    Prediction as Prediction,
    check as check,
    planned_uncertainty as planned_uncertainty,
    predict as predict,
)
from .qualifications import (
    Qualification as Qualification,
    given_words as given_words,
    qualification_data as qualification_data,
    qualifications_of as qualifications_of,
)
from .residuals import (
    LackOfFit as LackOfFit,
    estimated_curves as estimated_curves,
    reading_residuals as reading_residuals,
    verdict_content as verdict_content,
    verdict_data as verdict_data,
    verdict_line as verdict_line,
)
from .text_blocks import (
    iteration_lines as iteration_lines,
    map_lines as map_lines,
    scale_lines as scale_lines,
    target_lines as target_lines,
    verdict_lines as verdict_lines,
)
