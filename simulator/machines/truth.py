"""The machine behind synthetic readings: an error model, which may differ from the estimated one,
and its parameters.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args

import numpy as np
from ballplate.simulator.computing.numerics import lstsq
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantities import PARSERS, QuantityError
from ballplate.simulator.inputs.quantity_types import Angle, PositiveLength
from ballplate.simulator.inputs.settings import Settings, hint
from ballplate.simulator.inputs.validation import OpenKinds
from pydantic import Field

from .arrangement import AXIS_ERRORS, SQUARENESS_ERRORS, AxisError
from .protocol import Corner, ErrorModel, HasLines, TrueMachine
from .settings import ErrorModelSettings, build_error_model, with_defaults


class ZeroSettings(Settings):
    """A machine without errors."""

    kind: Literal["zero"] = Field(default="zero", description="no errors")


OTHER_MODEL = "Error model of the true machine, if it differs from the estimated one."


class CoefficientSettings(Settings):
    """A machine with stated errors."""

    kind: Literal["coefficients"] = Field(description="stated errors")
    values: dict[str, str] = Field(
        description=(
            "Value with unit of each parameter that is not zero, by its name in the error model or"
            ' in the monomial form, for example "EXX t^2": 3 um.'
        )
    )
    error_model: ErrorModelSettings | None = Field(  # type: ignore[valid-type]
        default=None, description=OTHER_MODEL
    )


class RandomSettings(Settings):
    """A machine whose errors are drawn at random with stated sizes."""

    kind: Literal["random"] = Field(description="errors drawn at random")
    position: PositiveLength | None = Field(
        default=None,
        description="Root mean square of each positional error along its axis, or in the volume.",
    )
    rotation: Angle | None = Field(
        default=None,
        description="Root mean square of each rotational error along its axis, or in the volume.",
    )
    seed: int = Field(default=1, ge=0, description="Seed of the draw.")
    error_model: ErrorModelSettings | None = Field(  # type: ignore[valid-type]
        default=None, description=OTHER_MODEL
    )


class FurtherTrueMachine(Settings):
    """A true machine that an extension provides, in a module whose `read` returns it completed from
    its files and reports faults.
    """

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        """Return the machine in a volume, in the frame of the model that is fitted."""
        raise NotImplementedError


OF_KERNEL = (ZeroSettings, CoefficientSettings, RandomSettings)
KINDS = tuple(kind for keys in OF_KERNEL for kind in get_args(keys.model_fields["kind"].annotation))

if TYPE_CHECKING:
    TrueMachineSettings = Settings
else:
    TrueMachineSettings = Annotated[
        Union[OF_KERNEL],  # noqa: UP007
        OpenKinds("true_machines", FurtherTrueMachine),
    ]


def with_model_defaults(settings: Any, dimension: int) -> Any:
    """Return settings of a true machine whose own error model, if any, states the defaults for the
    number of dimensions.
    """
    model = getattr(settings, "error_model", None)
    if model is None:
        return settings
    return settings.model_copy(update={"error_model": with_defaults(model, dimension)})


class TruthError(ValueError):
    """A stated true machine contradicts its error model; `problems` are (parameter name, text)
    pairs.
    """

    def __init__(self, problems: list[tuple[str, str]]) -> None:
        self.problems = tuple(problems)
        super().__init__("; ".join(f"{name}: {text}" for name, text in problems))


def true_machine(
    settings: Settings, fitted: ErrorModel, lower: Corner, upper: Corner
) -> TrueMachine:
    """Return the true machine in a volume from `lower` to `upper` in metres.

    Its error model is its own, if stated, otherwise the estimated one, `fitted`. A machine from a
    file is transformed into the frame of `fitted`.

    :raises TruthError: see `true_parameters`.

    >>> from .arrangement import ARRANGEMENTS
    >>> from .kinematic import kinematic_model
    >>> corners = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    >>> model = kinematic_model(ARRANGEMENTS["MB2"], 2, 1, *corners)
    >>> true_machine(ZeroSettings(), model, *corners).a
    array([0., 0., 0., 0., 0., 0.])
    """
    if isinstance(settings, FurtherTrueMachine):
        return _of_extension(settings, fitted, lower, upper)
    own_model = getattr(settings, "error_model", None)
    model = fitted if own_model is None else build_error_model(own_model, lower, upper)
    return TrueMachine(model, true_parameters(settings, model))


def _of_extension(
    settings: FurtherTrueMachine, fitted: ErrorModel, lower: Corner, upper: Corner
) -> TrueMachine:
    """Return the machine of an extension's settings.

    :raises UnusableError: it is none, or has not one finite value for each parameter of its model.
    """
    machine = settings.true_machine(fitted, lower, upper)
    if isinstance(machine, TrueMachine):
        is_complete = np.shape(machine.a) == (len(machine.model.parameters),)
        if is_complete and np.isfinite(machine.a).all():
            return machine
    text = "returns no TrueMachine with a finite value for each parameter of its model"
    raise UnusableError(f"true_machine of {type(settings).__name__} {text}")


def true_parameters(settings: Settings, model: ErrorModel) -> Array:
    """Return parameters a (n,) of the true machine.

    :raises TruthError: an unknown parameter, an unsuitable unit, or values that break a frame
        constraint.
    """
    if isinstance(settings, ZeroSettings):
        return np.zeros(len(model.parameters))
    if isinstance(settings, CoefficientSettings):
        return _parameters_of_values(settings.values, model)
    if isinstance(settings, RandomSettings):
        return _random(settings, model)
    raise TypeError(f"no true machine is made from {type(settings).__name__}")


def _parameters_of_values(values: dict[str, str], model: ErrorModel) -> Array:
    rows_of_a = {
        p.name: (p.unit, np.eye(len(model.parameters))[i]) for i, p in enumerate(model.parameters)
    }
    reported = model.reported()
    rows = reported.known_names()
    quoted = {name: (reported.units[row], reported.matrix[row]) for name, row in rows.items()}
    problems = []
    targets = {}
    for name, text in values.items():
        entry = rows_of_a.get(name) or quoted.get(name)
        if entry is None:
            problems.append(
                (
                    name,
                    f'the error model has no parameter "{name}";'
                    f" {hint(name, [*rows_of_a, *quoted])}",
                )
            )
            continue
        try:
            targets[name] = PARSERS[entry[0]](text)
        except QuantityError as error:
            problems.append((name, str(error)))
    if problems:
        raise TruthError(problems)
    given_own = {name: value for name, value in targets.items() if name in rows_of_a}
    given_quoted: dict[int, tuple[str, float]] = {}
    for name, value in targets.items():
        if name in rows_of_a:
            continue
        if rows[name] in given_quoted:
            text = (
                f'is the coefficient "{given_quoted[rows[name]][0]}" by another name; remove one of'
                " the two"
            )
            raise TruthError([(name, text)])
        given_quoted[rows[name]] = name, value
    a = np.zeros(len(model.parameters))
    for name, value in given_own.items():
        a += value * rows_of_a[name][1]
    if given_quoted:
        targets_quoted = np.zeros(len(reported.names))
        targets_quoted[list(given_quoted)] = [value for _, value in given_quoted.values()]
        # A function that is zero at both ends has one quoted coefficient more than parameters.
        # Values that break this condition leave a residual.
        solution = lstsq(reported.matrix, targets_quoted, rcond=None)[0]
        residual = reported.matrix @ solution - targets_quoted
        for row, (name, value) in given_quoted.items():
            if abs(residual[row]) > 1e-9 * max(abs(value), np.abs(targets_quoted).max()):
                problems.append((name, _constraint_text(name.split()[0], rows_of_a)))
        if problems:
            raise TruthError(problems)
        a += solution
    return a


def _constraint_text(function: str, parameters: Collection[str]) -> str:
    """Return the reason and the remedy if coefficients of a function must add up to zero."""
    text, error = f"{function} must be zero at both ends of its axis", AXIS_ERRORS.get(function)
    for name, square in SQUARENESS_ERRORS.items():
        if name in parameters and error == AxisError(square.axis, square.to, False):
            return f"{text}; let its coefficients add up to zero, and state its slope as {name}"
    return f"{text} to fix the machine's frame; let its coefficients add up to zero"


def _random(settings: RandomSettings, model: ErrorModel) -> Array:
    """Return random parameters: each error function is scaled to the stated root mean square.

    The mean is over the function's axis or, if it has several variables, its lines.
    """
    sizes = {
        "m": settings.position or 0.0,
        "rad": settings.rotation or 0.0,
        "1": settings.rotation or 0.0,
    }
    generator = np.random.default_rng(np.random.SeedSequence(settings.seed))
    drawn = generator.standard_normal(len(model.parameters))
    if not isinstance(model, HasLines):
        return drawn * [sizes[p.unit] for p in model.parameters]
    # Gauss's rule integrates squared polynomials exactly.
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t = 0.5 * (nodes + 1.0)
    for name in dict.fromkeys(p.function for p in model.parameters):
        columns = [k for k, p in enumerate(model.parameters) if p.function == name]
        lines = model.lines(name, t)
        squares = [0.5 * weights @ (line.basis @ drawn[columns]) ** 2 for line in lines]
        rms = float(np.sqrt(np.mean(squares)))
        drawn[columns] *= sizes[model.parameters[columns[0]].unit] / rms if rms else 0.0
    return drawn
