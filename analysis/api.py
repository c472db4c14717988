"""ballplate from Python: what the commands do, with results in place of text.

Wherever an experiment is taken, so is the path of a file with one. Values in results are in metres,
radians and ratios. Every function raises `ballplate.ExperimentError` for a file or an experiment
that is wrong, and ValueError for an argument that is.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ballplate.simulator.computing.steps import Report, unreported
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.settings import hint
from ballplate.simulator.inputs.yamltree import GivenText, read_text

from .simulator.experiment.load import load as load_file
from .simulator.experiment.model import Experiment

if TYPE_CHECKING:
    import pandas

    from .gross_errors.reliability import Reliability
    from .montecarlo.trials import MonteCarloProgress
    from .planning.criteria import CriterionName
    from .planning.requirements.answers import Reach
    from .planning.requirements.unknowns import UnknownName
    from .planning.selection import Campaign
    from .results.fit import Fit
    from .results.prediction import Prediction
    from .sweeps.execute import Summary
    from .sweeps.running import SweepResult

PathLike = str | os.PathLike[str]

SIGMAS = ("estimated", "given")

# Chances that `ballplate reliability` takes too; beyond them there is no test that could be told.
LEAST_CHANCE, MOST_CHANCE = 1e-12, 0.999999


def load(path: PathLike, variant: str | None = None) -> Experiment:
    """The experiment of a file, or one of its variants.

    :raises ExperimentError: the file is wrong, or has several variants and none was chosen.

    >>> load("designs/quickstart.yaml")
    <Experiment quickstart: 5 x 5 ball plate in six positions>
    >>> load("designs/npl/6.1.1.yaml", variant="B").label
    '6.1.1[B]'
    """
    found = load_all(path)
    names = [str(one.name) for one in found]
    if variant is not None:
        if variant in names:
            return found[names.index(variant)]
        told = hint(variant, names) if found[0].name is not None else "the file has no variants"
        raise ExperimentError(
            [Message(str(path), 0, 0, "variants", f'no variant "{variant}"; {told}')]
        )
    if len(found) > 1:
        text = (
            "the file has several variants; choose one with variant=, or load_all:"
            f" {', '.join(names)}"
        )
        raise ExperimentError([Message(str(path), 0, 0, "variants", text)])
    return found[0]


def load_all(path: PathLike) -> tuple[Experiment, ...]:
    """The experiment of a file, or all of its variants in their order.

    >>> [one.name for one in load_all("designs/npl/6.1.1.yaml")]
    ['A', 'B', 'C', 'D']
    """
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

    return written_in_python(sections, Path(folder))


def quickstart() -> Experiment:
    """A small experiment to begin with: a plate of 5 x 5 balls in six positions.

    >>> quickstart().title
    '5 x 5 ball plate in six positions'
    """
    from .designs import shipped

    return load(shipped("quickstart.yaml"))


def check(experiment: Experiment | PathLike) -> Prediction:
    """Whether a design determines everything it asks for and, if not, what it leaves open.

    >>> check("designs/quickstart.yaml").verdict.deficiency
    0
    """
    from .results import study

    return study.check(_experiment(experiment), with_scale=True)


def repair(path: PathLike, variant: str | None = None) -> str:
    """The text of an experiment file after the cheapest changes that determine everything, of one
    variant or of each; the rest of it is as it was, line ends included.

    The text of a file that leaves nothing undetermined is returned as it is. Nothing is written.

    :raises ExperimentError: the file is wrong; no changes were found, or they cannot be written
        without changing what stands about them.

    >>> before = Path("designs/npl/6.1.1.yaml").read_text(encoding="utf-8").splitlines()
    >>> set(repair("designs/npl/6.1.1.yaml", variant="B").splitlines()).difference(before)
    {'    positions[z low].quarter_turns: 1'}
    """
    from .planning.repair.mending import mended, to_write
    from .planning.repair.repair_search import repairs
    from .results import study
    from .simulator.experiment.load import with_pool

    text = read_text(Path(path))
    for one in load_all(path) if variant is None else [load(path, variant)]:
        judged = study.check(one).verdict
        if not judged.deficiency:
            continue
        found = to_write(repairs(with_pool(one)), judged)
        if found is None:
            words = "no changes were found after which nothing is undetermined"
            raise ExperimentError([one.message((), words)])
        text = mended(text, Path(path), one.name, found)
    return text


def run(
    experiment: Experiment | PathLike,
    trials: int | None = None,
    until: float | None = None,
    seed: int | None = None,
    workers: int = 1,
    report: Callable[[MonteCarloProgress], None] = lambda progress: None,
) -> Prediction:
    """Rank and the uncertainties U1 to U6 of a design, with Monte Carlo beside them where `trials`
    are asked for.

    At most `trials` data sets are estimated, or as many as make the ratios of spread to uncertainty
    as accurate as `until`.

    >>> run(quickstart())
    <Prediction of quickstart: full rank, U6 0.143 um on average, 0.325 um at most>
    """
    from dataclasses import replace

    from .results import study

    _positive("workers", workers)
    if trials is not None and trials < 2:
        raise ValueError(f"trials={trials}; give 2 at least, since fewer have no scatter")
    if until is not None and not 0.0 < until <= 1.0:
        raise ValueError(f"until={until}; give a ratio above 0 and at most 1, such as 0.01")
    chosen = _experiment(experiment)
    predicted = study.predict(chosen, with_scale=True)
    if trials is None and until is None:
        return predicted
    from .montecarlo import experiments as replicates
    from .montecarlo.trials import MOST_TRIALS

    found = replicates.trials(
        chosen, MOST_TRIALS if trials is None else trials, seed, until, workers, report
    )
    return replace(predicted, monte_carlo=found)


def simulate(
    experiment: Experiment | PathLike, seed: int | None = None, exact: bool = False
) -> pandas.DataFrame:
    """Readings of the experiment's true machine, with noise from a seed, as a table that `fit`
    takes.

    >>> list(simulate(quickstart()).columns)
    ['position', 'ball', 'probe', 'x_mm', 'y_mm', 'z_mm']
    """
    import pandas
    from ballplate.simulator.readings.reading_files import AXES
    from ballplate.simulator.readings.simulated import simulated_readings

    found = simulated_readings(_experiment(experiment), seed, exact)
    design, readings = found.design, found.readings
    columns: dict[str, Any] = {
        "position": [design.positions.names[k] for k in readings.position],
        "ball": [design.balls.names[k] for k in readings.ball],
        "probe": [design.probes.names[k] for k in readings.probe],
    }
    for k, axis in enumerate(AXES[: design.dimension]):
        columns[f"{axis}_mm"] = 1e3 * found.x[:, k]
    return pandas.DataFrame(columns)


def fit(
    experiment: Experiment | PathLike,
    readings: PathLike | pandas.DataFrame,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
) -> Fit:
    """The estimate from readings, of a CSV file or a data frame with the same columns.

    `sigma` overrides what the experiment says; with `monomials` the machine's parameters are the
    coefficients of t, t^2, ... on [0, 1].

    >>> fit(quickstart(), simulate(quickstart())).converged
    True
    """
    from ballplate.simulator.design.layout import lay_out
    from ballplate.simulator.readings.reading_files import read_readings

    from .results import study

    _one_of("sigma", sigma, SIGMAS)
    chosen = _experiment(experiment)
    observed = read_readings(_table(readings), lay_out(chosen))
    return study.fit(chosen, observed, sigma, monomials)


def plan(
    experiment: Experiment | PathLike,
    criterion: CriterionName = "U6",
    hours: float | None = None,
    positions: int | None = None,
    readings: int | None = None,
    curve: bool = False,
    seed: int = 1,
    workers: int = 1,
    report: Report = unreported,
) -> Campaign:
    """Positions and certificates chosen from the experiment's pool for a budget, with the bound of
    any choice.

    Without a budget the choice may cost what the positions of the experiment itself do.

    >>> corners = {"x": ["50 mm"], "y": ["50 mm"]}
    >>> places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": corners}
    >>> pool = {"candidates": [places | {"probes": ["down"]}]}
    >>> plan(quickstart().with_(pool=pool), positions=7)
    <Campaign of quickstart: 7 of 8 candidates, U6 0.137 um>
    """
    from .planning.campaign import Request, campaign
    from .planning.constraints import HOUR, Budget
    from .planning.criteria import NAMES
    from .simulator.experiment.load import with_pool

    _one_of("criterion", criterion, NAMES)
    for name, most in {
        "hours": hours,
        "positions": positions,
        "readings": readings,
        "workers": workers,
    }.items():
        _positive(name, most)
    budget = None
    if (hours, positions, readings) != (None, None, None):
        budget = Budget(None if hours is None else HOUR * hours, readings, positions)
    request = Request(criterion, budget, curve, seed)
    return campaign(with_pool(_experiment(experiment)), request, workers=workers, report=report)


def reliability(
    experiment: Experiment | PathLike,
    false_alarm: float = 0.001,
    power: float = 0.8,
    sigma: Literal["estimated", "given"] | None = None,
) -> Reliability:
    """Which mistakes in readings and certificates residuals would show, and what those do that they
    would not.

    >>> reliability(quickstart()).degrees_of_freedom
    580
    """
    from .gross_errors import redundancy

    _one_of("sigma", sigma, SIGMAS)
    if not LEAST_CHANCE <= false_alarm < power <= MOST_CHANCE:
        limits = f"{LEAST_CHANCE:g} and {MOST_CHANCE:g}"
        raise ValueError(
            f"false_alarm={false_alarm}, power={power}; give ratios between {limits}, the power the"
            " larger"
        )
    return redundancy.reliability(_experiment(experiment), false_alarm, power, sigma)


def reach(
    experiment: Experiment | PathLike,
    goal: str = "lengths",
    unknowns: UnknownName | Sequence[UnknownName] | None = None,
    target: str | None = None,
) -> Reach:
    """The repeatability, certificate, repeats, balls or size of the plate with which a goal is met.

    `goal` is as `ballplate reach --goal` has it, `unknowns` one of repeatability, certificate,
    repeats, balls and size, or several; without any it is all of them. `target` replaces the
    experiment's target, as a text with a unit.

    >>> reach(quickstart(), "U6 average 0.2 um", ["repeatability"]).answers[0].is_met
    True
    """
    from .planning.requirements.goals import parse_goal
    from .planning.requirements.root_search import reach as search
    from .planning.requirements.unknowns import NAMES

    names = (unknowns,) if isinstance(unknowns, str) else tuple(unknowns or NAMES)
    for name in names:
        _one_of("unknowns", name, NAMES)
    return search(_experiment(experiment), parse_goal(goal), names, target=target)


def sweep(
    path: PathLike,
    store: PathLike | None = None,
    workers: int = 1,
    retry_failed: bool = False,
    beside: bool = False,
    report: Callable[[Summary], None] = lambda summary: None,
) -> SweepResult:
    """A family of experiments, computed into a store, from which it goes on where it ended.

    The store is the sweep file's name with .sqlite, unless another is named. A sweep other than the
    one that it holds is refused, or entered `beside` that.

    :raises StoreError: the store cannot be used.
    :raises OtherSweepError: it holds another sweep.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sweep("designs/sweeps/plate-size.yaml", f"{folder}/plates.sqlite")
    <SweepResult of plate-size: 12 cells, 12 done, 0 failed>
    """
    from contextlib import nullcontext

    from .sweeps.bundle import bundle_of
    from .sweeps.load import load_sweep
    from .sweeps.local import local_runner
    from .sweeps.running import compute_sweep, enter, result_of, writable_store

    _positive("workers", workers)
    given = load_sweep(path)
    bundle = bundle_of(given)
    with writable_store(
        Path(path).with_suffix(".sqlite") if store is None else Path(store)
    ) as opened:
        entered = enter(opened, given, bundle, beside)
        runner = nullcontext(local_runner(given, bundle, workers))
        summary = compute_sweep(opened, given, entered, runner, retry_failed, report=report)
        return result_of(opened, given, entered, summary)


def _one_of(name: str, given: str | None, known: Sequence[str]) -> None:
    if given is not None and given not in known:
        raise ValueError(f'{name}: "{given}" is unknown; {hint(given, known)}')


def _positive(name: str, given: float | None) -> None:
    if given is not None and not given > 0:
        raise ValueError(f"{name}: {given!r} is not above 0")


def _table(readings: PathLike | pandas.DataFrame) -> Path | GivenText:
    if isinstance(readings, str | os.PathLike):
        return Path(readings)
    return GivenText("readings", readings.to_csv(index=False))


def _experiment(given: Experiment | PathLike) -> Experiment:
    return given if isinstance(given, Experiment) else load(given)
