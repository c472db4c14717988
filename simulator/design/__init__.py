"""A laid-out experiment as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .arrays import (
        Design,
        Observations,
        Readings,
        Rows,
        State,
        disturbed_readings,
        locations,
        measured,
        nominal_places,
        nominal_state,
        read_in_positions,
        reading_noise,
        reading_uncertainties,
    )
    from .influences.protocol import (
        DesignParts,
        Disturbed,
        Influence,
        InfluenceParameter,
        InfluenceSettings,
        or_unknown,
    )
    from .lookup import Indices, References, lengths_per_axis
    from .objects import SLIGHTLY, Flags, Machine, Probes, Tasks, Volume
    from .observations.balls import BallFunctions, BallObservations
    from .observations.calibration import (
        FAR_FROM_DRAWING,
        MOST_TIED_BALLS,
        Calibration,
        CertifiedValue,
        far_from_drawing,
    )
    from .observations.certificate_tables import read_rows
    from .observations.coordinates import (
        CalibratedBalls,
        CalibratedCoordinates,
        CoordinateCalibration,
    )
    from .observations.distances import (
        CalibratedDistances,
        DistanceCalibration,
    )
    from .observations.joint_lengths import equation_root
    from .observations.joint_values import JointValues
    from .observations.kinds import is_of_machine
    from .observations.lengths import (
        Lengths,
        length_derivative,
        length_deviations,
        length_directions,
        length_name,
        length_values,
        length_whitening,
    )
    from .observations.priors import Priors
    from .observations.radius import RadiusCalibration
    from .observations.readings import (
        expected_readings,
        offset_sensitivity,
        reading_blocks,
        reading_weights,
        rotation_sensitivity,
        seen_places,
    )
    from .observations.star import Stars
    from .observations.stated_values import (
        CertificateEntry,
        CertificateSettings,
        FileValues,
        check_keys,
        is_digital,
        read_digital,
        uncertainties_of,
        value_name,
    )
    from .observations.whitening import (
        EXACT,
        CovarianceRoot,
        Whitening,
        at_least_exact,
        covariance_root,
    )
    from .parameters import SharedLayout, shared_layout

__getattr__, __dir__ = lazily(__name__, __file__)
