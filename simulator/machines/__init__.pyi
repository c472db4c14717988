# Public names of this package, each loaded from its module when it is first used.
from .arrangement import (
    ARRANGEMENT as ARRANGEMENT,
    ARRANGEMENTS as ARRANGEMENTS,
    AXIS_ERRORS as AXIS_ERRORS,
    ERRORS as ERRORS,
    PRODUCTS as PRODUCTS,
    ROTATIONS as ROTATIONS,
    SQUARENESS_ERRORS as SQUARENESS_ERRORS,
    TRANSLATIONS as TRANSLATIONS,
    Arrangement as Arrangement,
    ArrangementName as ArrangementName,
    ArrangementSettings as ArrangementSettings,
    AxisError as AxisError,
    SquarenessError as SquarenessError,
    arrangement_of as arrangement_of,
)
from .bases import Basis as Basis, Polynomial as Polynomial, SingleFunction as SingleFunction
from .empirical_settings import EmpiricalSettings as EmpiricalSettings
from .kinematic import (
    ErrorFunction as ErrorFunction,
    KinematicModel as KinematicModel,
    PlaneModel as PlaneModel,
    carried_vectors as carried_vectors,
    error_function as error_function,
    in_space as in_space,
)
from .kinematic_settings import KinematicSettings as KinematicSettings
from .metric import (
    MetricModel as MetricModel,
    Scale as Scale,
    SpatialMetricModel as SpatialMetricModel,
    parameters_of_metric as parameters_of_metric,
)
from .protocol import (
    Array as Array,
    Corner as Corner,
    CustomModelError as CustomModelError,
    ErrorModel as ErrorModel,
    ErrorModelKind as ErrorModelKind,
    HasLines as HasLines,
    Integers as Integers,
    Line as Line,
    Parameter as Parameter,
    Reported as Reported,
    TrueMachine as TrueMachine,
    Unit as Unit,
)
from .settings import (
    KINDS as KINDS,
    ErrorModelSettings as ErrorModelSettings,
    MetricSettings as MetricSettings,
    build_error_model as build_error_model,
    kind_of as kind_of,
)
from .spline_basis import Spline as Spline
from .truth import FurtherTrueMachine as FurtherTrueMachine
