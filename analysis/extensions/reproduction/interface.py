"""Published values from Python."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ballplate.arguments import PathLike
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import ensure_report, ensure_whole

if TYPE_CHECKING:
    from .reproduction_result import ReproducedDocument


def reproduce(
    document: Literal["npl"],
    experiment: str | Iterable[str] = (),
    trials: int | None = 100,
    designs: PathLike | None = None,
    report: Report = unreported,
) -> ReproducedDocument:
    """Compare the published values of NPL Report CISE 15/98 with ballplate's.

    An `experiment` is a section such as 6.2.1; default: all. `trials` is the number of synthetic
    data sets of section 6.2.7, None skips them. `designs` is a folder that replaces the shipped
    designs.

    >>> import ballplate as bp
    >>> bp.reproduce("npl", "6.1.2").is_right
    True
    """
    from ballplate.montecarlo import MOST_TRIALS

    from .reproduction_result import reproduce_npl

    if document != "npl":
        raise ValueError(f'document: "{document}" is unknown; give npl')
    ensure_whole(1, MOST_TRIALS, trials=trials)
    ensure_report(report)
    chosen = (experiment,) if isinstance(experiment, str) else tuple(experiment)
    folder = None if designs is None else Path(designs)
    return reproduce_npl(chosen, trials, folder, report)
