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
        locations,
        measured,
        nominal_places,
        nominal_state,
        reading_noise,
        reading_uncertainties,
    )
    from .influences.protocol import (
        DesignParts,
        Disturbed,
        InfluenceParameter,
        InfluenceSettings,
    )
    from .influences.temperature import TemperaturesSettings
    from .lookup import Indices, References
    from .objects import Flags, Tasks, Volume
    from .observations.balls import BallObservations
    from .observations.calibration import Calibration
    from .observations.coordinates import CalibratedCoordinates, CoordinateCalibration
    from .observations.distances import CalibratedDistances, DistanceCalibration
    from .observations.joint_values import JointValues
    from .observations.lengths import Lengths, length_name, length_whitening
    from .observations.priors import Priors
    from .observations.python_values import PythonCalibration
    from .observations.radius import RadiusCalibration
    from .observations.readings import offset_sensitivity, reading_blocks, rotation_sensitivity
    from .observations.star import Stars
    from .observations.stated_values import CertificateEntry, FileValues, value_name
    from .observations.whitening import at_least_exact
    from .parameters import SharedLayout, shared_layout

__getattr__, __dir__ = lazily(__name__, __file__)
