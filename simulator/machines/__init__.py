"""Error models of machines, behind one protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .arrangement import ARRANGEMENTS, AXES, Arrangement
    from .arrangement_settings import (
        ARRANGEMENT,
        PRODUCTS,
        ArrangementName,
        ArrangementSettings,
        arrangement_of,
    )
    from .bases import Basis, Polynomial, SingleFunction, Spline
    from .empirical_settings import EmpiricalSettings
    from .error_names import (
        AXIS_ERRORS,
        ERRORS,
        ROTATIONS,
        SQUARENESS_ERRORS,
        TRANSLATIONS,
        AxisError,
        SquarenessError,
    )
    from .kinematic import ErrorFunction, KinematicModel, carried_vectors, error_function
    from .kinematic_settings import KinematicSettings
    from .metric import MetricModel, Scale
    from .model_kinds import Corner, CustomModelError, ErrorModelKind
    from .plane import PlaneModel, in_space
    from .protocol import (
        Array,
        ErrorModel,
        HasLines,
        Integers,
        Line,
        Parameter,
        Reported,
        TrueMachine,
        Unit,
    )
    from .settings import (
        KINDS,
        ErrorModelSettings,
        MetricSettings,
        build_error_model,
        kind_of,
    )
    from .spatial_metric import SpatialMetricModel, parameters_of_metric
    from .true_machine_settings import FurtherTrueMachine

__getattr__, __dir__ = lazily(__name__, __file__)
