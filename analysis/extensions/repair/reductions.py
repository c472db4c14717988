"""Reductions: another plate, or fewer coefficients."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import GridSettings, SquareSettings
from ballplate.simulator.machines import (
    EmpiricalSettings,
    KinematicSettings,
    MachineFileSettings,
    SplineSettings,
    has_polynomials,
)

from .changes import Change, ChangeKind, with_artefact

# More balls a side, and fewer coefficients, than this are not tried.
MOST_BALLS_MORE, MOST_COEFFICIENTS_LESS = 6, 6


def more_balls(experiment: Experiment) -> Iterator[Change]:
    """Plates with more balls on the same size."""
    for name, settings in experiment.artefacts.items():
        for more in range(1, MOST_BALLS_MORE + 1):
            if isinstance(settings, GridSettings):
                n = settings.balls
                balls: Any = (n[0] + more, n[1] + more)
                words = f"{balls[0]} x {balls[1]} balls on {name} instead of {n[0]} x {n[1]}"
            elif isinstance(settings, SquareSettings):
                balls = settings.balls + more
                words = f"{balls} balls a side on {name} instead of {settings.balls}"
            else:
                break
            try:
                new = type(settings).model_validate(
                    {**settings.model_dump(exclude_unset=True), "balls": balls}
                )
            except ValueError:
                new = settings.model_copy(update={"balls": balls})
            changed = with_artefact(experiment, name, new)
            if changed is not None:
                cost = float(
                    sum(position.count for position in changed.positions)
                    - sum(position.count for position in experiment.positions)
                )
                apply = partial(_with_artefact, name=name, settings=new)
                yield Change(
                    ChangeKind.ARTEFACT,
                    f"use {words}",
                    cost,
                    frozenset({f"artefact {name}"}),
                    apply,
                )


def _with_artefact(experiment: Experiment, name: str, settings: Any) -> Experiment:
    changed = with_artefact(experiment, name, settings)
    assert changed is not None
    return changed


def fewer_coefficients(experiment: Experiment) -> Iterator[Change]:
    """Return an error model with fewer coefficients."""
    model = experiment.error_model
    if any(prior.by_model.any() for prior in experiment.priors):
        # They are about coefficients that there would be no more.
        return
    keys: tuple[tuple[str, int, str], ...] = ()
    if isinstance(model, KinematicSettings) and not isinstance(model.basis, SplineSettings):
        keys = (
            ("position_coefficients", 2, "coefficients of positional errors"),
            # Of one coefficient there would be no rotational errors at all.
            ("rotation_coefficients", 2, "coefficients of rotational errors"),
        )
    elif isinstance(model, EmpiricalSettings) and has_polynomials(model):
        keys = (("coefficients", 2, "coefficients"),)
    elif isinstance(model, MachineFileSettings):
        keys = (("knots", 0, "interior knots"),)
    for key, least, words in keys:
        stated = getattr(model, key)
        along = {"": stated} if isinstance(stated, int) else stated.model_dump(exclude_unset=True)
        for axis, now in along.items():
            for value in range(now - 1, max(now - MOST_COEFFICIENTS_LESS, least) - 1, -1):
                new: Any = stated.model_copy(update={axis: value}) if axis else value
                apply = partial(replace, error_model=model.model_copy(update={key: new}))
                coefficients = (
                    words
                    if value != 1
                    else words.replace("coefficients", "coefficient").replace("knots", "knot")
                )
                description = (
                    f"estimate {value} {coefficients}{axis and f' along {axis}'} instead of {now},"
                    " holding the others at zero"
                )
                yield Change(
                    ChangeKind.MODEL, description, float(now - value), frozenset({"model"}), apply
                )
