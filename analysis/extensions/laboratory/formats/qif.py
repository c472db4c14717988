"""Results in the Quality Information Framework (QIF 2 and 3, ISO 23952), read by path.

A measured sphere names the item that it measures, and this item has the name; points are listed
below the sphere (QIF 2) or in sets of points to which it refers (QIF 3).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from ballplate.simulator.inputs import QuantityError, exact_number, refused, shorten
from ballplate.simulator.machines import Array

from ..xmltree import Element, parse_xml
from .report import LOCATED, SPHERE, Feature, Format, Report, ReportProblems, System

NAMESPACE = re.compile(r"http://qifstandards\.org/xsd/qif[0-9]*")
MEASURED = ("FeatureMeasurement", "FeatureActual")
BEGINNING = re.compile(r"<(?:\w+:)?QIFDocument\b")


@dataclass(frozen=True)
class _Document:
    """A document with what others refer to, by id."""

    root: Element
    problems: ReportProblems
    by_id: dict[str, Element]
    units: dict[str, Fraction]

    def named(self, element: Element | None) -> Element | None:
        """Return the element with the id that an element refers to, if it exists."""
        return None if element is None else self.by_id.get(element.text)

    def unit(self, element: Element) -> Fraction:
        """Metres per unit of an element's co-ordinates."""
        name = element.attributes.get("linearUnit", "")
        if name not in self.units:
            problem = f'unknown unit "{shorten(name)}"; the file\'s units should define it'
            if not name:
                problem = "the file states no unit of length; state it with --unit mm or --unit in"
            self.problems.add(element.mark, problem)
            self.units[name] = Fraction(1, 1000)
        return self.units[name]

    def numbers(self, element: Element) -> list[float]:
        """Co-ordinates of an element in metres, NaN after a message."""
        factor = self.unit(element)
        return [self.problems.length(text, factor, element.mark) for text in element.text.split()]


def _units(root: Element, problems: ReportProblems, unit: Fraction | None) -> dict[str, Fraction]:
    """Metres per unit of length, by the unit's name; those of the file under no name."""
    units = {} if unit is None else {"": unit}
    for where in ("PrimaryUnits", "OtherUnits"):
        for unit_element in root.all("FileUnits", where, "LinearUnit"):
            factor = unit_element.first("UnitConversion", "Factor")
            try:
                value = Fraction(1) if factor is None else exact_number(factor.text)
            except QuantityError as error:
                problems.add(factor.mark if factor else unit_element.mark, str(error))
                value = Fraction(1)
            if value <= 0:
                problems.add(unit_element.mark, "the unit's factor is not above zero")
            units[unit_element.text_at("UnitName")] = value
            if where == "PrimaryUnits":
                units.setdefault("", value)
    return units


def _features(document: _Document, results: Element) -> Iterator[Feature]:
    for measured in results.all("MeasuredFeatures"):
        lists = [measured, *measured.all("FeatureActuals"), *measured.all("FeatureMeasurements")]
        for child_element in (child for feature_list in lists for child in feature_list.children):
            ending = next((end for end in MEASURED if child_element.name.endswith(end)), None)
            if ending is not None:
                kind = re.sub(
                    r"(?<=[a-z])(?=[A-Z])", " ", child_element.name.removesuffix(ending)
                ).lower()
                yield _feature(document, child_element, kind)


def _feature(document: _Document, element: Element, kind: str) -> Feature:
    item = document.named(element.first("FeatureItemId"))
    name = element.text_at("FeatureName") or (item.text_at("FeatureName") if item else "")
    location, points, lacks = element.first("Location"), None, ""
    centre = None
    if kind in LOCATED and location is not None:
        numbers = document.numbers(location)
        if len(numbers) != 3:
            problem = f"{len(numbers)} co-ordinates instead of 3"
            document.problems.add(location.mark, problem)
        else:
            centre = numbers[0], numbers[1], numbers[2]
    elif kind == SPHERE:
        points = _points(document, element)
        lacks = "neither a location nor points" if points is None else ""
    device = document.named(element.first("MeasurementDeviceIds", "Id"))
    probe = device.text_at("Name") if device else ""
    transform = document.named(element.first("ActualTransformId"))
    frame = document.named(item.first("CoordinateSystemId")) if item else None
    system: System = "unstated" if transform is None and frame is None else "part"
    system_name = transform.text_at("Name") if transform else frame.text_at("Name") if frame else ""
    if not name:
        lacks, centre, points = "no name", None, None
    return Feature(
        element.mark, name or element.name, kind, centre, points, probe, system, system_name, lacks
    )


def _points(document: _Document, element: Element) -> Array | None:
    """Return points (n, 3) of a sphere in metres, if they can be read."""
    point_arrays = []
    for listed in element.all("PointList"):
        for child in listed.children:
            if child.name == "MeasurePoint":
                point_arrays += [_triples(document, point) for point in child.all("Point")]
            elif child.name.endswith("PointSetId"):
                point_arrays.append(_of_set(document, child))
    return np.concatenate(point_arrays) if sum(map(len, point_arrays)) else None


def _triples(document: _Document, element: Element) -> Array:
    numbers = document.numbers(element)
    if len(numbers) % 3:
        problem = f"{len(numbers)} co-ordinates, which is no multiple of 3"
        document.problems.add(element.mark, problem)
        numbers = []
    return np.array(numbers).reshape(-1, 3)


def _of_set(document: _Document, element: Element) -> Array:
    """The points of a set that a reference names: all, those from one to another, or a single
    one, counted from 1.
    """
    points = document.named(element)
    listed = None if points is None else points.first("Points")
    if listed is None:
        document.problems.add(
            element.mark, f'no points with the id "{shorten(element.text)}" in clear'
        )
        return np.empty((0, 3))
    every = _triples(document, listed)
    bounds = element.attributes.get("range", element.attributes.get("index", "")).split()
    if not bounds:
        return every
    numbers = [int(text) for text in bounds if re.fullmatch("[0-9]{1,9}", text)]
    if len(numbers) != len(bounds) or not 1 <= numbers[0] <= numbers[-1] <= len(every):
        problem = f'"{shorten(" ".join(bounds))}" are not among the {len(every)} points of the set'
        document.problems.add(element.mark, problem)
        return np.empty((0, 3))
    return every[numbers[0] - 1 : numbers[-1]]


def read(content: bytes, file: str, unit: Fraction | None) -> Report:
    """Return features of QIF results; see `Format`.

    :raises ExperimentError: not well-formed, not QIF, no results, or an invalid number.
    """
    root = parse_xml(content, file)
    if root.name != "QIFDocument" or not NAMESPACE.fullmatch(root.namespace):
        problem = f"<{shorten(root.name)}> is no document of QIF 2 or 3"
        raise refused(file, problem, line=root.mark.line, column=root.mark.column)
    problems = ReportProblems(file)
    by_id = {
        element.attributes["id"]: element for element in root.walk() if "id" in element.attributes
    }
    document = _Document(root, problems, by_id, _units(root, problems, unit))
    sets = [*root.all("Results"), *root.all("MeasurementsResults")]
    results = [
        element
        for set_element in sets
        for element in set_element.walk()
        if element.name == "MeasurementResults"
    ]
    features = tuple(
        replace(feature, marks={"MeasurementResults": str(number)})
        for number, result in enumerate(results, start=1)
        for feature in _features(document, result)
    )
    if not results:
        problems.add(root.mark, "no measurement results; is it a plan, or a model?")
    problems.finish()
    other_characteristics = Counter(
        "characteristic"
        for result in results
        for below in result.walk()
        if re.search("Characteristic(?:Measurement|Actual)$", below.name)
    )
    return Report(file, QIF.title, features, other_characteristics)


QIF = Format("qif", "QIF results", lambda text: BEGINNING.search(text) is not None, read)
