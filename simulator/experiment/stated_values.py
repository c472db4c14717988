"""Values of a calibration item that a file states, with their uncertainties and covariance.

The file is a table (CSV), to which another may give the covariance, or a Digital Calibration
Certificate (XML).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from ballplate.simulator.design.observations.joint_values import MOST_JOINT_VALUES
from ballplate.simulator.design.observations.whitening import (
    CovarianceRoot,
    IndefiniteError,
    covariance_root,
)
from ballplate.simulator.geometry.ball_layouts import frozen
from ballplate.simulator.inputs.extensions import optional_service
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantity_types import CommonPart
from ballplate.simulator.inputs.settings import Settings, Text, hint, listing, shorten
from ballplate.simulator.inputs.yamltree import Mark
from pydantic import Field

from .references import References

# An uncertainty and the variance beside it agree to their last digits, this being a generous share.
AGREE = 0.02

# Keys of an item that state how its values are correlated.
JOINT_KEYS = ("covariance", "common", "correlation")
OWN_COVARIANCE = "is for values that are no DCC, which has its own covariance"


class CertificateSettings(Settings):
    """Keys of a calibration item whose values may be in a file."""

    covariance: Text | None = Field(
        None,
        description=(
            "CSV file with the covariance matrix of the values: first cell covariance_um2 (or"
            " another unit), or correlation, then the names of values, as row and as column"
        ),
    )
    result: Text | None = Field(
        None, description="name, id or refType of the result of a DCC (XML) that is meant"
    )
    quantity: Text | None = Field(
        None,
        description=(
            "name, id or refType of the quantity of a DCC (XML) that is meant, such as"
            " basic_referenceValue; default: measured values, or nominal ones plus errors"
        ),
    )
    coverage_factor: float | None = Field(
        None, gt=0, description="k of the expanded uncertainties of a CSV file without a column k"
    )


class CommonPartSettings(CertificateSettings):
    """Keys of an item of lengths, whose uncertainties may have a part in common."""

    common: CommonPart | None = Field(
        None,
        description=(
            "standard uncertainty that all values have in common, beside that of each, such as"
            " 0.5 um/m of one wavelength and one temperature; of co-ordinates, the constant part is"
            " the same in all, the other proportional to each, with its sign"
        ),
    )
    correlation: Annotated[float, Field(ge=0, lt=1)] | None = Field(
        None, description="correlation of every two values' errors, in place of common"
    )


@dataclass(frozen=True)
class CertificateEntry:
    """A value of a file: two names, value and standard uncertainty (NaN without one) in metres,
    and its location in the file.
    """

    names: tuple[str, str]
    value: float
    uncertainty: float
    mark: Mark
    steps: Steps


@dataclass(frozen=True)
class FileValues:
    """Content of a file: its entries, and of a digital certificate a covariance (m, m) with its
    rounding of the requested values.
    """

    entries: list[CertificateEntry]
    covariance: tuple[Array, Array] | None = None


def is_digital(values: object) -> bool:
    """True if the values of an item are in a digital certificate."""
    return isinstance(values, str) and values.lower().endswith(".xml")


def check_keys(settings: Any, steps: Steps, references: References) -> bool:
    """True if the keys about a file are compatible; others are reported."""
    is_right = True
    of_file = isinstance(settings.values, str)
    digital = is_digital(settings.values)
    for key, fits, instead in (
        ("result", digital, "applies only to values in a DCC (XML)"),
        ("quantity", digital, "applies only to values in a DCC (XML)"),
        ("coverage_factor", of_file and not digital, "applies only to values in a CSV file"),
        *((key, not digital, OWN_COVARIANCE) for key in JOINT_KEYS),
    ):
        if getattr(settings, key, None) is not None and not fits:
            references.problems.add((*steps, key), f"{instead}; remove it", of_key=True)
            is_right = False
    joint = _joint_keys(settings)
    for key in joint[1:]:
        text = f"{joint[0]} states how values are correlated already; remove one of the two"
        references.problems.add((*steps, key), text, of_key=True)
        is_right = False
    return is_right


def _joint_keys(settings: Any) -> list[str]:
    """Return the keys of an item that state how its values are correlated."""
    return [key for key in JOINT_KEYS if getattr(settings, key, None) is not None]


def joint_key(settings: Any) -> str:
    """Return the key of an item that states how its values are correlated, or "values"."""
    return next(iter(_joint_keys(settings)), "values")


def value_name(names: tuple[str, str], is_pair: bool) -> str:
    """Return the name of a value in messages."""
    return "–".join(names) if is_pair else f"{names[1]} of {names[0]}"


def uncertainties_of(
    settings: Any,
    names: Sequence[tuple[str, str]],
    is_pair: bool,
    stated_uncertainty: Array | None,
    uncertainties_read: Array,
    covariance: tuple[Array, Array] | None,
    lengths: Array,
    steps: Steps,
    references: References,
) -> tuple[Array, CovarianceRoot | None] | None:
    """Return standard uncertainties (m,) of values with `names`, in metres: those stated (m,) with
    the item, or those read (m,) from its file, or those of a covariance, and the root of this if
    they are correlated; or report faults.

    A part that they have in common is that at the nominal `lengths` (m,), with signs for
    co-ordinates.
    """
    problems, path = references.problems, (*steps, "standard_uncertainty")
    without = np.flatnonzero(np.isnan(uncertainties_read))
    if covariance is None and 0 < len(without) < len(names):
        names_listed = listing(value_name(names[k], is_pair) for k in without.tolist())
        text = f"states no uncertainty of {names_listed}, and of others it does; leave these out"
        problems.add((*steps, "values"), text)
        return None
    of_values = stated_uncertainty
    if not len(without):
        of_values = uncertainties_read
    matrix, where = covariance, settings.values
    if settings.covariance is not None:
        matrix_read = _of_file(settings, names, is_pair, steps, references)
        if matrix_read is None:
            return None
        is_correlation, values, rounding = matrix_read
        if not is_correlation:
            matrix = covariance = values, rounding
            where = settings.covariance
        elif of_values is None:
            text = 'missing; a correlation needs "standard_uncertainty", or uncertainties in values'
            problems.add(path, text)
            return None
        else:
            scale = np.outer(of_values, of_values)
            # A value's correlation with itself is 1, to whatever digits.
            np.fill_diagonal(rounding, 0.0)
            matrix = values * scale, rounding * scale
    is_stated_there = covariance is not None or not len(without)
    if stated_uncertainty is not None and is_stated_there:
        problems.add(path, f"{where} states uncertainties; remove one of the two", of_key=True)
        return None
    if matrix is None and of_values is None:
        text = 'missing; add "standard_uncertainty", or values with their uncertainties'
        problems.add(path, text)
        return None
    place = (*steps, joint_key(settings))
    if matrix is None and of_values is not None:
        common = _common(settings, of_values, lengths)
        if common is None:
            return frozen(of_values), None
        matrix = common, np.zeros_like(common)
    assert matrix is not None
    size = np.sqrt(np.diag(matrix[0]))
    # A certificate may give expanded uncertainties beside a covariance. Where both are stated they
    # must agree, or the factor would pass unseen.
    has_both = covariance is not None and not len(without)
    if has_both and (text := _disagreement(names, is_pair, size, uncertainties_read)):
        problems.add(place, text)
        return None
    if len(size) > MOST_JOINT_VALUES:
        problems.add(
            place, f"{len(size)} correlated values; at most {MOST_JOINT_VALUES} are possible"
        )
        return None
    root = _root_of(matrix, place, problems)
    return None if root is None else (frozen(size), root)


def _disagreement(
    names: Sequence[tuple[str, str]], is_pair: bool, size: Array, uncertainties_read: Array
) -> str:
    """Return the fault of uncertainties (m,) in a covariance that differ from those beside it;
    possibly empty.
    """
    apart = np.abs(size - uncertainties_read)
    wrong = np.flatnonzero(apart > AGREE * np.maximum(size, uncertainties_read) + 1e-12)
    if not len(wrong):
        return ""
    k = int(wrong[0])
    return (
        f"the covariance has the standard uncertainty {1e6 * size[k]:.4g} µm for"
        f" {value_name(names[k], is_pair)}, beside it stands {1e6 * uncertainties_read[k]:.4g} µm;"
        " is one of the two expanded? State standard uncertainties and their covariance"
    )


def _root_of(matrix: tuple[Array, ...], place: Steps, problems: Problems) -> CovarianceRoot | None:
    """Return the root of a covariance with its rounding, or report that there is none."""
    try:
        root = covariance_root(matrix[0], matrix[1])
    except IndefiniteError as error:
        text = f"is no covariance: its correlations have {error}; correct it, or give more digits"
        problems.add(place, text)
        return None
    if root.doubt:
        problems.doubt(place, root.doubt)
    return root


def _common(settings: Any, of_values: Array, lengths: Array) -> Array | None:
    """Return the covariance (m, m) of values that have a part of their errors in common, or None
    if an item states none.
    """
    if not isinstance(settings, CommonPartSettings):
        return None
    if settings.correlation is not None:
        own, common = (1.0 - settings.correlation) * of_values**2, of_values
        return np.asarray(np.diag(own) + settings.correlation * np.outer(common, common))
    if settings.common is None:
        return None
    # One cause: of co-ordinates, it shifts all alike and stretches them about the origin.
    common = settings.common.at(lengths)
    return np.asarray(np.diag(of_values**2) + np.outer(common, common))


def _of_file(
    settings: Any,
    names: Sequence[tuple[str, str]],
    is_pair: bool,
    steps: Steps,
    references: References,
) -> tuple[bool, Array, Array] | None:
    """Return whether a CSV file has correlations, and its matrix (m, m) of the values with its
    rounding; or report faults.
    """
    from ballplate.simulator.inputs.covariances import read_matrix

    problems, place = references.problems, (*steps, "covariance")
    try:
        matrix = read_matrix(references.file(settings.covariance))
    except ExperimentError as error:
        problems.take(error, place)
        return None
    index = {}
    for k, (first, second) in enumerate(names):
        # Two balls may be named in either order.
        index[f"{first} {second}"] = k
        index[f"{second} {first}"] = k
    entry_of_name = np.full(len(names), -1)
    messages = []
    for i, name in enumerate(matrix.names):
        value = index.get(" ".join(name.split()))
        if value is None:
            text = f'"{shorten(name)}" names no value of this item; {hint(name, index)}'
            messages.append(matrix.marks[i].message("", text))
        elif entry_of_name[value] >= 0:
            messages.append(matrix.marks[i].message("", f'"{shorten(name)}" stands there twice'))
        else:
            entry_of_name[value] = i
    missing = [value_name(names[k], is_pair) for k in np.flatnonzero(entry_of_name < 0).tolist()]
    if missing and not messages:
        problems.add(place, f"no covariance of {listing(missing)}; add it")
        return None
    if messages:
        problems.take(ExperimentError(messages), place)
        return None
    chosen = np.ix_(entry_of_name, entry_of_name)
    return matrix.is_correlation, matrix.values[chosen], matrix.rounding[chosen]


def read_digital(
    settings: Any,
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
    steps: Steps,
    references: References,
) -> FileValues | None:
    """Return the requested values of a digital calibration certificate, read by an extension, or
    report faults.
    """
    reader = optional_service("read_digital")
    if reader is None:
        text = "digital certificates need the extension certificates, which is not installed"
        references.problems.add((*steps, "values"), text)
        return None
    file_values: FileValues | None = reader(settings, wanted, is_pair, steps, references)
    return file_values
