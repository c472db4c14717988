"""Plans and evaluates ball-plate experiments for co-ordinate measuring machines.

`import ballplate as bp` gives the functions of `ballplate.api`, each loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ballplate.simulator.inputs.messages import ExperimentError

    from .api import (
        check,
        experiment,
        fit,
        load,
        load_all,
        plan,
        quickstart,
        reach,
        reliability,
        repair,
        run,
        simulate,
        sweep,
    )
    from .simulator.experiment.model import Experiment
    from .sweeps.running import OtherSweepError
    from .sweeps.store_file import StoreError

__all__ = [
    "Experiment",
    "ExperimentError",
    "OtherSweepError",
    "StoreError",
    "check",
    "experiment",
    "fit",
    "load",
    "load_all",
    "plan",
    "quickstart",
    "reach",
    "reliability",
    "repair",
    "run",
    "simulate",
    "sweep",
]

_PLACES = {
    "Experiment": "ballplate.simulator.experiment.model",
    "ExperimentError": "ballplate.simulator.inputs.messages",
    "OtherSweepError": "ballplate.sweeps.running",
    "StoreError": "ballplate.sweeps.store_file",
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
    return sorted({*globals(), *__all__, "__version__"})
