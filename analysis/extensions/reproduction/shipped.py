"""Shipped designs by their names: loaded, planned and fitted once."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ballplate.results import Fit, Prediction, fit, predict
from ballplate.simulator.experiment import Experiment, lay_out, load
from ballplate.simulator.inputs import hint, refused
from ballplate.simulator.readings import ObservedReadings, exact_readings, on_stated_machine
from ballplate.uncertainty import Quantity

from .published_quantities import tabulated_quantities


@dataclass(frozen=True)
class Shipped:
    """The designs in a folder, one YAML file for each experiment; what was loaded and planned is
    kept.
    """

    folder: Path
    loaded: dict[str, dict[str, Experiment]] = field(default_factory=dict)
    plans: dict[str, Prediction] = field(default_factory=dict)
    tabulated: dict[str, dict[str, Quantity]] = field(default_factory=dict)


def variants(shipped: Shipped, name: str) -> dict[str, Experiment]:
    """Experiments of the file `name`.yaml by their labels.

    :raises ExperimentError: the folder or the file is missing, or the file has errors.
    """
    if name not in shipped.loaded:
        if not shipped.folder.is_dir():
            text = (
                "no such folder; name that of the shipped designs, which is designs/npl in a"
                " checkout, with --designs"
            )
            raise refused(shipped.folder, text)
        shipped.loaded[name] = {one.label: one for one in load(shipped.folder / f"{name}.yaml")}
    return shipped.loaded[name]


def shipped_experiment(shipped: Shipped, label: str) -> Experiment:
    """The experiment that is labelled `file[variant]`.

    :raises ExperimentError: there is none.
    """
    name = label.partition("[")[0]
    found = variants(shipped, name)
    if label not in found:
        text = f'no experiment "{label}"; {hint(label, found)}'
        raise refused(shipped.folder / f"{name}.yaml", text)
    return found[label]


def planned(shipped: Shipped, label: str) -> Prediction:
    """The plan of a shipped design, at zero machine error."""
    if label not in shipped.plans:
        shipped.plans[label] = predict(shipped_experiment(shipped, label))
    return shipped.plans[label]


def tabulated(shipped: Shipped, label: str) -> dict[str, Quantity]:
    """Quantities of a shipped design, at zero machine error, in the form of the document's
    tables.
    """
    if label not in shipped.tabulated:
        found = planned(shipped, label)
        shipped.tabulated[label] = found.quantities | tabulated_quantities(found.design)
    return shipped.tabulated[label]


def fitted_exactly(experiment: Experiment) -> Fit:
    """The fit of readings without noise of an experiment's true machine, with uncertainties as
    given.
    """
    design = lay_out(experiment)
    _, x = exact_readings(*on_stated_machine(experiment, design))
    return fit(experiment, ObservedReadings(design, x, (), ()), sigma="given")


def sums_of_squares(fit: Fit) -> list[float]:
    """S^2 of each iteration in square metres, with weight 1 for a reading."""
    scale = float(fit.design.machine.repeatability[0]) ** 2
    return [scale * iteration.sum_of_squares for iteration in fit.solution.iterations]
