# Public names of this package, each loaded from its module when it is first used.
from .arrays import (
    Design as Design,
    Observations as Observations,
    Rows as Rows,
    measured as measured,
)
from .influence_quantities import (
    DesignParts as DesignParts,
    Disturbed as Disturbed,
    Influence as Influence,
    InfluenceParameter as InfluenceParameter,
)
from .measurement import (
    disturbed_readings as disturbed_readings,
    locations as locations,
    nominal_state as nominal_state,
    reading_noise as reading_noise,
    reading_uncertainties as reading_uncertainties,
)
from .objects import (
    SLIGHTLY as SLIGHTLY,
    Flags as Flags,
    Machine as Machine,
    Probes as Probes,
    Readings as Readings,
    Tasks as Tasks,
    Volume as Volume,
)
from .observations.balls import BallFunctions as BallFunctions, BallObservations as BallObservations
from .observations.calibration import (
    FAR_FROM_DRAWING as FAR_FROM_DRAWING,
    MOST_TIED_BALLS as MOST_TIED_BALLS,
    Calibration as Calibration,
    CertifiedValue as CertifiedValue,
    far_from_drawing as far_from_drawing,
)
from .observations.coordinates import (
    CalibratedCoordinates as CalibratedCoordinates,
    CoordinateCalibration as CoordinateCalibration,
)
from .observations.distances import (
    CalibratedDistances as CalibratedDistances,
    DistanceCalibration as DistanceCalibration,
    RadiusCalibration as RadiusCalibration,
)
from .observations.joint_lengths import equation_root as equation_root
from .observations.joint_values import JointValues as JointValues
from .observations.lengths import (
    Lengths as Lengths,
    length_derivative as length_derivative,
    length_deviations as length_deviations,
    length_directions as length_directions,
    length_name as length_name,
    length_values as length_values,
    length_whitening as length_whitening,
)
from .observations.priors import Priors as Priors
from .observations.readings import (
    expected_readings as expected_readings,
    offset_sensitivity as offset_sensitivity,
    reading_blocks as reading_blocks,
    reading_weights as reading_weights,
    rotation_sensitivity as rotation_sensitivity,
    seen_places as seen_places,
)
from .observations.star import Stars as Stars
from .observations.whitening import (
    EXACT as EXACT,
    CovarianceRoot as CovarianceRoot,
    Whitening as Whitening,
    at_least_exact as at_least_exact,
    covariance_root as covariance_root,
)
from .parameters import SharedLayout as SharedLayout, shared_layout as shared_layout
from .state import State as State
