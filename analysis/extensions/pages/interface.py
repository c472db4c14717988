"""Pages of designs, fits and sweeps from Python."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_path, ensure_report

from .charts import Chart, Trace, chart_svg, figure, legend
from .design_views import plates_view
from .document import Page, PageSection, facts_list, written
from .elements import Html, element, folded, joined, note, sentence, table
from .spatial import still_figure

if TYPE_CHECKING:
    from ballplate.results import Fit, Prediction

# Of pages of other extensions, in addition to the functions below.
__all__ = [
    "Chart",
    "Html",
    "Page",
    "PageSection",
    "Trace",
    "chart_svg",
    "element",
    "facts_list",
    "figure",
    "folded",
    "joined",
    "legend",
    "note",
    "page",
    "plates_view",
    "sentence",
    "still_figure",
    "table",
    "written",
]


def page(
    subject: Experiment | PathLike | Prediction | Fit | Any,
    path: PathLike | None = None,
    report: Report = unreported,
) -> str:
    """Return the page of a design, a fit or a sweep, as written by `run --report`, `fit --report`
    and `sweep --report`: HTML that needs no other file and no network. With a path it is written
    as well.

    Of an experiment it is the page of its design, with the prediction of `run`.

    :raises ValueError: a fit or a prediction without its experiment.
    :raises ImportError: modules for pages of sweeps are not installed.
    :raises OSError: the file cannot be written.

    >>> import ballplate as bp
    >>> bp.page(bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))).splitlines()[0]
    '<!DOCTYPE html>'
    """
    from ballplate.presentation import write_file
    from ballplate.results import Fit, Prediction, predict

    ensure_report(report)
    if path is not None:
        ensure_path("path", path)
    of_sweep = getattr(subject, "page_text", None)
    if isinstance(subject, Fit):
        from .fit_contents import page_of_fit

        text = page_of_fit(subject)
    elif of_sweep is not None:
        text = of_sweep()
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
