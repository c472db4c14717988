"""Planning and evaluation of ball-plate experiments for co-ordinate measuring machines.

`import ballplate as bp` gives the functions of `ballplate.api` and `ballplate.extensions.sweeps.stores`, each
loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ballplate.extensions.sweeps.running import OtherSweepError
    from ballplate.extensions.sweeps.store_file import StoreError
    from ballplate.extensions.sweeps.stores import stored, sweep, sweep_report
    from ballplate.simulator.inputs.messages import ExperimentError

    from .api import (
        adjust,
        budget,
        certificate,
        check,
        compare,
        compensation,
        convert,
        correct,
        cross_validate,
        curves,
        diff,
        experiment,
        fit,
        ladder,
        lengths,
        load,
        load_all,
        load_map,
        map,
        page,
        plan,
        quickstart,
        reach,
        read_compensation,
        read_report,
        reliability,
        repair,
        reproduce,
        run,
        sheet,
        simulate,
        spline,
        validate,
        view,
        write_map,
    )
    from .estimators.estimator_choice import ESTIMATORS
    from .results.groupings import GROUPINGS
    from .simulator.experiment.model import Experiment

__all__ = [
    "ESTIMATORS",
    "Experiment",
    "ExperimentError",
    "GROUPINGS",
    "OtherSweepError",
    "StoreError",
    "adjust",
    "budget",
    "certificate",
    "check",
    "compare",
    "compensation",
    "convert",
    "correct",
    "cross_validate",
    "curves",
    "diff",
    "experiment",
    "fit",
    "ladder",
    "lengths",
    "load",
    "load_all",
    "load_map",
    "map",
    "page",
    "plan",
    "quickstart",
    "reach",
    "read_compensation",
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
    "sweep_report",
    "validate",
    "view",
    "write_map",
]

_PLACES = {
    "ESTIMATORS": "ballplate.estimators.estimator_choice",
    "Experiment": "ballplate.simulator.experiment.model",
    "ExperimentError": "ballplate.simulator.inputs.messages",
    "GROUPINGS": "ballplate.results.groupings",
    "OtherSweepError": "ballplate.extensions.sweeps.running",
    "StoreError": "ballplate.extensions.sweeps.store_file",
    "stored": "ballplate.extensions.sweeps.stores",
    "sweep": "ballplate.extensions.sweeps.stores",
    "sweep_report": "ballplate.extensions.sweeps.stores",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("ballplate")
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found = getattr(import_module(_PLACES.get(name, "ballplate.api")), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
