"""Shipped designs by name: loaded, planned and fitted once."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ballplate.results import Fit, Prediction, fit, predict
from ballplate.simulator.experiment import Experiment, lay_out, load
from ballplate.simulator.inputs import hint, refused
from ballplate.simulator.readings import exact_readings, observe, on_stated_machine
from ballplate.uncertainty import Quantity

from .published_quantities import tabulated_quantities


@dataclass(frozen=True)
class Shipped:
    """The designs in a folder, one YAML file for each experiment, with a cache of results."""

    folder: Path
    loaded: dict[str, dict[str, Experiment]] = field(default_factory=dict)
    plans: dict[str, Prediction] = field(default_factory=dict)
    tabulated: dict[str, dict[str, Quantity]] = field(default_factory=dict)


def variants(shipped: Shipped, name: str) -> dict[str, Experiment]:
    """Return experiments of the file `name`.yaml by their labels.

    :raises ExperimentError: the folder or the file is missing, or the file has errors.
    """
    if name not in shipped.loaded:
        if not shipped.folder.is_dir():
            text = (
                "no such folder; name that of the shipped designs, which is designs/npl in a"
                " checkout, with --designs"
            )
            raise refused(shipped.folder, text)
        shipped.loaded[name] = {
            experiment.label: experiment for experiment in load(shipped.folder / f"{name}.yaml")
        }
    return shipped.loaded[name]


def shipped_experiment(shipped: Shipped, label: str) -> Experiment:
    """Return the experiment with the label `file[variant]`.

    :raises ExperimentError: there is no such experiment.
    """
    name = label.partition("[")[0]
    experiments = variants(shipped, name)
    if label not in experiments:
        text = f'no experiment "{label}"; {hint(label, experiments)}'
        raise refused(shipped.folder / f"{name}.yaml", text)
    return experiments[label]


def planned(shipped: Shipped, label: str) -> Prediction:
    """Return the prediction of a shipped design, at zero machine error."""
    if label not in shipped.plans:
        shipped.plans[label] = predict(shipped_experiment(shipped, label))
    return shipped.plans[label]


def tabulated(shipped: Shipped, label: str) -> dict[str, Quantity]:
    """Return quantities of a shipped design, at zero machine error, in the form of the
    document's tables.
    """
    if label not in shipped.tabulated:
        prediction = planned(shipped, label)
        shipped.tabulated[label] = prediction.quantities | tabulated_quantities(prediction.design)
    return shipped.tabulated[label]


def fitted_exactly(experiment: Experiment) -> Fit:
    """Return the fit of readings without noise of the true machine, with uncertainties as given."""
    design = lay_out(experiment)
    readings, x = exact_readings(*on_stated_machine(experiment, design))
    return fit(experiment, observe(design, readings, x), sigma="given")


def sums_of_squares(fit: Fit) -> list[float]:
    """Return S^2 of each iteration in square metres, with weight 1 for a reading."""
    scale = float(fit.design.machine.repeatability[0]) ** 2
    return [scale * iteration.sum_of_squares for iteration in fit.solution.iterations]
