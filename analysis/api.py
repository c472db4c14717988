"""ballplate from Python: what the commands do, with results in place of text.

Wherever an experiment is taken, so is the path of a file with one; wherever a table, the path of a
CSV file or a data frame. Values in results are in metres, radians and ratios. `report` receives
each step of the progress: what is counted, how many are done, and of how many. Every function
raises `ballplate.ExperimentError` for a file or an experiment that is wrong, ValueError for an
argument that is, and TypeError for one of another kind.
"""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args, overload

from ballplate.simulator.computing.steps import Report, unreported
from ballplate.simulator.inputs.arguments import (
    ensure_one_of,
    ensure_path,
    ensure_positive,
    ensure_report,
    ensure_type,
    ensure_whole,
)
from ballplate.simulator.inputs.messages import refused
from ballplate.simulator.inputs.quantities import QuantityError
from ballplate.simulator.inputs.settings import hint
from ballplate.simulator.inputs.yamltree import GivenText, read_text

from .estimators.estimator_choice import (
    COMPARED,
    ESTIMATORS,
    EstimatorName,
    misused,
    takers,
)
from .results.groupings import GROUPINGS, Grouping
from .simulator.experiment.load import load as load_file
from .simulator.experiment.model import Experiment

PathLike = str | os.PathLike[str]

if TYPE_CHECKING:
    import pandas
    from ballplate.extensions.campaign.sheet import Sheet
    from ballplate.extensions.compensation.compensation_tables import (
        MadeCompensation,
        ReadCompensation,
    )
    from ballplate.extensions.judgement.cross_validation import CrossValidation
    from ballplate.extensions.judgement.ladder_result import Ladder
    from ballplate.extensions.judgement.left_out_result import Validation
    from ballplate.extensions.laboratory.imported_result import ReadReport
    from ballplate.extensions.maps.adjusted_machine import AdjustedMachine
    from ballplate.extensions.maps.converted_map import ConvertedMap
    from ballplate.extensions.maps.correction import Correction
    from ballplate.extensions.maps.error_curves_result import ErrorCurves
    from ballplate.extensions.maps.fitted_errors_result import FittedErrorMap
    from ballplate.extensions.maps.length_tables import LengthMap
    from ballplate.extensions.maps.map_difference import MapDifference
    from ballplate.extensions.maps.map_places import Line
    from ballplate.extensions.maps.volumetric_results import MachineErrors
    from ballplate.extensions.pages.embedded import View
    from ballplate.extensions.reproduction.reproduction_result import ReproducedDocument
    from ballplate.extensions.reproduction.score_result import CertifiedScores
    from ballplate.extensions.requirements.answers import Reach
    from ballplate.extensions.requirements.unknowns import UnknownName
    from ballplate.extensions.splines.curve_result import FittedCurve
    from ballplate.extensions.sweeps.running import SweepResult

    from .estimators.distances import EstimatorComparison
    from .gross_errors.reliability import Reliability
    from .planning.criteria import CriterionName
    from .planning.orders import OrderName
    from .planning.selection import Campaign
    from .presentation.result import FitResult
    from .results.budget import UncertaintyBudget
    from .results.fit import Fit
    from .results.prediction import Prediction
    from .simulator.machines.protocol import Array
    from .simulator.maps.fitted_map import FittedMap
    from .simulator.readings.observed_readings import ObservedReadings

    # A table of readings, or several; None for those that the experiment names.
    Tables: TypeAlias = PathLike | pandas.DataFrame | Sequence[PathLike | pandas.DataFrame] | None

SIGMAS = ("estimated", "given")
TableFormatName = Literal["csv", "isg", "heidenhain"]
TableSense = Literal["corrections", "errors of indication"]


def load(path: PathLike, variant: str | None = None) -> Experiment:
    """The experiment of a file, or one of its variants.

    :raises ExperimentError: the file is wrong, or has several variants and none was chosen.

    >>> load("designs/quickstart.yaml")
    <Experiment quickstart: 5 x 5 ball plate in six positions>
    >>> load("designs/npl/6.1.1.yaml", variant="B").label
    '6.1.1[B]'
    """
    ensure_type(str, "the name of a variant", variant=variant)
    found = load_all(path)
    names = [str(one.name) for one in found]
    if variant is not None:
        if variant in names:
            return found[names.index(variant)]
        told = hint(variant, names) if found[0].name is not None else "the file has no variants"
        raise refused(path, f'no variant "{variant}"; {told}', "variants")
    if len(found) > 1:
        text = (
            "the file has several variants; choose one with variant=, or load_all:"
            f" {', '.join(names)}"
        )
        raise refused(path, text, "variants")
    return found[0]


def load_all(path: PathLike) -> tuple[Experiment, ...]:
    """The experiment of a file, or all of its variants in their order.

    >>> [one.name for one in load_all("designs/npl/6.1.1.yaml")]
    ['A', 'B', 'C', 'D']
    """
    ensure_path("path", path)
    return load_file(path)


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
    <Prediction of experiment: full rank>
    """
    from .simulator.experiment.load import written_in_python

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
    """Whether a design determines all its parameters and, if not, which changes it leaves
    undetermined.

    `goals` are what it is to reach, too, as in `reach`, with the `share` of lengths that are to be
    within; with `suggest` changes are looked for that would determine the rest. Both are in the
    result's `advice`.

    >>> check("designs/quickstart.yaml").verdict.deficiency
    0
    >>> check("designs/quickstart.yaml", "U6 average 0.1 um").advice.missed
    ('goal not met: average U6 at most 0.1 µm; average U6 0.1426 µm',)
    """
    from ballplate.extensions.requirements.goals import parse_goal

    from .planning.checked_files import Wanted, checked_design
    from .simulator.experiment.load import with_pool

    ensure_positive("a ratio above 0 and at most 1", 1.0, share=share)
    ensure_type(bool, "True or False", suggest=suggest)
    if not isinstance(goals, Iterable):
        raise TypeError(f'goals={goals!r}; give texts such as "U6 average 0.3 um"')
    texts = (goals,) if isinstance(goals, str) else tuple(goals)
    for text in texts:
        ensure_type(str, 'texts such as "U6 average 0.3 um"', goals=text)
    if share is not None and "lengths" not in texts:
        raise ValueError("share goes with the goal lengths; add it, or leave it out")
    parsed = tuple(parse_goal(text, share if text == "lengths" else None) for text in texts)
    chosen = _experiment(experiment)
    wanted = Wanted(parsed, repairs=suggest)
    return checked_design(chosen, with_pool(chosen) if suggest else None, wanted).prediction


def repair(path: PathLike, variant: str | None = None) -> str:
    """The text of an experiment file after the first changes of `check --suggest` that determine
    everything, of one variant or of each; the rest of it is as it was, line ends included.

    The text of a file that leaves nothing undetermined is returned as it is. Nothing is written.

    :raises ExperimentError: the file is wrong; no changes were found, or they cannot be written
        without changing the rest of the file.

    >>> line = "    positions[z low].quarter_turns: 1"
    >>> line in repair("designs/npl/6.1.1.yaml", variant="B").splitlines()
    True
    """
    from ballplate.extensions.repair.mending import mended, to_write
    from ballplate.extensions.repair.repair_search import repairs

    from .results import study
    from .simulator.experiment.load import with_pool

    ensure_path("path", path)
    text = read_text(Path(path))
    for one in load_all(path) if variant is None else [load(path, variant)]:
        judged = study.check(one).verdict
        if not judged.deficiency:
            continue
        found = to_write(repairs(with_pool(one)), judged)
        if found is None:
            words = "no changes were found that determine everything"
            raise one.refused((), words)
        text = mended(text, Path(path), one.name, found, one.trust)
    return text


def run(
    experiment: Experiment | PathLike,
    trials: int | None = None,
    until: float | None = None,
    seed: int | None = None,
    workers: int = 1,
    report: Report = unreported,
) -> Prediction:
    """Rank and the uncertainties U1 to U6 of a design, with Monte Carlo beside them if `trials` or
    `until` is given; `seed` and `workers` go with these only.

    At most `trials` data sets are estimated, or as many as make the ratios of spread to uncertainty
    as accurate as `until`.

    >>> run(quickstart())
    <Prediction of quickstart: full rank, U6 0.143 µm on average, 0.325 µm at most>
    """
    from dataclasses import replace

    from .montecarlo.trials import MOST_TRIALS
    from .results import study

    ensure_whole(2, MOST_TRIALS, trials=trials)
    ensure_whole(0, seed=seed)
    ensure_whole(1, workers=workers)
    ensure_positive("a ratio above 0 and at most 1, such as 0.01", 1.0, until=until)
    ensure_report(report)
    if trials is None and until is None and (seed is not None or workers != 1):
        raise ValueError("seed and workers go with trials or until only; leave them out")
    chosen = _experiment(experiment)
    predicted = study.predict(chosen, with_scale=True)
    if trials is None and until is None:
        return predicted
    from .montecarlo import experiments as replicates

    found = replicates.trials(
        chosen, MOST_TRIALS if trials is None else trials, seed, until, workers, report
    )
    return replace(predicted, monte_carlo=found)


def view(given: Experiment | PathLike | Prediction | Fit) -> View:
    """A design in space: positions of plates, balls and probes of an experiment; of a prediction or
    a fit also ellipsoids of uncertainty, residuals, and what undetermined directions move.

    A notebook shows it, to be turned by mouse, buttons or keyboard, and shows it below experiments,
    predictions and fits by itself. `save(path)` of the result writes a page, or the picture alone.

    >>> view(quickstart())
    <View of quickstart: positions>
    >>> view(run(quickstart()))
    <View of quickstart: positions, points, balls of plate>
    """
    from .results.fit import Fit
    from .results.prediction import Prediction

    if isinstance(given, Fit | Prediction):
        return given.view()
    from ballplate.extensions.pages.embedded import View
    from ballplate.extensions.pages.views import position_picture

    from .simulator.experiment.layout import lay_out

    chosen = _experiment(given)
    return View(chosen.label, chosen.title, (position_picture(lay_out(chosen)),))


def page(
    given: Experiment | PathLike | Prediction | Fit | SweepResult,
    path: PathLike | None = None,
    run_modules: bool = False,
    compare: PathLike | None = None,
    report: Report = unreported,
) -> str:
    """The page of a design, a fit or a sweep, which `run --report`, `fit --report` and `report`
    write: HTML that needs no other file and no network. With a path it is written as well.

    Of an experiment it is the page of its design, with the prediction of `run`. Of a sweep,
    drawings of designs whose error models are in Python need `run_modules`, and the store of
    another one to `compare` with is set beside it.

    :raises ValueError: a fit or a prediction that does not know its experiment; sweeps that cannot
        be compared.
    :raises ImportError: what pages of sweeps need is not installed.
    :raises OSError: the file cannot be written.

    >>> page(fit(quickstart(), simulate(quickstart()))).splitlines()[0]
    '<!DOCTYPE html>'
    """
    from ballplate.extensions.sweeps.running import SweepResult

    from .presentation.files import write_file
    from .results.fit import Fit
    from .results.prediction import Prediction

    ensure_type(bool, "True or False", run_modules=run_modules)
    ensure_report(report)
    if path is not None:
        ensure_path("path", path)
    if (run_modules or compare is not None) and not isinstance(given, SweepResult):
        raise ValueError("run_modules and compare go with sweeps only; leave them out")
    if isinstance(given, Fit):
        text = given.page()
    elif isinstance(given, SweepResult):
        from ballplate.extensions.sweeps.stores import sweep_report

        text = sweep_report(given.store, given.number, "html", run_modules, report, compare)
    else:
        from ballplate.extensions.sweeps.report.design_contents import page_of_design

        predicted = given if isinstance(given, Prediction) and given.quantities else None
        chosen = given.experiment if isinstance(given, Prediction) else _experiment(given)
        if chosen is None:
            raise ValueError("the prediction does not know its experiment; predict it anew")
        text = page_of_design(chosen, predicted or run(chosen), report)
    if path is not None:
        write_file(Path(path), text.encode("utf-8", "replace"))
    return text


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
    found = simulated_readings(_experiment(experiment), seed, exact)
    return pandas.DataFrame(reading_columns(found.design, found.readings, found.x))


def certificate(
    experiment: Experiment | PathLike, seed: int | None = None, exact: bool = False
) -> pandas.DataFrame:
    """Values of certificates, priors and probe offsets that go with `simulate` of the same seed, as
    a table that `fit` takes.

    >>> certificate(quickstart()).head(2)[["item", "first", "second"]].values.tolist()
    [['calibration[0]', 'r1c1', 'r1c5'], ['calibration[0]', 'r5c1', 'r5c5']]
    """
    import pandas
    from ballplate.simulator.readings import certificate_files
    from ballplate.simulator.readings.simulated import simulated_readings

    ensure_whole(0, seed=seed)
    ensure_type(bool, "True or False", exact=exact)
    chosen = _experiment(experiment)
    certificate_files.ensure_certified(chosen)
    found = certificate_files.with_drawn_values(chosen, simulated_readings(chosen, seed, exact))
    rows = certificate_files.certificate_rows(found)
    return pandas.DataFrame(rows, columns=list(certificate_files.COLUMNS))


def read_report(
    reports: PathLike | Sequence[PathLike],
    experiment: Experiment | PathLike | None = None,
    name: str | None = None,
    form: str | None = None,
    unit: Literal["mm", "cm", "m", "in"] | None = None,
    circles: bool = False,
) -> ReadReport:
    """Readings out of reports that measuring programs write; their `to_frame()` is a table that
    `fit` takes.

    Positions, balls and probes are in the names of features, by a rule such as
    {position}_{ball}_{probe}: that of `name`, or the one by which the names are those of the
    `experiment`. `form` is dmis, pcdmis, calypso or qif, and is recognised if it is left out;
    `unit` is that of reports which state none; `circles` takes centres of circles, too.

    >>> read_report("designs/reports/z-low.dmo", "designs/quickstart.yaml").told
    ('designs/reports/z-low.dmo: DMIS output; taken: 3 sphere centres; left: 1 plane',)
    """
    from ballplate.extensions.laboratory.formats.registered import FORMATS
    from ballplate.extensions.laboratory.imported import ImportSettings
    from ballplate.extensions.laboratory.imported_result import ReadReport
    from ballplate.extensions.laboratory.planned_and_imported import import_readings

    from .simulator.experiment.layout import lay_out
    from .simulator.experiment.name_rules import check_rule
    from .simulator.inputs.quantities import LENGTH_UNITS

    paths = [reports] if isinstance(reports, str | os.PathLike) else list(reports)
    for path in paths:
        ensure_path("reports", path)
    if not paths:
        raise ValueError("reports=[]; name at least one file")
    ensure_type(str, "a rule such as {position}_{ball}", name=name)
    ensure_one_of([one.name for one in FORMATS], form=form)
    ensure_one_of(("mm", "cm", "m", "in"), unit=unit)
    ensure_type(bool, "True or False", circles=circles)
    design = None if experiment is None else lay_out(_experiment(experiment))
    rule = None if name is None else check_rule(name)
    factor = None if unit is None else LENGTH_UNITS[unit]
    settings = ImportSettings(design, rule, form, factor, circles)
    found = import_readings([Path(path) for path in paths], settings)
    return ReadReport(Path(paths[0]).stem, found)


@overload
def fit(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
    certificate: PathLike | pandas.DataFrame | None = None,
    *,
    components: Grouping | None = None,
    reweight: bool = False,
    columns: Mapping[str, object] | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    names: str | None = None,
    swap_names: bool | None = None,
    trials: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    report: Report = unreported,
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
    components: Grouping | None = None,
    reweight: bool = False,
    columns: Mapping[str, object] | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    names: str | None = None,
    swap_names: bool | None = None,
    trials: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    report: Report = unreported,
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
    components: Grouping | None = None,
    reweight: bool = False,
    columns: Mapping[str, object] | None = None,
    unit: str | None = None,
    coordinates: str | None = None,
    names: str | None = None,
    swap_names: bool | None = None,
    trials: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    report: Report = unreported,
) -> FitResult:
    """The estimate from readings: a table or several, or those that the experiment's file names;
    also reports of measuring programs, as `read_report` reads them.

    `columns`, `unit` and `coordinates` say how tables are written, in place of the experiment's
    section `readings`: columns by role, the unit of those that state none, and whether co-ordinates
    are scale readings, ball centres or those of a part. `names` is the rule of names in reports;
    with `swap_names` those of two balls are swapped where readings show that they are.
    `sigma` overrides what the experiment says; with `monomials` the machine's parameters are the
    coefficients of t, t^2, ... on [0, 1]. A `certificate` has values in place of the experiment's
    own. Of the `ballplate.ESTIMATORS` those of distances take `pairs` of balls, also
    `across_probes`, and reversal takes the axis that has the `scale` difference, and whether
    `offsets` between its positions are estimated. With `components`, one of the
    `ballplate.GROUPINGS`, variances of groups of observations are estimated, and `reweight` puts
    these in the place of the stated ones. With `trials` so many data sets of the fitted parameters
    are fitted as well, from a `seed` and by several `workers`. What is to be known beside the
    figures is in the result's `remarks`, `warnings` and `complaint`.

    >>> readings = simulate(quickstart())
    >>> fit(quickstart(), readings).converged
    True
    >>> fit(quickstart(), readings.iloc[1:]).remarks
    ('planned but not read (1): z low: ball r1c1 with down',)
    >>> fit(quickstart(), readings, estimator="distances", pairs="braced")
    <AlternativeFit of quickstart: distances, converged, full rank>
    """
    from .estimators.estimator_choice import fit_readings
    from .montecarlo.trials import MOST_TRIALS
    from .results.fit import Fit

    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_one_of(ESTIMATORS, estimator=str(estimator))
    ensure_type(str, 'a set of pairs of balls, such as "corners"', pairs=pairs)
    ensure_one_of(("x", "y", "split", "none"), scale=scale)
    ensure_type(bool, "True or False", monomials=monomials, across_probes=across_probes)
    ensure_type(bool, "True or False", offsets=offsets, reweight=reweight)
    if components is not None:
        ensure_one_of(GROUPINGS, components=components)
    asked: dict[str, object] = {"scale": scale, "offsets": not offsets, "pairs": pairs}
    asked |= {"across_probes": across_probes, "monomials": monomials}
    asked |= {"components": components, "reweight": reweight, "trials": trials}
    ensure_whole(1, MOST_TRIALS, trials=trials)
    ensure_whole(0, seed=seed)
    ensure_whole(1, workers=workers)
    ensure_report(report)
    if trials is None and (seed is not None or workers != 1):
        raise ValueError("seed and workers go with trials only; leave them out")
    wrong = takers(estimator, [name for name, value in asked.items() if value])
    if wrong is not None:
        raise ValueError(f"{wrong[0]} goes with the estimator {wrong[1]} only; leave it out")
    reason = misused(components, reweight, sigma)
    if reason:
        raise ValueError(reason)
    said: dict[str, object] = {"columns": columns, "unit": unit, "coordinates": coordinates}
    said |= {"names": names, "swap_names": swap_names}
    given = _experiment(experiment).with_readings(said)
    chosen, observed = _observed(given, readings, certificate)
    found = fit_readings(
        chosen,
        observed,
        estimator,
        sigma,
        monomials,
        pairs,
        across_probes,
        scale,
        offsets,
        components,
        reweight,
    )
    if trials is None or not isinstance(found, Fit) or not found.converged:
        return found
    return found.with_trials(trials, chosen.seed if seed is None else seed, workers, report)


def ladder(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    coefficients: int = 8,
    certificate: PathLike | pandas.DataFrame | None = None,
    report: Report = unreported,
) -> Ladder:
    """Which error model readings call for: kinematic ones with up to so many `coefficients`,
    and empirical ones, compared by what richer ones explain, and what each changes in lengths.

    >>> readings = simulate(quickstart())
    >>> ladder(quickstart(), readings, coefficients=6).recommended
    'kinematic, 5 and 5 coefficients'
    """
    from ballplate.extensions.judgement.ladder import ladder as compared

    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_whole(3, 12, coefficients=coefficients)
    ensure_report(report)
    chosen, observed = _observed(experiment, readings, certificate)
    return compared(chosen, observed, sigma, coefficients, report)


def validate(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    certificate: PathLike | pandas.DataFrame | None = None,
    report: Report = unreported,
) -> Validation:
    """Positions, plates and directions left out in turn and predicted from the rest.

    >>> validate(quickstart(), simulate(quickstart()))
    <Validation of quickstart: 9 left out in turn, 0 predicted wrongly>
    """
    from ballplate.extensions.judgement.left_out import validate as predicted

    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_report(report)
    chosen, observed = _observed(experiment, readings, certificate)
    return predicted(chosen, observed, sigma, report)


def cross_validate(
    experiment: Experiment | PathLike,
    readings: Tables,
    against: Tables,
    sigma: Literal["estimated", "given"] | None = None,
    certificate: PathLike | pandas.DataFrame | None = None,
    common: bool = True,
) -> CrossValidation:
    """Readings of two campaigns by the same experiment compared throughout the volume, the rigid
    motion between what they find taken out. Errors of certificates are in `common`, unless the
    second campaign read another plate.

    >>> twice = [simulate(quickstart(), seed) for seed in (1, 2)]
    >>> cross_validate(quickstart(), *twice, common=False).complaint
    ''
    """
    from ballplate.extensions.judgement.cross_validation import cross_validate as compared

    ensure_one_of(SIGMAS, sigma=sigma)
    chosen, first = _observed(experiment, readings, certificate)
    return compared(chosen, first, _observed(chosen, against, None)[1], sigma, common)


def convert(fitted: Fit | FittedMap | PathLike, to: str) -> ConvertedMap:
    """The map of a fit in another error model: a kind such as "empirical", settings such as "{kind:
    kinematic, position_coefficients: 3}", or the path of an experiment file whose model is taken.

    Its `map` is the new one, with its covariance.

    >>> fitted = fit(quickstart(), simulate(quickstart())).to_map()
    >>> convert(fitted, "{kind: empirical, coefficients: 5}")
    <ConvertedMap of map: empirical, 195 parameters, the same corrections>
    """
    from ballplate.extensions.maps.any_map import map_of_source
    from ballplate.extensions.maps.converted_map import convert as converted

    ensure_type(str, 'an error model such as "empirical"', to=to)
    found, label = map_of_source(_machine("fitted", fitted))
    return converted(found, to, label)


def _observed(
    experiment: Experiment | PathLike,
    readings: Tables,
    certificate: PathLike | pandas.DataFrame | None,
) -> tuple[Experiment, ObservedReadings]:
    """An experiment with its certificate, and what its readings are."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.readings.certificate_files import read_certificate
    from ballplate.simulator.readings.reading_files import read_readings

    chosen = _experiment(experiment)
    tables, stated = _tables(readings, chosen), len(chosen.doubts)
    if certificate is not None:
        chosen = read_certificate(_table("certificate", certificate), chosen)
    observed = read_readings(tables, lay_out(chosen), settings=chosen.readings)
    return chosen, replace(observed, of_certificate=chosen.doubts[stated:])


def diff(
    first: Fit | FittedMap | PathLike,
    second: Fit | FittedMap | PathLike,
    *,
    points: PathLike | Sequence[Sequence[float]] | None = None,
    grid: int = 4,
    probe: str | None = None,
    coverage_factor: float = 2.0,
    shared: Literal["certificate"] | None = None,
    stated: str | None = None,
    dates: tuple[str | None, str | None] = (None, None),
) -> MapDifference:
    """What the second of two maps says less what the first does: lengths, errors at points after
    the free motion of the frame is taken out, error functions, and balls of plates of two fits.

    Each is a fit, what `to_map()` of one gives, or the path of a map file, of a machine file (an
    expected map, with the expanded uncertainty `stated` of lengths, such as "0.5 um + L/1000000"),
    or of an experiment file that names its readings. `points` (n, d) are in metres, or a CSV file
    with x_mm, y_mm and z_mm; without any a `grid` of so many along each axis is taken. With
    `shared` both fits rest on the same certificate, whose errors cancel. `dates` are days of the
    campaigns, such as "2026-11-22".

    :raises ValueError: the maps do not go together, or share no certificate.

    >>> campaigns = [fit(quickstart(), simulate(quickstart(), seed)) for seed in (1, 2)]
    >>> diff(*campaigns)
    <MapDifference of second less first: no change is shown (p = 0.53)>
    """
    import numpy as np
    from ballplate.extensions.maps.comparison import ComparisonSettings
    from ballplate.extensions.maps.sources import map_difference
    from ballplate.simulator.inputs.days import stated_day
    from ballplate.simulator.inputs.quantities import Target, parse_length_function

    ensure_whole(2, 5, grid=grid)
    ensure_positive("a number above 0, such as 2", 100.0, coverage_factor=coverage_factor)
    ensure_one_of(("certificate",), shared=shared)
    ensure_type(str, "the name of a probe", probe=probe)
    ensure_type(str, 'a length such as "0.5 um + L/1000000"', stated=stated)
    if isinstance(dates, str) or len(dates) != 2:
        raise ValueError(f"dates={dates!r}; give two, that of the first and that of the second")
    days = tuple(None if one is None else stated_day(one) for one in dates)
    known = None if stated is None else Target(parse_length_function(stated), coverage_factor)
    is_file = isinstance(points, str | os.PathLike)
    places = Path(str(points)) if is_file else None if points is None else np.asarray(points, float)
    if isinstance(places, np.ndarray) and places.ndim != 2:
        raise ValueError("points: give a list of points, each with its co-ordinates in metres")
    sides = [_side(name, one) for name, one in (("first", first), ("second", second))]
    return map_difference(
        (sides[0], sides[1]),
        ComparisonSettings(coverage_factor, grid, places, probe),
        shared is not None,
        None if known is None else known.standard,
        (days[0], days[1]),
    )


def budget(given: Experiment | PathLike | Fit, by: Grouping = "calibration") -> UncertaintyBudget:
    """What each source contributes to U4, U6, the body diagonals and the measuring tasks of the
    design of an experiment, or of a fit.

    `by` splits the readings by axis, probe, position or artefact; as they are by default, they are
    one source. Contributions add in squares; the largest comes first.

    >>> budget(quickstart())
    <UncertaintyBudget of quickstart: readings 75 % of the variance of U6>
    >>> budget(fit(quickstart(), simulate(quickstart())), by="probe").sources[0]
    'calibration[0]: distances of plate'
    """
    from .results.budget import budget as budget_of
    from .results.fit import Fit

    ensure_one_of(GROUPINGS, by=str(by))
    if isinstance(given, Fit):
        if given.experiment is None:
            raise ValueError(f"the estimate has {given.solution.status}; there is no budget of it")
        return budget_of(given.experiment, given, by)
    return budget_of(_experiment(given), None, by)


def compare(
    experiment: Experiment | PathLike,
    estimator: EstimatorName = "distances",
    trials: int = 100,
    pairs: str | None = None,
    across_probes: bool = False,
    seed: int | None = None,
    points: int = 200,
    published_rms: str | None = None,
    published_maximum: str | None = None,
    report: Report = unreported,
) -> EstimatorComparison:
    """How far the distances that another estimator corrects are from those by the full one, and
    both from the true machine's, on synthetic data sets.

    `published` values, as texts with a unit, are placed among the differences.

    >>> compare(quickstart(), trials=2, points=10).failed
    ()
    """
    from ballplate.simulator.inputs.quantities import QuantityError, parse_length

    from .estimators.distances import MOST_POINTS, compare_estimators
    from .montecarlo.trials import MOST_TRIALS

    ensure_one_of(COMPARED, estimator=str(estimator))
    ensure_type(str, 'a set of pairs of balls, such as "corners"', pairs=pairs)
    ensure_type(bool, "True or False", across_probes=across_probes)
    ensure_whole(1, MOST_TRIALS, trials=trials)
    ensure_whole(0, seed=seed)
    ensure_whole(1, MOST_POINTS, points=points)
    texts = {"published_rms": published_rms, "published_maximum": published_maximum}
    ensure_type(str, "a length with a unit, such as '0.35 um'", **texts)
    ensure_report(report)
    published: dict[str, float | None] = {}
    for key, text in texts.items():
        try:
            length = None if text is None else parse_length(text)
        except QuantityError as error:
            raise ValueError(f"{key}: {error}") from None
        published[key.removeprefix("published_")] = length
    return compare_estimators(
        _experiment(experiment),
        trials,
        estimator,  # type: ignore[arg-type]
        pairs,
        across_probes,
        seed,
        points,
        published,
        report,
    )


def plan(
    experiment: Experiment | PathLike,
    criterion: CriterionName = "U6",
    hours: float | None = None,
    positions: int | None = None,
    readings: int | None = None,
    curve: bool = False,
    seed: int = 1,
    workers: int = 1,
    done: PathLike | pandas.DataFrame | None = None,
    moved: bool = False,
    earlier: PathLike | None = None,
    order: OrderName | None = None,
    drift: Sequence[str] = (),
    report: Report = unreported,
) -> Campaign:
    """Positions and certificates chosen from the experiment's pool for a budget, with the bound of
    any choice.

    Without a budget the choice may cost what the positions of the experiment itself do. Readings
    that are `done` already are kept; where the artefact has `moved` since, a position interrupted
    there can only be set up again. `earlier` is the file of a choice from this pool before, to
    compare with and go on from. An `order`, change-over, mirrored, blocks or least-drift, or
    sizes of a `drift` such as ["0.5 um/h", "0.2 ppm/h"] tell what a drift does in each order.

    >>> corners = {"x": ["50 mm"], "y": ["50 mm"]}
    >>> places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": corners}
    >>> pool = {"candidates": [places | {"probes": ["down"]}]}
    >>> plan(quickstart().with_(pool=pool), positions=7)
    <Campaign of quickstart: 7 of 8 candidates, U6 0.137 µm>
    """
    from ballplate.extensions.campaign.earlier import begun

    from .planning.campaign import Request, campaign
    from .planning.constraints import HOUR, Budget
    from .planning.criteria import NAMES
    from .planning.orders import ORDERS
    from .simulator.experiment.load import with_pool

    ensure_one_of(NAMES, criterion=str(criterion))
    ensure_positive("hours above 0", 1e5, hours=hours)
    ensure_whole(1, positions=positions, readings=readings, workers=workers)
    ensure_whole(0, seed=seed)
    ensure_type(bool, "True or False", curve=curve, moved=moved)
    ensure_report(report)
    budget = None
    if (hours, positions, readings) != (None, None, None):
        budget = Budget(None if hours is None else HOUR * hours, readings, positions)
    if order is not None:
        ensure_one_of(tuple(ORDERS), order=order)
    request = Request(criterion, budget, curve, seed, order, tuple(drift))
    found = load_file(experiment, True) if isinstance(experiment, str | os.PathLike) else ()
    chosen = found[0] if len(found) == 1 else with_pool(_experiment(experiment))
    taken = None if done is None else _table("done", done)
    before = None if earlier is None else Path(earlier)
    return campaign(chosen, request, *begun(chosen, taken, moved, before), workers, report)


def sheet(experiment: Experiment | PathLike) -> Sheet:
    """What goes to the laboratory with an experiment: a run sheet, a table to fill in, and points
    for a program.

    `text()` is the run sheet, `template()` the CSV file of readings with empty cells, and
    `points()` the nominal centres of the balls; that of a plan is its `to_print`.

    >>> sheet(quickstart())
    <Sheet of quickstart: 6 positions, 250 readings>
    >>> sheet(quickstart()).template().splitlines()[:2]
    ['position,ball,probe,x_mm,y_mm,z_mm', 'z low,r1c1,down,,,']
    """
    from ballplate.extensions.campaign.sheet import sheet_of

    from .simulator.experiment.load import with_pool

    found = _experiment(experiment)
    return sheet_of(found if found is experiment else with_pool(found))


def reliability(
    experiment: Experiment | PathLike,
    false_alarm: float = 0.001,
    power: float = 0.8,
    sigma: Literal["estimated", "given"] | None = None,
    report: Report = unreported,
) -> Reliability:
    """Which mistakes in readings and certificates residuals would show, and what those do that they
    would not.

    >>> reliability(quickstart()).degrees_of_freedom
    580
    """
    from .gross_errors import redundancy
    from .gross_errors.power import LEAST_CHANCE, MOST_CHANCE

    ensure_one_of(SIGMAS, sigma=sigma)
    limits = f"between {LEAST_CHANCE:g} and {MOST_CHANCE:g}"
    ensure_positive(f"a ratio {limits}", MOST_CHANCE, false_alarm=false_alarm, power=power)
    ensure_report(report)
    if not LEAST_CHANCE <= false_alarm < power:
        raise ValueError(
            f"false_alarm={false_alarm}, power={power}; give ratios {limits}, the power the larger"
        )
    return redundancy.reliability(_experiment(experiment), false_alarm, power, sigma, report)


def reach(
    experiment: Experiment | PathLike,
    goal: str = "lengths",
    unknowns: UnknownName | Sequence[UnknownName] | None = None,
    target: str | None = None,
    share: float | None = None,
    artefact: str | None = None,
    calibration: int | None = None,
    report: Report = unreported,
) -> Reach:
    """The repeatability, certificate, repeats, balls or size of the plate with which a goal is met.

    `goal` is as for `ballplate reach --goal`, with the `share` of lengths that are to be within,
    `unknowns` one of repeatability, certificate, repeats, balls and size, or several; without any
    it is all of them. `target` replaces the experiment's target, as a text with a unit. The
    `artefact` by its name and the entry of the `calibration` are what varies where there are
    several.

    >>> reach(quickstart(), "U6 average 0.2 um", ["repeatability"]).answers[0].is_met
    True
    """
    from ballplate.extensions.requirements.goals import parse_goal
    from ballplate.extensions.requirements.root_search import reach as search
    from ballplate.extensions.requirements.unknowns import NAMES

    ensure_type(str, 'a text such as "U6 average 0.3 um"', goal=goal)
    ensure_type(str, 'a text with a unit, such as "0.5 um"', target=target)
    ensure_type(str, "the name of an artefact", artefact=artefact)
    ensure_positive("a ratio above 0 and at most 1", 1.0, share=share)
    ensure_whole(0, calibration=calibration)
    ensure_report(report)
    names = (unknowns,) if isinstance(unknowns, str) else tuple(unknowns or NAMES)
    for name in names:
        ensure_one_of(NAMES, unknowns=name)
    return search(
        _experiment(experiment),
        parse_goal(goal, share),
        names,
        artefact,
        calibration,
        target,
        report,
    )


def lengths(
    experiment: Experiment | PathLike,
    target: str | None = None,
    grid: int | Sequence[int] = 6,
    probe: str | None = None,
    coverage_factor: float | None = None,
    with_repeatability: bool = False,
    report: Report = unreported,
) -> LengthMap:
    """Uncertainties of all lengths between points of a grid over the volume, against a target.

    `target` replaces that of the experiment, as a text with a unit; `grid` has the number of points
    along every axis, or along each. With `with_repeatability` the scatter of the two readings of a
    length counts, too.

    >>> lengths(quickstart(), "1 um + L/1000000", grid=3).is_met
    True
    """
    from ballplate.extensions.maps.length_map import length_map, length_settings

    ensure_type(str, 'a text with a unit, such as "0.5 um + L/1000000"', target=target)
    ensure_type(str, "the name of a probe", probe=probe)
    ensure_type(bool, "True or False", with_repeatability=with_repeatability)
    ensure_positive("a number above 0 and at most 100", 100.0, coverage_factor=coverage_factor)
    ensure_report(report)
    counts = _several("grid", grid)
    ensure_whole(2, **{f"grid[{k}]": count for k, count in enumerate(counts)})
    chosen = _experiment(experiment)
    settings = length_settings(chosen, target, counts, probe, coverage_factor, with_repeatability)
    return length_map(chosen, settings, report)


def map(
    machine: PathLike | Fit | FittedMap,
    grid: Sequence[int] | None = None,
    line: str | Line | None = None,
    error: str | None = None,
    points: int | PathLike | pandas.DataFrame | Sequence[Sequence[float]] | None = None,
    *,
    plane: str | Mapping[str, float] | None = None,
    probe: str | None = None,
    draw: int | None = None,
    seed: int = 1,
    budget: bool = False,
    tasks: Experiment | PathLike | None = None,
) -> MachineErrors | FittedErrorMap | ErrorCurves:
    """Volumetric errors of a machine file, or of the map that a fit left behind, with expanded
    uncertainties: on a grid over the volume, in a plane, along a line of so many points, at given
    points, or one parametric error along its axis.

    `line` is a text as in `ballplate map --line`, the places in metres of the two fixed
    axes, or two points; `plane` the place of the axis across it. `points` is their number along a
    line; or a table of points, as for the command; or their co-ordinates (m, d) in metres. Of a map
    `probe` is the name of the probe, and the lengths of the measuring `tasks` of an experiment are
    told, too. With `draw`, so many realisations of the random part, or of
    what the covariance of a map leaves open, are drawn from a `seed`. With `budget` the result
    shows what each parametric error contributes, which its `budget` has in any case.

    >>> map("designs/park/machines/npl-like.yaml", line="y = 300 mm, z = 200 mm", points=3)
    <ErrorsOnLine of npl-like: 3 points, resultant 16.17 µm at most>
    >>> fitted = fit(quickstart(), simulate(quickstart())).to_map()
    >>> map(fitted, points=[[0.5, 0.5, 0.5]]).errors.uncertainties.round(8)
    array([[2.2e-07, 1.9e-07, 1.7e-07]])
    """
    import numpy as np
    from ballplate.extensions.maps.any_map import map_errors
    from ballplate.extensions.maps.map_places import PlacesAsked, parse_places, parse_plane
    from ballplate.extensions.maps.realisations import MOST_DRAWS, Draws
    from ballplate.extensions.maps.volumetric_errors import MOST_POINTS

    source = _machine("machine", machine)
    ensure_type(str, "the name of a parametric error, such as EXX", error=error)
    ensure_type(str, "the name of a probe", probe=probe)
    ensure_type(bool, "True or False", budget=budget)
    ensure_whole(1, MOST_DRAWS, draw=draw)
    ensure_whole(0, seed=seed)
    counts = None
    if grid is not None:
        counts = _several("grid", grid)
        if len(counts) not in (2, 3):
            raise ValueError(f"grid={grid!r}; give three numbers of points, such as (5, 5, 5)")
        ensure_whole(2, MOST_POINTS, **{f"grid[{k}]": count for k, count in enumerate(counts)})
        if (count := math.prod(counts)) > MOST_POINTS:
            raise ValueError(f"{count} points are too many; at most {MOST_POINTS} are possible")
    number: int | None = None
    at: Path | GivenText | Array | None = None
    if isinstance(points, int) or points is None:
        ensure_whole(2, MOST_POINTS, points=points)
        number = points
    elif isinstance(points, str | os.PathLike) or hasattr(points, "to_csv"):
        at = _table("points", points)
    else:
        at = given = np.asarray(points, float)
        if given.ndim != 2 or not np.isfinite(given).all():
            raise ValueError(f"points of shape {given.shape}; give finite numbers in metres (m, d)")
    asked = PlacesAsked(
        counts,
        parse_places(line) if isinstance(line, str) else line,
        parse_plane(plane) if isinstance(plane, str) else plane,
        number,
        at,
    )
    draws = None if draw is None else Draws(draw, seed)
    chosen = () if tasks is None else (_experiment(tasks),)
    return map_errors(source, asked, error, probe, draws, budget, chosen)


def curves(
    fitted: Fit | FittedMap | PathLike, errors: str | Iterable[str] = (), points: int = 41
) -> ErrorCurves:
    """The error functions of a map at so many positions along each line, or some of them, with
    their expanded uncertainties; squareness errors as angles, and other numbers of its model.

    `fitted` is a fit, what its `to_map()` gives, or the path of a map file.

    >>> curves(fit(quickstart(), simulate(quickstart())).to_map())
    <ErrorCurves of map: 18 error functions, 3 squareness errors>
    """
    from ballplate.extensions.maps.any_map import map_of_source
    from ballplate.extensions.maps.error_curves_result import error_curves

    ensure_whole(2, 10_000, points=points)
    names = (errors,) if isinstance(errors, str) else tuple(errors)
    for name in names:
        ensure_type(str, "the name of a parametric error, such as EXX", errors=name)
    return error_curves(*map_of_source(_machine("fitted", fitted)), names, points)


def load_map(path: PathLike) -> FittedMap:
    """The map of a file that a fit left behind, YAML or .npz.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = f"{folder}/map.yaml"
    ...     write_map(fit(quickstart(), simulate(quickstart())).to_map(), path)
    ...     load_map(path)
    <FittedMap 5 x 5 ball plate in six positions: 69 parameters>
    """
    from .simulator.experiment.map_files import read_map

    ensure_path("path", path)
    return read_map(path)


def write_map(fitted: FittedMap, path: PathLike) -> None:
    """Write what `to_map()` of a fit gives into a file: YAML, or arrays of NumPy where its name
    ends in .npz. Numbers keep all their digits; a file of that name is overwritten.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = f"{folder}/map.npz"
    ...     write_map(fit(quickstart(), simulate(quickstart())).to_map(), path)
    ...     load_map(path).degrees_of_freedom
    580
    """
    from .simulator.experiment import map_files
    from .simulator.maps.fitted_map import FittedMap

    ensure_type(FittedMap, "what to_map() of a fit gives", fitted=fitted)
    ensure_path("path", path)
    map_files.write_map(fitted, path)


def adjust(
    fitted: Fit | FittedMap | PathLike,
    scale: str | Iterable[str] = (),
    turn: str | Iterable[str] = (),
    after: Fit | FittedMap | PathLike | None = None,
    share: float = 0.0,
) -> AdjustedMachine:
    """What adjustments leave of a fitted machine's errors, and what a campaign `after` them says;
    both are fits, maps, or files of maps.

    Changes are texts as those of `ballplate adjust`: `scale` such as "x=22 um/m", and `turn` such
    as "y-x=12 arcsec" or "y-x=0.25 turns of 1 mm at 400 mm". The standard uncertainty of each is
    the `share` of it.

    :raises ValueError: a text that is no change, or a change that the error model cannot follow.

    >>> machine = fit(quickstart(), simulate(quickstart())).to_map()
    >>> adjust(machine, scale="x=20 um/m")
    <AdjustedMachine of 5 x 5 ball plate in six positions: 1 change, predicted>
    """
    from ballplate.extensions.maps.adjusted_machine import adjusted_machine
    from ballplate.extensions.maps.machine_changes import guideway_turn, scale_change

    first = _fitted("fitted", fitted)
    second = None if after is None else _fitted("after", after)
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"share={share!r}; give a part of each change, from 0 to 1")
    changes = [scale_change(text) for text in _texts("scale", scale)]
    changes += [guideway_turn(text) for text in _texts("turn", turn)]
    return adjusted_machine(first.title, first, changes, second, share)


def compensation(
    machine: PathLike | Fit | FittedMap,
    format: TableFormatName,
    pitch: str | Sequence[float] | None = None,
    origin: str | Sequence[float] | None = None,
    sense: TableSense | None = None,
    volumetric: bool = False,
    without_rotations: bool = False,
    allow_lack_of_fit: bool = False,
) -> MadeCompensation:
    """A compensation table of a machine file or of a map, in the format csv, isg or heidenhain.

    `pitch` is the distance of positions, one for all axes or one for each, and `origin` where
    errors are zero: texts with units, or metres. `sense` is corrections or errors of indication.
    `files(stem)` of the result are the texts of its files.

    A map whose fit has a lack of fit beyond the limit is refused without `allow_lack_of_fit`.

    >>> compensation("designs/park/machines/npl-like.yaml", "isg", "50 mm")
    <MadeCompensation of npl-like: isg, 19, 24, 9 positions>
    """
    from ballplate.extensions.compensation.compensation_tables import (
        made_compensation,
        of_map,
        tabled_machine,
    )

    ensure_one_of(get_args(TableFormatName), format=str(format))
    ensure_one_of(get_args(TableSense), sense=sense)
    given = _machine("machine", machine)
    if isinstance(given, Path):
        label, (source, remarks) = given.stem, tabled_machine(given, allow_lack_of_fit)
    else:
        label, (source, remarks) = given.title, of_map(given, given.title, allow_lack_of_fit)
    lengths = _metres("pitch", pitch), _metres("origin", origin)
    flags = volumetric, without_rotations
    return made_compensation(source, label, format, *lengths, sense, *flags, remarks)


def read_compensation(
    files: PathLike | Sequence[PathLike],
    format: TableFormatName,
    sense: TableSense | None = None,
    arrangement: str | None = None,
    origin: str | Sequence[float] | None = None,
) -> ReadCompensation:
    """The compensation table that files in the format csv, isg or heidenhain hold.

    What the files do not say is said beside them: the `sense`, corrections or errors of indication,
    the `arrangement` of the axes, such as MB2 or "probe x z, workpiece y", and the `origin` from
    which levers of rotations count. `correction(points)` of the result are corrections between the
    table's positions, `machine_files(stem)` the texts of a machine file.

    >>> from tempfile import TemporaryDirectory
    >>> made = compensation("designs/park/machines/npl-like.yaml", "isg")
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "table.csv")
    ...     _ = file.write_text(made.files("table")["table.csv"])
    ...     read_compensation(file, "isg")
    <ReadCompensation of table: isg, 21, 21, 21 positions>
    """
    from ballplate.extensions.compensation.compensation_tables import read_compensation_files

    ensure_one_of(get_args(TableFormatName), format=str(format))
    ensure_one_of(get_args(TableSense), sense=sense)
    ensure_type(str, "an arrangement, such as MB2", arrangement=arrangement)
    several = [files] if isinstance(files, str | os.PathLike) else files
    paths = [Path(one) for one in several]
    if not paths:
        raise ValueError("files: no file; give one at least")
    return read_compensation_files(paths, format, sense, arrangement, _metres("origin", origin))


def _metres(name: str, given: str | Sequence[float] | None) -> tuple[float, ...] | None:
    """Lengths in metres, of a text with units or of numbers."""
    from ballplate.extensions.compensation.compensation_tables import parse_lengths

    if given is None:
        return None
    if isinstance(given, str):
        try:
            return parse_lengths(given)
        except QuantityError as error:
            raise ValueError(f"{name}: {error}") from None
    found = tuple(given) if isinstance(given, Iterable) else (given,)
    if not all(isinstance(one, int | float) and math.isfinite(one) for one in found):
        raise TypeError(f"{name}={given!r}; give lengths in metres, or a text with units")
    return tuple(float(one) for one in found)


def correct(
    fitted: Fit | FittedMap | PathLike,
    points: Any,
    probe: str | Sequence[str] | None = None,
    lengths: Sequence[Sequence[str | int]] = (),
    coordinates: Literal["scale readings", "ball centres"] = "scale readings",
    coverage_factor: float | None = None,
    with_repeatability: bool = False,
) -> Correction:
    """Points corrected by a fit, its map, or the file of that, with their uncertainty.

    `points` are an array (n, d) in metres, or a table as `ballplate correct` reads it, with a
    `probe` for those that name none; without any it is that of the map. They are `coordinates`
    of the scales, or of centres of balls, which have the stated offset of the probe added.
    `lengths` are pairs of names or of indices. The coverage factor is that of the map, or the one
    given; `with_repeatability` the scatter of the readings that are corrected counts, too.

    >>> fitted = fit(quickstart(), simulate(quickstart()))
    >>> ends = [[0.1, 0.2, 0.3], [0.4, 0.2, 0.3]]
    >>> correct(fitted, ends)
    <Correction of quickstart: 2 points; U = 2 u = 0.4325 µm at most>
    >>> found = correct(fitted, ends, lengths=[(0, 1)])
    >>> found.points.shape, found.blocks.shape, found.covariance().shape
    ((2, 3), (2, 3, 3), (6, 6))
    >>> f"{1e6 * found.lengths[0].standard_uncertainty:.3f} µm"
    '0.080 µm'
    """
    import pandas
    from ballplate.extensions.maps.correction import correction

    from .results.wanted_lengths import between_named
    from .simulator.readings import point_files

    ensure_one_of(("scale readings", "ball centres"), coordinates=coordinates)
    ensure_positive("a number above 0 and at most 100", 100.0, coverage_factor=coverage_factor)
    ensure_type(bool, "True or False", with_repeatability=with_repeatability)
    chosen = _fitted("fitted", fitted)
    names = chosen.probes.names
    offsets = chosen.drawn_offsets if coordinates == "ball centres" else None
    if isinstance(points, str | os.PathLike | pandas.DataFrame):
        one = chosen.probe if probe is None else probe
        if one not in names:
            raise ValueError(f"no probe {one!r}; {hint(str(one), names)}")
        table = _table("points", points)
        given = point_files.read_points(table, names, str(one), chosen.volume, offsets)
    else:
        x = point_files.ensure_points(points, chosen.volume)
        asked = chosen.probe if probe is None else probe
        probes = point_files.probe_places(asked, names, len(x))
        x = x if offsets is None else x - offsets[probes]
        given = point_files.GivenPoints(x, ("",) * len(x), probes)
    wanted = between_named(given, lengths)
    return correction(chosen, given, wanted, coverage_factor, with_repeatability)


def spline(
    file: PathLike,
    x: str | None = None,
    y: str | None = None,
    points: str | None = None,
    sigma: Literal["estimated", "given"] | None = None,
    powers: Literal["local", "global"] = "local",
    **wanted: Any,
) -> FittedCurve:
    """A spline with prescribed values and slopes through the measured errors of a CSV file.

    `x` and `y` are columns, and `points` names those that are used. What curve is `wanted` is said
    as by the options of `ballplate spline`: order, every, knots, start, end, boundary, straight,
    start_value, start_slope, end_value, end_slope, at, periodic, period, uncertainty and evaluate,
    in texts with units.

    >>> table = "designs/gilsinn/table-1.csv"
    >>> spline(table, "arc_length", "finish_error", "12-32", start_slope="0")
    <FittedCurve of table-1: 21 points, 7 free coefficients>
    """
    from ballplate.extensions.splines.curve_options import Asked, OptionError, ensure_asked
    from ballplate.extensions.splines.curve_result import error_curve

    ensure_path("file", file)
    ensure_type(str, "the name of a column", x=x, y=y)
    ensure_type(str, 'names of points such as "12-32"', points=points)
    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_one_of(("local", "global"), powers=powers)
    ensure_asked(wanted)
    try:
        return error_curve(Path(file), x, y, points, Asked(**wanted), sigma, powers)
    except OptionError as error:
        # Options are arguments here.
        named = re.sub(r"--([a-z]+)-?([a-z]*)", _argument, str(error))
        raise ValueError(named) from None


def reproduce(
    document: Literal["npl", "certified"],
    experiment: str | Iterable[str] = (),
    trials: int | None = 100,
    designs: PathLike | None = None,
    results: PathLike | None = None,
    report: Report = unreported,
) -> ReproducedDocument | CertifiedScores:
    """The published figures of NPL Report CISE 15/98 beside ours, or the problems with certified
    answers solved.

    An `experiment` is a section such as 6.2.1, or the name of a problem; without any it is all of
    them. `trials` is the number of synthetic data sets of section 6.2.7, None leaves them out.
    `designs` is a folder in place of the designs that come with ballplate, `results` a JSON file
    with another program's answers to the certified problems.

    >>> reproduce("npl", "6.1.2").is_right
    True
    """
    from ballplate.extensions.reproduction.reproduction_result import reproduce_npl
    from ballplate.extensions.reproduction.score_result import score_certified

    from .montecarlo.trials import MOST_TRIALS

    if document not in ("npl", "certified"):
        raise ValueError(f'document: "{document}" is unknown; give npl or certified')
    ensure_whole(1, MOST_TRIALS, trials=trials)
    ensure_report(report)
    chosen = (experiment,) if isinstance(experiment, str) else tuple(experiment)
    folder = None if designs is None else Path(designs)
    if document == "npl":
        if results is not None:
            raise ValueError("results go with certified only; leave them out")
        return reproduce_npl(chosen, trials, folder, report)
    answers = None if results is None else Path(results)
    return score_certified(chosen, answers, folder, report)


def _fitted(name: str, given: Fit | FittedMap | PathLike) -> FittedMap:
    """The map of a fit, of what its to_map() gives, or of a file."""
    found = _machine(name, given)
    return load_map(found) if isinstance(found, Path) else found


def _machine(name: str, given: Fit | FittedMap | PathLike) -> FittedMap | Path:
    """The map of a fit, or of what its to_map() gives; the path of a file as such."""
    from .results.fit import Fit

    side = _side(name, given)
    return side.to_map() if isinstance(side, Fit) else side


def _side(name: str, given: Fit | FittedMap | PathLike) -> Fit | FittedMap | Path:
    """A map to be compared: the path of a file as such."""
    from .results.fit import Fit
    from .simulator.maps.fitted_map import FittedMap

    if isinstance(given, str | os.PathLike):
        return Path(given)
    if not isinstance(given, Fit | FittedMap):
        raise TypeError(f"{name}={given!r}; give a fit, what its to_map() gives, or a path")
    return given


def _several(name: str, given: Any) -> tuple[int, ...]:
    if isinstance(given, Iterable) and type(given) is not str:
        return tuple(given)
    ensure_whole(2, None, **{name: given})
    return (given,)


def _texts(name: str, given: str | Iterable[str]) -> tuple[str, ...]:
    """One text or several."""
    found = (given,) if isinstance(given, str) else tuple(given)
    for text in found:
        ensure_type(str, 'a text such as "x=22 um/m"', **{name: text})
    return found


def _argument(option: re.Match[str]) -> str:
    """The name of an argument for that of an option."""
    return "_".join(filter(None, option.groups()))


def _table(name: str, given: PathLike | pandas.DataFrame) -> Path | GivenText:
    if isinstance(given, str | os.PathLike):
        return Path(given)
    import pandas

    if not isinstance(given, pandas.DataFrame):
        raise TypeError(f"{name}={given!r}; give the path of a CSV file, or a data frame")
    return GivenText(name, given.to_csv(index=False))


def _tables(given: Tables, experiment: Experiment) -> list[Path | GivenText]:
    """Tables of readings, or those that the experiment names."""
    if given is None:
        named = experiment.readings.named_files
        if not named:
            raise ValueError("readings: the experiment names no files; give a table")
        return [experiment.source.parent / name for name in named]
    if not isinstance(given, list | tuple):
        return [_table("readings", given)]
    if not given:
        raise ValueError("readings: no table; give one at least")
    return [_table(f"readings[{k}]", one) for k, one in enumerate(given)]


def _experiment(given: Any) -> Experiment:
    if isinstance(given, Experiment):
        return given
    if isinstance(given, str | os.PathLike):
        return load(given)
    what = "convert it with experiment()" if isinstance(given, Mapping) else "give either"
    kind = type(given).__name__
    raise TypeError(f"experiment: {kind} is neither an experiment nor the path of a file; {what}")


def _shown_in_notebook(experiment: Experiment) -> str:
    """An experiment in a notebook: its table, and its picture, of which it knows nothing."""
    return experiment._repr_html_() + view(experiment)._repr_html_()


def _teach_notebook() -> None:
    """Let the session of IPython, if this is one, show experiments so."""
    session = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if session is not None:
        formatter = session.display_formatter.formatters["text/html"]
        formatter.for_type(Experiment, _shown_in_notebook)


_teach_notebook()
