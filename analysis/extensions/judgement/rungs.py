"""Error models of a ladder: polynomials of different lengths, empirical models, the file's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from ballplate.simulator.design import Design, Priors
from ballplate.simulator.estimation import linearise
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import Settings, refused
from ballplate.simulator.machines import (
    Basis,
    EmpiricalSettings,
    ErrorModel,
    FunctionsSettings,
    KinematicModel,
    KinematicSettings,
    PlaneModel,
    build_error_model,
)

from .containing_models import NotContainedError, linear_map

# What the file's own model is called in front of its kind, where it is none of the others.
FILE = "the file's, "

# Coefficients of positional and rotational errors of the poorest rung: straight axes.
POOREST = (2, 1)

# Numbers of coefficients of polynomials that are tried unless more are asked for.
MOST_COEFFICIENTS = 8

# Numbers of coefficients of the univariate functions of empirical models.
EMPIRICAL = (3, 4, 5)


@dataclass(frozen=True)
class LadderModel:
    """An error model of the ladder, with its settings as a file states them.

    `numbers` are the coefficients of all positional and of all rotational errors of a kinematic
    one, None of others, and `own` those of single functions by ISO 230-1 name. Of an empirical one
    `within` is the number of coefficients of the kinematic models that it contains.
    """

    words: str
    settings: Settings
    model: ErrorModel
    numbers: tuple[int, int] | None = None
    own: tuple[tuple[str, int], ...] = ()
    within: int = 0

    @property
    def count(self) -> int:
        """Number of parameters."""
        return len(self.model.parameters)

    def coefficients(self, name: str, is_rotation: bool) -> int:
        """Coefficients of an error function, the constant included."""
        assert self.numbers is not None
        return max(dict(self.own).get(name, 0), self.numbers[int(is_rotation)])


def with_model(design: Design, model: ErrorModel) -> Design:
    """The design with another error model, about which nothing is known beforehand."""
    priors = design.of(Priors)
    by_model = np.zeros((len(priors), len(model.parameters)))
    return replace(design, model=model).observed(replace(priors, by_model=by_model))


def refuse_priors(experiment: Experiment, design: Design) -> None:
    """Refuse prior knowledge of the file's own parameters, which other models do not have.

    :raises ExperimentError: there is such.
    """
    if design.of(Priors).of_model.any():
        text = (
            "models cannot be compared with priors of one model's parameters; remove the priors of"
            " the machine's errors"
        )
        raise refused(experiment.source, text, "priors")


def kinematic_rung(
    experiment: Experiment,
    position: int,
    rotation: int,
    own_degrees: Mapping[str, int] | None = None,
) -> LadderModel:
    """A kinematic model with polynomials of so many coefficients, those of single functions
    `own_degrees`; arranged as the file says if its model is kinematic.
    """
    kinematic = experiment.error_model
    if not isinstance(kinematic, KinematicSettings):
        kinematic = KinematicSettings(kind="kinematic")
    basis: Literal["monomial", "chebyshev"] = (
        "monomial" if kinematic.basis == "monomial" else "chebyshev"
    )
    single = {} if own_degrees is None else dict(own_degrees)
    settings = KinematicSettings(
        kind="kinematic",
        arrangement=kinematic.arrangement,
        rotations=kinematic.rotations,
        position_coefficients=position,
        rotation_coefficients=rotation,
        basis=basis,
        squareness=kinematic.squareness,
        **({"functions": FunctionsSettings(**single)} if single else {}),
    )
    words = f"kinematic, {position} and {rotation} coefficients"
    if single:
        words += "".join(f", {name} {count}" for name, count in single.items())
    return LadderModel(
        words, settings, _built(experiment, settings), (position, rotation), tuple(single.items())
    )


def empirical_rung(experiment: Experiment, coefficients: int) -> LadderModel:
    """An empirical model of sums of tensor products of polynomials with so many coefficients."""
    settings = EmpiricalSettings(kind="empirical", coefficients=coefficients)
    words = f"empirical, {coefficients} coefficients"
    model = _built(experiment, settings)
    kinematic = kinematic_rung(experiment, coefficients, coefficients)
    within = coefficients if _within_once(kinematic.model, model) else 0
    return LadderModel(words, settings, model, within=within)


def own_rung(experiment: Experiment, model: ErrorModel) -> LadderModel:
    """The error model of the file."""
    settings: Any = experiment.error_model
    return LadderModel(f"{FILE}{settings.kind}", settings, model)


def _built(experiment: Experiment, settings: Settings) -> ErrorModel:
    return build_error_model(settings, *experiment.machine.volume.corners)


def deficiency(design: Design, rung: LadderModel) -> int:
    """How many directions of its parameters a design with this model leaves undetermined."""
    return linearise(with_model(design, rung.model)).deficiency


def contains(outer: LadderModel, inner: LadderModel) -> bool:
    """True if an error model can do all that another can, and more."""
    if inner.count >= outer.count:
        return False
    if inner.numbers is None:
        return bool(inner.within and inner.within <= outer.within) or (
            not (inner.within or outer.within) and _is_within(inner.model, outer.model)
        )
    chain = chain_of(inner.model).functions
    if outer.numbers is None:
        most = max(inner.coefficients(link.name, link.rotation) for link in chain)
        return most <= outer.within
    return all(
        outer.coefficients(link.name, link.rotation) >= inner.coefficients(link.name, link.rotation)
        for link in chain
    )


def _is_within(inner: ErrorModel, outer: ErrorModel) -> bool:
    if outer.dimension != 3:
        # Models are compared in space only.
        return False
    try:
        linear_map(inner, outer)
    except NotContainedError:
        return False
    return True


_within_once: Any = lru_cache(maxsize=32)(_is_within)
"""The same for models of this program, which are hashed: it takes as long as a fit."""


def chain_of(model: ErrorModel) -> KinematicModel:
    """The chain of axes of a kinematic rung, also in a plane."""
    chain = model.spatial if isinstance(model, PlaneModel) else model
    assert isinstance(chain, KinematicModel)
    return chain


def free_coefficients(basis: Basis, coefficients: int) -> int:
    """How many functions of a polynomial basis are left with so many coefficients.

    >>> from ballplate.simulator.machines.bases import Polynomial
    >>> free_coefficients(Polynomial(8), 3), free_coefficients(Polynomial(8, True), 3)
    (2, 1)
    """
    return max(coefficients - 1 - int(basis.zero_at_one), 0)
