"""ballplate from Python: the commands, with results instead of text.

An experiment may be given as the path of its file, a table as the path of a CSV file or a data
frame. Values in results are in metres, radians and ratios. `report` receives each step of the
progress: its name, the number done, and the total. Every function raises
`ballplate.ExperimentError` for an invalid file or experiment, ValueError for an invalid argument,
and TypeError for one of another type.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from ballplate.simulator.computing.steps import Report, unreported
from ballplate.simulator.inputs.arguments import (
    ensure_one_of,
    ensure_path,
    ensure_positive,
    ensure_report,
    ensure_type,
    ensure_whole,
)
from ballplate.simulator.inputs.extensions import service

from .arguments import SIGMAS, PathLike, experiment_of, load, observed_of
from .results.estimator_choice import ESTIMATORS, EstimatorName, fit_readings, takers
from .simulator.experiment.model import Experiment

if TYPE_CHECKING:
    import pandas

    from .arguments import Tables
    from .presentation.result import FitResult
    from .results.fits import Fit
    from .results.prediction import Prediction


def experiment(sections: Mapping[str, Any], folder: PathLike = ".") -> Experiment:
    """The experiment that a mapping describes as a file would, with paths relative to a folder.

    >>> sections = {
    ...     "title": "a plate in two positions",
    ...     "machine": {"volume": ["600 mm", "600 mm"], "repeatability": "0.5 um"},
    ...     "error_model": {"kind": "metric"},
    ...     "artefacts": {"plate": {"kind": "square", "balls": 5, "size": "300 mm"}},
    ...     "positions": [
    ...         {"name": "straight", "corner": {"x": "100 mm", "y": "100 mm"}},
    ...         {"name": "turned", "corner": {"x": "100 mm", "y": "100 mm"}, "quarter_turns": 1},
    ...     ],
    ... }
    >>> check(experiment(sections))
    <Prediction of experiment: full rank, U6 0.101 µm on average, 0.4 µm at most>
    """
    from .simulator.experiment.loading import written_in_python

    if not isinstance(sections, Mapping):
        raise TypeError(f"sections={sections!r}; give a mapping of what a file would hold")
    ensure_path("folder", folder)
    return written_in_python(sections, Path(folder))


def quickstart() -> Experiment:
    """A small experiment to begin with: a plate of 5 x 5 balls in six positions.

    >>> quickstart().title
    '5 x 5 ball plate in six positions'
    """
    from .designs import shipped

    return load(shipped("quickstart.yaml"))


def check(
    experiment: Experiment | PathLike,
    goals: str | Iterable[str] = (),
    share: float | None = None,
    suggest: bool = False,
) -> Prediction:
    """Return the rank of a design and, if deficient, the changes of parameters it leaves
    undetermined.

    `goals` are further requirements, as in `reach`, with the `share` of lengths that must be
    within; `suggest` searches for changes that determine the rest. Both are in the result's
    `advice`.

    >>> check("designs/quickstart.yaml").verdict.deficiency
    0
    >>> check("designs/quickstart.yaml", "U6 average 0.1 um").advice.missed
    ('goal not met: average U6 at most 0.1 µm; average U6 0.1426 µm',)
    """

    from .results.checked_files import Wanted, checked_design
    from .simulator.experiment.loading import with_pool

    ensure_positive("a ratio above 0 and at most 1", 1.0, share=share)
    ensure_type(bool, "True or False", suggest=suggest)
    if not isinstance(goals, Iterable):
        raise TypeError(f'goals={goals!r}; give texts such as "U6 average 0.3 um"')
    texts = (goals,) if isinstance(goals, str) else tuple(goals)
    for text in texts:
        ensure_type(str, 'texts such as "U6 average 0.3 um"', goals=text)
    if share is not None and "lengths" not in texts:
        raise ValueError("share applies to the goal lengths; add it, or leave it out")
    parsed = tuple(
        service("parse_goal")(text, share if text == "lengths" else None) for text in texts
    )
    chosen = experiment_of(experiment)
    wanted = Wanted(parsed, repairs=suggest)
    return checked_design(chosen, with_pool(chosen) if suggest else None, wanted).prediction


def run(
    experiment: Experiment | PathLike,
    trials: int | None = None,
    until: float | None = None,
    seed: int | None = None,
    workers: int = 1,
    report: Report = unreported,
) -> Prediction:
    """Return rank and uncertainties U1 to U6 of a design, with Monte Carlo if `trials` or `until`
    is given; `seed` and `workers` apply to these only.

    At most `trials` data sets are estimated, or as many as give ratios of spread to uncertainty as
    accurate as `until`.

    >>> print(*run(quickstart()).headline().split(", assumed: "), sep=chr(10))
    full rank, U6 0.143 µm on average, 0.325 µm at most
    chain of axes MB2; otherwise U6 is 11 times as large
    """
    from dataclasses import replace

    from ballplate.montecarlo.experiments import MOST_TRIALS
    from ballplate.results.prediction import predict

    ensure_whole(2, MOST_TRIALS, trials=trials)
    ensure_whole(0, seed=seed)
    ensure_whole(1, workers=workers)
    ensure_positive("a ratio above 0 and at most 1, such as 0.01", 1.0, until=until)
    ensure_report(report)
    if trials is None and until is None and (seed is not None or workers != 1):
        raise ValueError("seed and workers apply to trials or until only; leave them out")
    chosen = experiment_of(experiment)
    predicted = predict(chosen)
    if trials is None and until is None:
        return predicted
    from .montecarlo import experiments as replicates

    trials_result = replicates.trials(
        chosen, MOST_TRIALS if trials is None else trials, seed, until, workers, report
    )
    return replace(predicted, monte_carlo=trials_result)


def simulate(
    experiment: Experiment | PathLike, seed: int | None = None, exact: bool = False
) -> pandas.DataFrame:
    """Readings of the experiment's true machine, with noise from a seed, as a table that `fit`
    takes.

    >>> list(simulate(quickstart()).columns)
    ['position', 'ball', 'probe', 'x_mm', 'y_mm', 'z_mm']
    """
    import pandas
    from ballplate.simulator.readings.reading_files import reading_columns
    from ballplate.simulator.readings.simulated import simulated_readings

    ensure_whole(0, seed=seed)
    ensure_type(bool, "True or False", exact=exact)
    simulated = simulated_readings(experiment_of(experiment), seed, exact)
    return pandas.DataFrame(reading_columns(simulated.design, simulated.readings, simulated.x))


@overload
def fit(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
    certificate: PathLike | pandas.DataFrame | None = None,
    *,
    columns: Mapping[str, object] | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    names: str | None = None,
    fill_down: bool | None = None,
    sheet: str | None = None,
    swap_names: bool | None = None,
) -> Fit: ...


@overload
def fit(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
    certificate: PathLike | pandas.DataFrame | None = None,
    estimator: EstimatorName = "full",
    pairs: str | None = None,
    across_probes: bool = False,
    scale: Literal["x", "y", "split", "none"] | None = None,
    offsets: bool = True,
    *,
    columns: Mapping[str, object] | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    names: str | None = None,
    fill_down: bool | None = None,
    sheet: str | None = None,
    swap_names: bool | None = None,
) -> FitResult: ...


def fit(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
    certificate: PathLike | pandas.DataFrame | None = None,
    estimator: EstimatorName = "full",
    pairs: str | None = None,
    across_probes: bool = False,
    scale: Literal["x", "y", "split", "none"] | None = None,
    offsets: bool = True,
    *,
    columns: Mapping[str, object] | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    names: str | None = None,
    fill_down: bool | None = None,
    sheet: str | None = None,
    swap_names: bool | None = None,
) -> FitResult:
    """The estimate from readings: a table or several, or those that the experiment's file names;
    also reports of measuring programs, as `read_report` reads them.

    `columns`, `unit` and `coordinates` say how tables are written, instead of the experiment's
    section `readings`: columns by role, the unit of those that state none, and whether
    co-ordinates are scale readings, ball centres or those of a part. `names` is the rule of names
    in reports; with `fill_down` blank names are those above; `sheet` is that of a workbook, or all;
    with `swap_names` those of two balls are swapped where readings show that they are.
    `sigma` overrides what the experiment says; with `monomials` the machine's parameters are the
    coefficients of t, t^2, ... on [0, 1]. A `certificate` has values instead of the experiment's
    own. Of the `ballplate.ESTIMATORS` those of distances take `pairs` of balls, also
    `across_probes`, and reversal takes the axis that has the `scale` difference, and whether
    `offsets` between its positions are estimated.
    What is to be known beside the figures is in the result's `remarks`, `warnings` and `complaint`.

    >>> readings = simulate(quickstart())
    >>> fit(quickstart(), readings).converged
    True
    >>> fit(quickstart(), readings.iloc[1:]).remarks
    ('planned but not read (1): z low: ball r1c1 with down',)
    >>> fit(quickstart(), readings, estimator="distances", pairs="braced")
    <AlternativeFit of quickstart: distances, converged, full rank>
    """

    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_one_of(ESTIMATORS, estimator=str(estimator))
    ensure_type(str, 'a set of pairs of balls, such as "corners"', pairs=pairs)
    ensure_one_of(("x", "y", "split", "none"), scale=scale)
    ensure_type(bool, "True or False", monomials=monomials, across_probes=across_probes)
    ensure_type(bool, "True or False", offsets=offsets)
    asked = {
        "scale": scale,
        "offsets": not offsets,
        "pairs": pairs,
        "across_probes": across_probes,
        "monomials": monomials,
    }
    wrong = takers(estimator, [name for name, value in asked.items() if value])
    if wrong is not None:
        raise ValueError(f"{wrong[0]} applies to the estimator {wrong[1]} only; leave it out")
    column_settings: dict[str, object] = {
        "columns": columns,
        "unit": unit,
        "coordinates": coordinates,
        "names": names,
        "swap_names": swap_names,
        "fill_down": fill_down,
        "sheet": sheet,
    }
    chosen_experiment = experiment_of(experiment).with_readings(column_settings)
    chosen, observed = observed_of(chosen_experiment, readings, certificate)
    return fit_readings(
        chosen,
        observed,
        estimator,
        sigma,
        monomials,
        pairs,
        across_probes,
        scale,
        offsets,
    )
