"""Published values and certified problems from Python."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ballplate.arguments import (
    PathLike,
)
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import ensure_report, ensure_whole

if TYPE_CHECKING:
    from .reproduction_result import ReproducedDocument
    from .score_result import CertifiedScores


def reproduce(
    document: Literal["npl", "certified"],
    experiment: str | Iterable[str] = (),
    trials: int | None = 100,
    designs: PathLike | None = None,
    results: PathLike | None = None,
    report: Report = unreported,
) -> ReproducedDocument | CertifiedScores:
    """Compare the published values of NPL Report CISE 15/98 with ballplate's, or solve certified
    problems.

    An `experiment` is a section such as 6.2.1, or the name of a problem; default: all. `trials` is
    the number of synthetic data sets of section 6.2.7, None skips them. `designs` is a folder that
    replaces the shipped designs, `results` a JSON file with another program's answers to the
    certified problems.

    >>> import ballplate as bp
    >>> bp.reproduce("npl", "6.1.2").is_right
    True
    """
    from ballplate.montecarlo import MOST_TRIALS

    from .reproduction_result import reproduce_npl
    from .score_result import score_certified

    if document not in ("npl", "certified"):
        raise ValueError(f'document: "{document}" is unknown; give npl or certified')
    ensure_whole(1, MOST_TRIALS, trials=trials)
    ensure_report(report)
    chosen = (experiment,) if isinstance(experiment, str) else tuple(experiment)
    folder = None if designs is None else Path(designs)
    if document == "npl":
        if results is not None:
            raise ValueError("results apply to certified only; leave them out")
        return reproduce_npl(chosen, trials, folder, report)
    answers = None if results is None else Path(results)
    return score_certified(chosen, answers, folder, report)
