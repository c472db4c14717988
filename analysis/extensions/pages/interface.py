"""Pages of designs, fits and sweeps from Python."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.arguments import (
    PathLike,
    experiment_of,
)
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_path, ensure_report, ensure_type

if TYPE_CHECKING:
    from ballplate.results import Fit, Prediction


def page(
    subject: Experiment | PathLike | Prediction | Fit | Any,
    path: PathLike | None = None,
    run_modules: bool = False,
    compare: PathLike | None = None,
    report: Report = unreported,
) -> str:
    """Return the page of a design, a fit or a sweep, as written by `run --report`, `fit --report`
    and `sweep --report`: HTML that needs no other file and no network. With a path it is written
    as well.

    Of an experiment it is the page of its design, with the prediction of `run`. Of a sweep,
    drawings of designs whose error models are in Python need `run_modules`; `compare` names
    another store for comparison.

    :raises ValueError: a fit or a prediction without its experiment; sweeps that cannot be
        compared.
    :raises ImportError: modules for pages of sweeps are not installed.
    :raises OSError: the file cannot be written.

    >>> import ballplate as bp
    >>> bp.page(bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))).splitlines()[0]
    '<!DOCTYPE html>'
    """
    from ballplate.presentation import write_file
    from ballplate.results import Fit, Prediction, predict

    ensure_type(bool, "True or False", run_modules=run_modules)
    ensure_report(report)
    if path is not None:
        ensure_path("path", path)
    of_sweep = getattr(subject, "page_text", None)
    if (run_modules or compare is not None) and of_sweep is None:
        raise ValueError("run_modules and compare apply to sweeps only; leave them out")
    if isinstance(subject, Fit):
        from .fit_contents import page_of_fit

        text = page_of_fit(subject)
    elif of_sweep is not None:
        text = of_sweep(run_modules, compare, report)
    else:
        from .design_contents import page_of_design

        predicted = subject if isinstance(subject, Prediction) and subject.quantities else None
        chosen = subject.experiment if isinstance(subject, Prediction) else experiment_of(subject)
        if chosen is None:
            raise ValueError("the prediction holds no experiment; predict it again")
        text = page_of_design(chosen, predicted or predict(chosen), report)
    if path is not None:
        write_file(Path(path), text.encode("utf-8", "replace"))
    return text
