"""Error models of machines, behind one protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .arrangement import ARRANGEMENTS, AXES, Arrangement
    from .curves import Points
    from .custom import module_file, module_source
    from .description import (
        Combination,
        MachineDescription,
        ParametricError,
        PowerSeries,
        reference_functions,
        true_volumetric,
    )
    from .empirical_settings import EmpiricalSettings
    from .error_names import SQUARENESS_ERRORS, SquarenessError
    from .kinematic import KinematicModel, error_function
    from .kinematic_settings import KinematicSettings
    from .metric import MetricModel, Scale
    from .model_kinds import Corner, ErrorModelKind
    from .plane import PlaneModel
    from .protocol import (
        Array,
        ErrorModel,
        HasLines,
        Integers,
        Parameter,
        Reported,
        TrueMachine,
        Unit,
    )
    from .settings import (
        MetricSettings,
        PythonSettings,
        build_error_model,
    )
    from .spatial_metric import SpatialMetricModel, parameters_of_metric
    from .volumetric import (
        VolumetricModel,
        meaning,
        squareness_field,
        thermal_field,
    )

__getattr__, __dir__ = lazily(__name__, __file__)
