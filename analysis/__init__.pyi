# The functions and names of `import ballplate`, each loaded when it is first used.
from .api import (
    check as check,
    experiment as experiment,
    fit as fit,
    quickstart as quickstart,
    run as run,
    simulate as simulate,
)
from .arguments import load as load, load_all as load_all
from .extensions.assumptions.interface import assumptions as assumptions
from .extensions.campaign.interface import sheet as sheet
from .extensions.certificates.interface import certificate as certificate
from .extensions.diagnosis.interface import reliability as reliability
from .extensions.drafting.interface import design as design
from .extensions.estimators.interface import compare as compare
from .extensions.information.interface import information as information
from .extensions.judgement.interface import (
    budget as budget,
    compare_models as compare_models,
    validate as validate,
)
from .extensions.laboratory.interface import read_report as read_report
from .extensions.machine_files.fitted_map import FittedMap as FittedMap
from .extensions.machine_files.interface import load_map as load_map, write_map as write_map
from .extensions.maps.interface import (
    correct as correct,
    curves as curves,
    diff as diff,
    map as map,
)
from .extensions.pages.interface import page as page
from .extensions.pages.joint_table import joint_table as joint_table
from .extensions.parts.acceptance_interface import acceptance as acceptance
from .extensions.parts.interface import part as part
from .extensions.planning.criteria import Criterion as Criterion
from .extensions.planning.interface import plan as plan
from .extensions.reproduction.interface import reproduce as reproduce
from .extensions.requirements.interface import reach as reach
from .extensions.splines.interface import spline as spline
from .extensions.sweeps.interface import stored as stored, sweep as sweep
from .extensions.sweeps.running import OtherSweepError as OtherSweepError
from .extensions.sweeps.store_file import StoreError as StoreError
from .presentation.files import write_file as write_file
from .presentation.result import Result as Result
from .results.estimator_choice import ESTIMATORS as ESTIMATORS
from .results.fits import Fit as Fit
from .results.prediction import Prediction as Prediction
from .simulator.computing.processes import in_processes as in_processes
from .simulator.design.arrays import Design as Design, Observations as Observations
from .simulator.design.influence_quantities import Influence as Influence
from .simulator.estimation.functions import (
    BallPlaces as BallPlaces,
    Coordinates as Coordinates,
    Distances as Distances,
    MeasuredPoints as MeasuredPoints,
    Parameters as Parameters,
    linear_functions as linear_functions,
)
from .simulator.estimation.linearisation import (
    LinearFunctions as LinearFunctions,
    Linearisation as Linearisation,
    linearise as linearise,
)
from .simulator.experiment.layout import lay_out as lay_out
from .simulator.experiment.model import Candidate as Candidate, Experiment as Experiment
from .simulator.inputs.extensions import (
    Command as Command,
    Extension as Extension,
    MissingExtensionError as MissingExtensionError,
)
from .simulator.inputs.messages import ExperimentError as ExperimentError, Message as Message
from .simulator.inputs.quantities import Target as Target, parse_length as parse_length
from .simulator.inputs.trust import Trust as Trust
from .simulator.machines.protocol import ErrorModel as ErrorModel
from .uncertainty.quantities import QUANTITIES as QUANTITIES, QuantityKind as QuantityKind

__version__: str
