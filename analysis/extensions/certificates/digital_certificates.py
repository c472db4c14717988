"""Lengths in a Digital Calibration Certificate (DCC): values, uncertainties and covariances.

The schema is that of the Physikalisch-Technische Bundesanstalt, versions 2 and 3, with quantities
in the D-SI format, 1.x and 2.x: `si:real`, `si:realList` and `si:realListXMLList`, uncertainties in
the earlier elements (`si:expandedUnc`) and in the later ones
(`si:measurementUncertaintyUnivariate`), covariance matrices of ellipsoidal and rectangular regions.
An element with the ending XMLList holds what the element without it holds, several times.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ballplate.extensions.laboratory.xmltree import Element, read_xml
from ballplate.simulator.inputs import (
    MOST_NAMES,
    ExperimentError,
    Mark,
    NamedMatrix,
    QuantityError,
    half_digit,
    matrix_problems,
    metres_or_radians,
    shorten,
)
from ballplate.simulator.machines import Array

from .dsi_units import celsius, length_factor

ROOT = "digitalCalibrationCertificate"
VERSIONS = ("2", "3")

LIST = "XMLList"
REALS = ("real", "realList", f"realList{LIST}")
EXPANDED = ("uncertainty", "valueExpandedMU")
STANDARD = ("standardUnc", "valueStandardMU")
# Those of one value, and of all of a list; one is misspelt in the schema of D-SI 2.2.
UNCERTAINTIES = (
    "expandedUnc",
    "coverageInterval",
    "measurementUncertaintyUnivariate",
    "measurementUncertaintyUnivaraite",
    "listUnivariateUnc",
    "listMeasurementUncertaintyUnivariate",
)
REGIONS = ("ellipsoidalRegion", "rectangularRegion", "measurementUncertaintyMultivariate")


NO_LENGTH = "is no length"


@dataclass(frozen=True)
class DigitalValue:
    """A length: what it may be called, by itself and by what it stands in (reference types too),
    its value and standard uncertainty (NaN without one) in metres, and faults of it, empty if
    nothing is.

    `factor` is the coverage factor that its uncertainty was divided by, 1 for a standard one.
    """

    mark: Mark
    names: tuple[str, ...]
    contexts: tuple[str, ...]
    value: float
    uncertainty: float
    factor: float
    problem: str = ""

    @property
    def is_length(self) -> bool:
        """True if its unit is one of length."""
        return not self.problem.startswith(NO_LENGTH)


@dataclass(frozen=True, eq=False)
class DigitalResult:
    """A result of a certificate, with its values, of which some may be no `lengths`; `matrices` are
    covariances of some of them, by their places.
    """

    mark: Mark
    names: tuple[str, ...]
    identifier: str
    reference_type: str
    lengths: tuple[DigitalValue, ...]
    matrices: tuple[tuple[tuple[int, ...], NamedMatrix], ...]
    temperatures: tuple[tuple[str, float], ...]

    @property
    def label(self) -> str:
        """How the certificate calls it."""
        name = f'"{shorten(self.names[0])}"' if self.names else "without a name"
        more = [
            f"{word} {shorten(text)}"
            for word, text in (("id", self.identifier), ("refType", self.reference_type))
            if text
        ]
        return f"{name} ({', '.join(more)})" if more else name

    def is_called(self, name: str) -> bool:
        """True if a name, an identifier or one of the reference types is this result's."""
        return name in (*self.names, self.identifier, *self.reference_type.split())


def read_digital_certificate(path: Path) -> tuple[str, tuple[DigitalResult, ...]]:
    """The version of a certificate's schema, and its results.

    :raises ExperimentError: the file cannot be read, is no certificate, or of another version.
    """
    root = read_xml(path)
    if root.name != ROOT:
        text = (
            f"is no Digital Calibration Certificate: its first element is <{shorten(root.name)}>,"
            f" not <{ROOT}>"
        )
        raise root.mark.refused(text)
    version = root.attributes.get("schemaVersion", "")
    if version.partition(".")[0] not in VERSIONS:
        problem = (
            f'schemaVersion is "{shorten(version)}"' if version else "there is no schemaVersion"
        )
        raise root.mark.refused(f"{problem}; versions 2.x and 3.x are read")
    results = []
    for measurement in root.walk():
        if measurement.name == "measurementResult":
            temperatures = tuple(_temperatures(measurement))
            for result in measurement.all("results", "result"):
                results.append(_result(result, temperatures))
    if not results:
        raise root.mark.refused("has no result")
    return version, tuple(results)


def _names(element: Element) -> tuple[str, ...]:
    """What an element is called in all languages, its label, and its identifier."""
    texts = [label_text.text for label_text in element.all("name", "content")]
    texts += [label_text.text for label_text in element.all("label")]
    texts.append(element.attributes.get("id", ""))
    return tuple(dict.fromkeys(text for text in texts if text))


def _temperatures(measurement: Element) -> Iterator[tuple[str, float]]:
    for condition in measurement.walk():
        if condition.name != "influenceCondition":
            continue
        name = next(iter(_names(condition)), condition.attributes.get("refType", "condition"))
        for element in condition.walk():
            if element.name == "real":
                value = celsius(_plain(element.text_at("value")), element.text_at("unit"))
                if value is not None and math.isfinite(value):
                    yield name, value


def _result(element: Element, temperatures: tuple[tuple[str, float], ...]) -> DigitalResult:
    lengths: list[DigitalValue] = []
    matrices = []
    data = element.first("data")
    for part in _parts(data, ()) if data is not None else ():
        block = part.block
        values = list(_values(block, part.contexts, part.labels))
        start = len(lengths)
        lengths += values
        matrix = _matrix(block, len(values)) if _is_length(block) else None
        if matrix is not None:
            matrices.append((tuple(range(start, start + len(values))), matrix))
    return DigitalResult(
        element.mark,
        tuple(item.text for item in element.all("name", "content") if item.text),
        element.attributes.get("id", ""),
        element.attributes.get("refType", ""),
        tuple(lengths),
        tuple(matrices),
        temperatures,
    )


@dataclass(frozen=True)
class _Part:
    """A value or a list of values, with what those above it are called, and lists of texts that
    stand beside it, which may be labels.
    """

    block: Element
    contexts: tuple[str, ...]
    labels: tuple[tuple[str, ...], ...] = ()


def _parts(
    element: Element, contexts: tuple[str, ...], labels: tuple[tuple[str, ...], ...] = ()
) -> Iterator[_Part]:
    """Values and lists of values below an element."""
    for child in element.children:
        if child.name in REALS:
            yield _Part(child, contexts, labels)
        elif child.name in ("quantity", "list", "hybrid"):
            beside = labels
            if child.name == "list":
                texts = [
                    inner_part.text.split() for inner_part in child.all("quantity", "charsXMLList")
                ]
                beside = (*labels, *map(tuple, texts))
            types = child.attributes.get("refType", "").split()
            inner = list(_parts(child, (*contexts, *_names(child), *types), beside))
            # All parts of a hybrid are one quantity in several units.
            in_metres = [inner_part for inner_part in inner if _is_length(inner_part.block)]
            yield from (in_metres or inner)[:1] if child.name == "hybrid" else inner


def _units(block: Element) -> list[str]:
    if block.name == "realList":
        common = block.text_at("listUnit")
        return [unit_element.text_at("unit") or common for unit_element in block.all("real")]
    name = f"unit{LIST}" if block.name.endswith(LIST) else "unit"
    texts = block.text_at(name)
    return texts.split() if block.name.endswith(LIST) else [texts]


def _is_length(block: Element) -> bool:
    try:
        return bool([length_factor(unit) for unit in _units(block)])
    except QuantityError:
        return False


def _values(
    block: Element, contexts: tuple[str, ...], beside: tuple[tuple[str, ...], ...] = ()
) -> Iterator[DigitalValue]:
    """The values of a real, or of a list, which has labels of its own or `beside` it."""
    if block.name == "real":
        uncertainty = _uncertainty(block)
        yield _value(
            block.mark,
            _names(block),
            contexts,
            block.text_at("value"),
            _units(block)[0],
            uncertainty,
        )
        return
    if block.name == "realList":
        common = _uncertainty(block)
        inside = (*contexts, *_names(block))
        for real, unit in zip(block.all("real"), _units(block), strict=True):
            uncertainty = _uncertainty(real) or common
            yield _value(real.mark, _names(real), inside, real.text_at("value"), unit, uncertainty)
        return
    values = block.text_at(f"value{LIST}").split()
    labels = block.text_at(f"label{LIST}").split()
    units = _units(block)
    uncertainty = _uncertainty(block)
    for k, value in enumerate(values[: MOST_NAMES + 1]):
        labels_of_value: tuple[str, ...] = (labels[k],) if len(labels) == len(values) else ()
        if not labels:
            texts = [neighbour[k] for neighbour in beside if len(neighbour) == len(values)]
            labels_of_value = tuple(dict.fromkeys((" ".join(texts), *texts))) if texts else ()
        own_unit = _one_of(units, k, len(values))
        if own_unit is None:
            yield DigitalValue(
                block.mark,
                labels_of_value,
                contexts,
                math.nan,
                math.nan,
                1.0,
                f"{len(units)} units of {len(values)} values; give one, or one for each",
            )
            continue
        mine = None
        if uncertainty is not None:
            amounts = _one_of(uncertainty.amounts, k, len(values))
            factors = _one_of(uncertainty.factors, k, len(values)) if uncertainty.factors else ""
            mine = _Uncertainty(
                uncertainty.mark,
                uncertainty.is_expanded,
                [amounts or ""],
                [factors] if factors else [],
            )
        yield _value(block.mark, labels_of_value, contexts, value, own_unit, mine)


def _one_of(texts: list[str], k: int, count: int) -> str | None:
    """The k-th of as many texts as there are values, or the one of all."""
    if len(texts) == 1:
        return texts[0]
    return texts[k] if len(texts) == count else None


@dataclass(frozen=True)
class _Uncertainty:
    """Uncertainties as written, with their coverage factors where they are expanded."""

    mark: Mark
    is_expanded: bool
    amounts: list[str]
    factors: list[str]


def _uncertainty(block: Element) -> _Uncertainty | None:
    for child in block.children:
        if child.name.removesuffix(LIST) not in UNCERTAINTIES:
            continue
        inner = {element.name.removesuffix(LIST): element for element in child.walk()}
        factors = inner["coverageFactor"].text.split() if "coverageFactor" in inner else []
        for names, is_expanded in ((EXPANDED, True), (STANDARD, False)):
            for name in names:
                if name in inner:
                    return _Uncertainty(child.mark, is_expanded, inner[name].text.split(), factors)
        return _Uncertainty(child.mark, True, [""], factors)
    return None


def _value(
    mark: Mark,
    names: tuple[str, ...],
    contexts: tuple[str, ...],
    value: str,
    unit: str,
    uncertainty: _Uncertainty | None,
) -> DigitalValue:
    nothing = DigitalValue(mark, names, contexts, math.nan, math.nan, 1.0, NO_LENGTH)
    try:
        factor = length_factor(unit)
    except QuantityError as error:
        if not unit:
            return nothing
        return DigitalValue(mark, names, contexts, math.nan, math.nan, 1.0, f"{NO_LENGTH}: {error}")
    try:
        length = metres_or_radians(value, factor)
        if uncertainty is None:
            return DigitalValue(mark, names, contexts, length, math.nan, 1.0)
        amount = metres_or_radians(uncertainty.amounts[0] if uncertainty.amounts else "", factor)
    except QuantityError as error:
        return DigitalValue(mark, names, contexts, math.nan, math.nan, 1.0, str(error))
    k, problem = 1.0, ""
    if uncertainty.is_expanded:
        k = _plain(uncertainty.factors[0]) if uncertainty.factors else math.nan
        if not uncertainty.factors:
            problem = "has an expanded uncertainty without a coverage factor"
        elif not 0.0 < k < math.inf:
            problem = (
                f'has the coverage factor "{shorten(uncertainty.factors[0])}"; it must be above 0'
            )
    if amount < 0.0:
        problem = "has an uncertainty below zero"
    u = math.nan if problem else amount / k
    return DigitalValue(mark, names, contexts, length, u, k, problem)


def _matrix(block: Element, count: int) -> NamedMatrix | None:
    """The covariance matrix of the values of a list, in square metres.

    :raises ExperimentError: it is of another size, has other units, or is no covariance.
    """
    region = next(
        (child for child in block.children if child.name.removesuffix(LIST) in REGIONS), None
    )
    if region is None:
        return None
    if count > MOST_NAMES:
        text = f"a covariance of {count} values; at most {MOST_NAMES} are possible"
        raise region.mark.refused(text)
    columns = [child for child in region.walk() if child.name.removesuffix(LIST) == "column"]
    values, rounding = np.zeros((count, count)), np.zeros((count, count))
    marks = []
    for k, column in enumerate(columns):
        marks.append(column.mark)
        numbers, units = list[str](), list[str]()
        for entry in column.children:
            for cell in entry.children:
                texts = cell.text.split()
                (numbers if cell.name.startswith("value") else units).extend(texts)
        if len(columns) != count or len(numbers) != count:
            text = (
                f"a covariance of {len(columns)} columns, this one of {len(numbers)} entries, for"
                f" {count} values; it must be square"
            )
            raise column.mark.refused(text)
        for j, number in enumerate(numbers):
            try:
                factor = float(length_factor(_one_of(units, j, count) or "", 2))
            except QuantityError as error:
                raise column.mark.refused(f"covariance: {error}") from None
            values[j, k], rounding[j, k] = _plain(number) * factor, half_digit(number) * factor
            if not math.isfinite(values[j, k]):
                text = f'covariance: "{shorten(number)}" is not a number'
                raise column.mark.refused(text)
    names = tuple(f"value {k + 1}" for k in range(count))
    matrix = NamedMatrix(names, values, rounding, False, tuple(marks))
    wrong = matrix_problems(matrix)
    if wrong:
        raise ExperimentError(wrong)
    return matrix


def _plain(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def matrix_of(result: DigitalResult, chosen: list[int]) -> tuple[Array, Array] | None:
    """Covariance and its rounding (m, m) of chosen lengths of a result; None where it states none
    of two of them together.

    Lengths of different lists are uncorrelated.
    """
    if not any(len(set(rows) & set(chosen)) > 0 for rows, _ in result.matrices):
        return None
    size = len(chosen)
    covariance, rounding = np.zeros((size, size)), np.zeros((size, size))
    for k, place in enumerate(chosen):
        covariance[k, k] = result.lengths[place].uncertainty ** 2
    for rows, matrix in result.matrices:
        mine = [k for k, place in enumerate(chosen) if place in rows]
        inside = [rows.index(chosen[k]) for k in mine]
        covariance[np.ix_(mine, mine)] = matrix.values[np.ix_(inside, inside)]
        rounding[np.ix_(mine, mine)] = matrix.rounding[np.ix_(inside, inside)]
    return covariance, rounding
