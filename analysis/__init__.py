"""Planning and evaluation of ball-plate experiments for co-ordinate measuring machines.

`import ballplate as bp` gives the commands as functions, the names of the kernel on which
extensions build, and the functions of extensions, each loaded when it is first used.
"""

import os
import sys

# Python puts the current folder first on the path of `python -m ballplate`. Files there with names
# of modules are not meant for it, so nothing else is imported before, not even `__future__`.
if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].endswith("ballplate")
    and not sys.flags.safe_path
    and sys.path[0] != os.path.dirname(__path__[0])
):
    del sys.path[0]

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ballplate.api import (
        check,
        experiment,
        fit,
        quickstart,
        run,
        simulate,
    )
    from ballplate.arguments import load, load_all
    from ballplate.extensions.assumptions.interface import assumptions
    from ballplate.extensions.campaign.interface import sheet
    from ballplate.extensions.certificates.interface import certificate
    from ballplate.extensions.diagnosis.interface import reliability
    from ballplate.extensions.drafting.interface import design
    from ballplate.extensions.estimators.interface import compare
    from ballplate.extensions.information.interface import information
    from ballplate.extensions.judgement.interface import budget, compare_models, validate
    from ballplate.extensions.laboratory.interface import read_report
    from ballplate.extensions.machine_files.fitted_map import FittedMap
    from ballplate.extensions.machine_files.interface import load_map, write_map
    from ballplate.extensions.maps.interface import (
        correct,
        curves,
        diff,
        map,
    )
    from ballplate.extensions.pages.interface import page
    from ballplate.extensions.planning.criteria import Criterion
    from ballplate.extensions.planning.interface import plan
    from ballplate.extensions.repair.interface import repair
    from ballplate.extensions.reproduction.interface import reproduce
    from ballplate.extensions.requirements.interface import reach
    from ballplate.extensions.splines.interface import spline
    from ballplate.extensions.sweeps.interface import stored, sweep
    from ballplate.extensions.sweeps.running import OtherSweepError
    from ballplate.extensions.sweeps.store_file import StoreError
    from ballplate.presentation.files import write_file
    from ballplate.presentation.result import Result
    from ballplate.results.estimator_choice import ESTIMATORS
    from ballplate.results.fits import Fit
    from ballplate.results.prediction import Prediction
    from ballplate.simulator.computing.processes import in_processes
    from ballplate.simulator.design.arrays import Design, Observations
    from ballplate.simulator.design.influences.protocol import Influence
    from ballplate.simulator.estimation.functions import (
        BallPlaces,
        Coordinates,
        Distances,
        MeasuredPoints,
        Parameters,
        linear_functions,
    )
    from ballplate.simulator.estimation.linearisation import (
        LinearFunctions,
        Linearisation,
        linearise,
    )
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.experiment.model import Candidate, Experiment
    from ballplate.simulator.inputs.extensions import (
        Command,
        Extension,
        MissingExtensionError,
    )
    from ballplate.simulator.inputs.messages import ExperimentError, Message
    from ballplate.simulator.inputs.quantities import Target, parse_length
    from ballplate.simulator.inputs.trust import Trust
    from ballplate.simulator.machines.protocol import ErrorModel
    from ballplate.uncertainty.kernel_quantities import QuantityKind
    from ballplate.uncertainty.quantities import QUANTITIES

__all__ = [
    "BallPlaces",
    "Candidate",
    "Command",
    "Coordinates",
    "Criterion",
    "Design",
    "Distances",
    "ESTIMATORS",
    "ErrorModel",
    "Experiment",
    "ExperimentError",
    "Extension",
    "Fit",
    "FittedMap",
    "Influence",
    "LinearFunctions",
    "Linearisation",
    "MeasuredPoints",
    "Message",
    "MissingExtensionError",
    "Observations",
    "OtherSweepError",
    "Parameters",
    "Prediction",
    "QUANTITIES",
    "QuantityKind",
    "Result",
    "StoreError",
    "Target",
    "Trust",
    "assumptions",
    "budget",
    "certificate",
    "check",
    "compare",
    "compare_models",
    "correct",
    "curves",
    "design",
    "diff",
    "experiment",
    "fit",
    "in_processes",
    "information",
    "lay_out",
    "linear_functions",
    "linearise",
    "load",
    "load_all",
    "load_map",
    "map",
    "page",
    "parse_length",
    "plan",
    "quickstart",
    "reach",
    "read_report",
    "reliability",
    "repair",
    "reproduce",
    "run",
    "sheet",
    "simulate",
    "spline",
    "stored",
    "sweep",
    "validate",
    "write_file",
    "write_map",
]


def _modules() -> dict[str, str]:
    """Names of the kernel, with the modules that have them."""
    from ballplate.simulator.inputs.faces import public_names

    modules = public_names(__file__).items()
    return {name: module for name, module in modules if ".extensions." not in module}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("ballplate")
    if name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if (module := _modules().get(name)) is not None:
        from importlib import import_module

        value = getattr(import_module(module), name)
    else:
        from ballplate.simulator.inputs.extensions import (
            MissingExtensionError,
            MissingNameError,
            function,
        )

        try:
            value = function(name)
        except KeyError:
            message = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(message) from None
        except MissingExtensionError as error:
            raise MissingNameError(f"{__name__}.{name}: {error}") from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    from ballplate.simulator.inputs.extensions import installed_functions

    return sorted({*_modules(), *installed_functions(), "__version__"})
