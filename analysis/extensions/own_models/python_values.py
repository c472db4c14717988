"""Certified values that are functions of a user's own, in Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from ballplate.simulator.design import (
    MOST_TIED_BALLS,
    BallFunctions,
    BallObservations,
    Calibration,
    CovarianceRoot,
    Design,
    at_least_exact,
    covariance_root,
)
from ballplate.simulator.experiment import (
    CalibratedBalls,
    CertificateSettings,
    References,
    check_keys,
    is_digital,
    read_digital,
    read_rows,
    uncertainties_of,
)
from ballplate.simulator.geometry import BallLayout, Name, frozen
from ballplate.simulator.inputs import (
    PARSERS,
    Forms,
    NonEmpty,
    QuantityError,
    Steps,
    Text,
    Trust,
    listing,
    own_array,
    with_quantities,
)
from ballplate.simulator.machines import Array, CustomModelError, Integers, Unit
from pydantic import Field

from .custom import attempt, named_object

GROUP = "ballplate.calibrations"


@dataclass(frozen=True)
class PythonValues(BallObservations):
    """Values (m,) of `functions` of the balls `ball` (k,)."""

    word: ClassVar[str] = "certified function"

    functions: BallFunctions
    ball: Integers
    value: Array
    uncertainty: Array

    @property
    def measured_in(self) -> Unit:  # type: ignore[override]
        """The unit of all values."""
        return self.functions.unit

    @property
    def balls(self) -> Integers:
        return np.tile(self.ball, (len(self), 1))

    def values(self, balls: Array) -> tuple[Array, Array]:
        mine = balls[..., self.ball, :]
        flat = mine.reshape(-1, *mine.shape[-2:])
        value = np.array([self.functions.values(value) for value in flat], float)
        slope = np.array([self.functions.derivatives(value) for value in flat], float)
        lead = mine.shape[:-2]
        return value.reshape(*lead, -1), slope.reshape(*lead, *slope.shape[1:])

    def name(self, design: Design, k: int) -> str:
        first, second = self.functions.names[k]
        return f"{second} of {first}"


@dataclass(frozen=True, eq=False)
class PythonCalibration(Calibration):
    """Values (m,) of functions of the balls (k,) of an artefact, in the functions' unit.

    `functions` are made by the `object` of a module in the folder `source` with `options`.
    """

    artefact: str
    object: str
    options: Mapping[str, Any]
    source: Path
    functions: BallFunctions
    balls: Integers
    values: Array
    certified: bool
    standard_uncertainties: Array
    root: CovarianceRoot
    kind: Literal["python"] = "python"

    def observed(self, first: int) -> PythonValues:
        return PythonValues(
            self.functions,
            first + self.balls,
            self.values,
            at_least_exact(self.standard_uncertainties),
        )

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        return list(self.functions.names)


class PythonValuesSettings(CertificateSettings):
    """Certified values of functions of the balls that a Python function makes; it is called with
    the names and the co-ordinates of the balls, and with the options.
    """

    kind: Literal["python"] = Field(description="values of functions of the user's own")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    object: Text = Field(
        description=(
            "module:function, the module installed or next to this file, or the name of an"
            f" installed entry point of the group {GROUP}"
        )
    )
    options: dict[str, Any] = Field(
        default={}, description="Keyword arguments of the function; quantities arrive in SI units."
    )
    folder: str | None = Field(
        None, description="Folder of the module, as it is found from this file; default: its own."
    )
    balls: CalibratedBalls = Field("all", description="all (default), corners, or a list of balls")
    standard_uncertainty: Forms[Text, NonEmpty[Text], NonEmpty[Text]] | None = Field(
        None, description="of every value, or a list of one for each; 0 if they are exact"
    )
    values: Forms[Text, NonEmpty[Text], NonEmpty[Text]] | None = Field(
        None,
        description=(
            "list of values with their unit, or of lengths a CSV file with columns first, second,"
            " value_mm or a DCC (XML); default: nominal values"
        ),
    )


SETTINGS = PythonValuesSettings


def read(
    settings: PythonValuesSettings, artefact: str, steps: Steps, references: References
) -> PythonCalibration | None:
    layout, dimension = references.layouts[artefact], references.dimension
    balls = references.balls(settings.balls, layout, (*steps, "balls"))
    if balls is None or not check_keys(settings, steps, references) or dimension is None:
        return None
    text = f"ties {len(balls)} balls together, at most {MOST_TIED_BALLS} are possible; name fewer"
    if not references.require(len(balls) <= MOST_TIED_BALLS, (*steps, "balls"), text):
        return None
    names = tuple(layout.names[ball] for ball in balls)
    drawn = layout.coordinates[balls][:, :dimension]
    folder = references.folder / (settings.folder or ".")
    try:
        functions = ball_functions(
            settings.object, settings.options, folder, references.trust, names, drawn
        )
    except CustomModelError as error:
        references.problems.add((*steps, error.key), str(error))
        return None
    stated_values = _values(settings, functions, drawn, steps, references)
    if stated_values is None:
        return None
    values, in_file, covariance = stated_values
    stated_uncertainty = _stated(settings, functions, steps, references)
    if stated_uncertainty is not None and np.isnan(stated_uncertainty).any():
        return None
    uncertainties = uncertainties_of(
        settings,
        functions.names,
        False,
        stated_uncertainty,
        in_file,
        covariance,
        values,
        steps,
        references,
    )
    if uncertainties is None:
        return None
    standard, root = uncertainties
    return PythonCalibration(
        artefact,
        settings.object,
        settings.options,
        folder,
        functions,
        np.asarray(balls, np.int64),
        frozen(values),
        settings.values is not None,
        standard,
        root or covariance_root(np.diag(standard**2)),
    )


def ball_functions(
    name: str,
    options: dict[str, Any],
    folder: Path | None,
    trust: Trust,
    names: tuple[str, ...],
    drawn: Array,
) -> BallFunctions:
    """Return the functions that the object `name` makes for balls of `names`, nominally at (n, d).

    :raises CustomModelError: there is no such object, or its result is unusable.
    """
    build = named_object(name, folder, trust, GROUP)
    key = "options" if options else "object"
    functions = attempt(
        f"{name} has failed", lambda: build(names, drawn.copy(), **with_quantities(options)), key
    )
    return attempt(f"what {name} returns has failed", lambda: _checked(name, functions, drawn))


@dataclass(frozen=True)
class GuardedFunctions:
    """A user's `functions` of balls, whose every answer is checked."""

    functions: BallFunctions
    names: tuple[tuple[str, str], ...]
    unit: Unit

    def values(self, balls: Array) -> Array:
        return own_array(self.functions.values, (len(self.names),), balls.copy())

    def derivatives(self, balls: Array) -> Array:
        return own_array(self.functions.derivatives, (len(self.names), *balls.shape), balls.copy())


def _values(
    settings: PythonValuesSettings,
    functions: BallFunctions,
    drawn: Array,
    steps: Steps,
    references: References,
) -> tuple[Array, Array, tuple[Array, Array] | None] | None:
    """Values (m,), standard uncertainties (m,) in their file, NaN without any, and covariance."""
    problems, place, count = references.problems, (*steps, "values"), len(functions.names)
    none = np.full(count, np.nan)
    if settings.values is None:
        return np.asarray(functions.values(drawn), float), none, None
    if not isinstance(settings.values, str):
        text = f"has {len(settings.values)} values; the functions have {count}"
        if not references.require(len(settings.values) == count, place, text):
            return None
        parsed = _parsed(settings.values, functions.unit, place, references)
        return None if np.isnan(parsed).any() else (parsed, none, None)
    text = f"a file holds lengths, and these are in {functions.unit}; write a list of values"
    if not references.require(functions.unit == "m", place, text):
        return None
    if is_digital(settings.values):
        digital = read_digital(settings, functions.names, False, steps, references)
        if digital is None:
            return None
        values, in_file = (
            np.array([getattr(entry, column) for entry in digital.entries])
            for column in ("value", "uncertainty")
        )
        return values, in_file, digital.covariance
    rows_read = read_rows(settings, ["first", "second"], ["value"], [], place, references)
    if rows_read is None:
        return None
    index_by_names = {names: k for k, names in enumerate(functions.names)}
    values, in_file, before = none.copy(), none.copy(), len(problems.messages)
    for row, uncertainty in zip(*rows_read, strict=True):
        k = index_by_names.get((row.texts[0], row.texts[1]))
        if k is None:
            names_listed = listing(", ".join(name) for name in functions.names)
            text = f'no value "{", ".join(row.texts[:2])}"; known: {names_listed}'
            problems.add_at(row.mark, place, text)
            continue
        if not np.isnan(values[k]):
            problems.add_at(row.mark, place, "is given twice; remove one of the two")
        values[k], in_file[k] = row.lengths[0], uncertainty[0]
    missing = [", ".join(functions.names[k]) for k in np.flatnonzero(np.isnan(values)).tolist()]
    if missing and len(problems.messages) == before:
        problems.add(place, f"no value of {listing(missing)}; add it")
    return None if len(problems.messages) > before else (values, in_file, None)


def _stated(
    settings: PythonValuesSettings, functions: BallFunctions, steps: Steps, references: References
) -> Array | None:
    """Return standard uncertainties (m,) of the item, NaN for invalid ones, if any are stated."""
    uncertainty, count = settings.standard_uncertainty, len(functions.names)
    if uncertainty is None:
        return None
    place = (*steps, "standard_uncertainty")
    texts = (uncertainty,) * count if isinstance(uncertainty, str) else uncertainty
    text = f"has {len(texts)} entries; the functions have {count} values"
    if not references.require(len(texts) == count, place, text):
        return np.full(count, np.nan)
    uncertainties = _parsed(texts, functions.unit, place, references)
    if not references.require(not (uncertainties < 0.0).any(), place, "is below zero; correct it"):
        return np.full(count, np.nan)
    return uncertainties


def _parsed(texts: tuple[str, ...], unit: Unit, steps: Steps, references: References) -> Array:
    """Return quantities (m,), NaN for invalid ones, after one message."""
    values = np.full(len(texts), np.nan)
    for k, text in enumerate(texts):
        try:
            values[k] = PARSERS[unit](text)
        except QuantityError as error:
            references.problems.add(steps, str(error))
            break
    return values


# In one piece: each check relies on those before it.
def _checked(name: str, functions: Any, drawn: Array) -> BallFunctions:
    """Return functions of balls, guarded, or raise their first fault."""
    members = ("names", "unit", "values", "derivatives")
    missing = [member for member in members if not hasattr(functions, member)]
    if missing:
        text = f"what {name} returns, {type(functions).__name__}, has no {listing(missing)}"
        raise CustomModelError(f"{text}; add them")
    names = attempt(f"{name}: names has failed", lambda: tuple(map(tuple, functions.names)))
    is_named = all(
        len(member) == 2 and all(isinstance(part, str) for part in member) for member in names
    )
    if not names or not is_named or len(set(names)) < len(names):
        text = "names must be pairs of texts, one pair for each value, no two the same"
        raise CustomModelError(f"{name}: {text}")
    if (unit := functions.unit) not in PARSERS:
        raise CustomModelError(f'{name}: the unit is "{unit}"; known: m, rad, 1')
    guarded = GuardedFunctions(functions, names, unit)
    guarded.values(drawn)
    guarded.derivatives(drawn)
    return guarded
