"""Error models that are compared: polynomials of different lengths, empirical, the file's own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from ballplate.simulator.design import Design, Priors
from ballplate.simulator.estimation import linearise
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import Settings, refused
from ballplate.simulator.machines import (
    EmpiricalSettings,
    ErrorModel,
    KinematicSettings,
    build_error_model,
)

# What the file's own model is called in front of its kind, where it is none of the others.
FILE = "the file's, "

# Coefficients of positional and rotational errors of the smallest model: straight axes.
STRAIGHT = (2, 1)

# Numbers of coefficients of polynomials that are tried unless more are asked for.
MOST_COEFFICIENTS = 8

# Numbers of coefficients of the univariate functions of empirical models.
EMPIRICAL = (3, 4, 5)


@dataclass(frozen=True)
class LadderModel:
    """An error model to compare, with its settings as a file states them.

    `numbers` are the coefficients of all positional and of all rotational errors, None if a model
    of the file states others.
    """

    words: str
    settings: Settings
    model: ErrorModel
    numbers: tuple[int, int] | None = None

    @property
    def count(self) -> int:
        """Number of parameters."""
        return len(self.model.parameters)

    def contains(self, other: LadderModel) -> bool:
        """True if another model is of the same kind, with fewer coefficients."""
        if self.numbers is None or other.numbers is None or self.count <= other.count:
            return False
        return type(self.settings) is type(other.settings) and all(
            mine >= its for mine, its in zip(self.numbers, other.numbers, strict=True)
        )


def with_model(design: Design, model: ErrorModel) -> Design:
    """The design with another error model, about which nothing is known beforehand."""
    priors = design.of(Priors)
    by_model = np.zeros((len(priors), len(model.parameters)))
    return replace(design, model=model).observed(replace(priors, by_model=by_model))


def deficiency(design: Design, model: LadderModel) -> int:
    """How many directions of its parameters a design with this model leaves undetermined."""
    return linearise(with_model(design, model.model)).deficiency


def kinematic_rung(experiment: Experiment, position: int, rotation: int) -> LadderModel:
    """A kinematic model with polynomials of so many coefficients, arranged as the file says if its
    model is kinematic.
    """
    kinematic = experiment.error_model
    if not isinstance(kinematic, KinematicSettings):
        kinematic = KinematicSettings(kind="kinematic")
    settings = KinematicSettings(
        kind="kinematic",
        arrangement=kinematic.arrangement,
        rotations=kinematic.rotations,
        position_coefficients=position,
        rotation_coefficients=rotation,
        basis="monomial" if kinematic.basis == "monomial" else "chebyshev",
        squareness=kinematic.squareness,
    )
    words = f"kinematic, {position} and {rotation} coefficients"
    return LadderModel(words, settings, _built(experiment, settings), (position, rotation))


def empirical_rung(experiment: Experiment, coefficients: int) -> LadderModel:
    """An empirical model of sums of tensor products of polynomials with so many coefficients."""
    settings = EmpiricalSettings(kind="empirical", coefficients=coefficients)
    words = f"empirical, {coefficients} coefficients"
    numbers = (coefficients, coefficients)
    return LadderModel(words, settings, _built(experiment, settings), numbers)


def rung_of_file(experiment: Experiment, model: ErrorModel) -> LadderModel:
    """The error model of the file, with its numbers of coefficients if it has no others."""
    settings: Any = experiment.error_model
    rung = None
    if isinstance(settings, KinematicSettings):
        numbers = settings.position_coefficients, settings.rotation_coefficients
        rung = kinematic_rung(experiment, *numbers)
    elif isinstance(settings, EmpiricalSettings) and isinstance(settings.coefficients, int):
        rung = empirical_rung(experiment, settings.coefficients)
    if rung is not None and rung.model == model:
        return rung
    return LadderModel(f"{FILE}{settings.kind}", settings, model)


def _built(experiment: Experiment, settings: Settings) -> ErrorModel:
    return build_error_model(settings, *experiment.machine.volume.corners)


def determined_rungs(
    experiment: Experiment, design: Design, most: int
) -> tuple[list[LadderModel], dict[type[Settings], str]]:
    """Return the error models that a design determines, of at most `most` coefficients, and by
    settings a description of those that it leaves undetermined.

    :raises ExperimentError: priors of the file's own parameters, which other models do not have,
        or readings that leave no degrees of freedom even with straight axes.
    """
    if design.of(Priors).of_model.any():
        text = (
            "models cannot be compared with priors of one model's parameters; remove the priors of"
            " the machine's errors"
        )
        raise refused(experiment.source, text, "priors")
    straight = kinematic_rung(experiment, *STRAIGHT)
    undetermined = deficiency(design, straight)

    def is_determined(model: LadderModel) -> bool:
        tried = with_model(design, model.model)
        freedom = tried.observation_count - tried.parameter_count + undetermined
        return freedom > 0 and deficiency(design, model) == undetermined

    if not is_determined(straight):
        text = "the readings leave no degrees of freedom to compare error models by; read more"
        raise refused(experiment.source, text, "positions")
    kinematic = (kinematic_rung(experiment, count, count) for count in range(2, most + 1))
    empirical = (empirical_rung(experiment, count) for count in EMPIRICAL if count <= most)
    rungs, undetermined_rungs = [straight], dict[type[Settings], str]()
    for models in (kinematic, empirical) if experiment.dimension == 3 else (kinematic,):
        for model in models:
            if not is_determined(model):
                undetermined_rungs[type(model.settings)] = f"{model.words} or more"
                break
            rungs.append(model)
    file = rung_of_file(experiment, design.model)
    if file.numbers is not None and is_determined(file):
        rungs.append(file)
    unique = {model.words: model for model in rungs if model.count}
    return sorted(unique.values(), key=lambda model: model.count), undetermined_rungs
