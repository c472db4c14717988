"""Results in the Quality Information Framework (QIF 2 and 3, ISO 23952), read by path.

A measured sphere names the item of which it is a measurement, and that has the name; points are
listed below the sphere (QIF 2) or in sets of points to which it refers (QIF 3).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from ballplate.simulator.inputs import (
    QuantityError,
    exact_number,
    refused,
    shorten,
)
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

    def named(self, one: Element | None) -> Element | None:
        """What an element refers to by an id, or None."""
        return None if one is None else self.by_id.get(one.text)

    def unit(self, one: Element) -> Fraction:
        """Metres per unit of an element's co-ordinates."""
        name = one.attributes.get("linearUnit", "")
        if name not in self.units:
            told = f'unknown unit "{shorten(name)}"; the file\'s units should define it'
            if not name:
                told = "the file states no unit of length; state it with --unit mm or --unit in"
            self.problems.add(one.mark, told)
            self.units[name] = Fraction(1, 1000)
        return self.units[name]

    def numbers(self, one: Element) -> list[float]:
        """Co-ordinates of an element in metres, NaN after a message."""
        factor = self.unit(one)
        return [self.problems.length(text, factor, one.mark) for text in one.text.split()]


def _units(root: Element, problems: ReportProblems, unit: Fraction | None) -> dict[str, Fraction]:
    """Metres per unit of length, by the unit's name; those of the file under no name."""
    units = {} if unit is None else {"": unit}
    for where in ("PrimaryUnits", "OtherUnits"):
        for one in root.all("FileUnits", where, "LinearUnit"):
            factor = one.first("UnitConversion", "Factor")
            try:
                value = Fraction(1) if factor is None else exact_number(factor.text)
            except QuantityError as error:
                problems.add(factor.mark if factor else one.mark, str(error))
                value = Fraction(1)
            if value <= 0:
                problems.add(one.mark, "the unit's factor is not above zero")
            units[one.text_at("UnitName")] = value
            if where == "PrimaryUnits":
                units.setdefault("", value)
    return units


def _features(document: _Document, results: Element) -> Iterator[Feature]:
    for measured in results.all("MeasuredFeatures"):
        lists = [measured, *measured.all("FeatureActuals"), *measured.all("FeatureMeasurements")]
        for one in (child for of in lists for child in of.children):
            ending = next((end for end in MEASURED if one.name.endswith(end)), None)
            if ending is not None:
                kind = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", one.name.removesuffix(ending)).lower()
                yield _feature(document, one, kind)


def _feature(document: _Document, one: Element, kind: str) -> Feature:
    item = document.named(one.first("FeatureItemId"))
    name = one.text_at("FeatureName") or (item.text_at("FeatureName") if item else "")
    location, points, lacks = one.first("Location"), None, ""
    centre = None
    if kind in LOCATED and location is not None:
        numbers = document.numbers(location)
        if len(numbers) != 3:
            told = f"{len(numbers)} co-ordinates instead of 3"
            document.problems.add(location.mark, told)
        else:
            centre = numbers[0], numbers[1], numbers[2]
    elif kind == SPHERE:
        points = _points(document, one)
        lacks = "neither a location nor points" if points is None else ""
    device = document.named(one.first("MeasurementDeviceIds", "Id"))
    probe = device.text_at("Name") if device else ""
    transform = document.named(one.first("ActualTransformId"))
    frame = document.named(item.first("CoordinateSystemId")) if item else None
    system: System = "unstated" if transform is None and frame is None else "part"
    of = transform.text_at("Name") if transform else frame.text_at("Name") if frame else ""
    if not name:
        lacks, centre, points = "no name", None, None
    return Feature(one.mark, name or one.name, kind, centre, points, probe, system, of, lacks)


def _points(document: _Document, one: Element) -> Array | None:
    """Points (n, 3) of a sphere in metres, None where there are none that can be read."""
    found: list[Array] = []
    for listed in one.all("PointList"):
        for child in listed.children:
            if child.name == "MeasurePoint":
                found += [_triples(document, point) for point in child.all("Point")]
            elif child.name.endswith("PointSetId"):
                found.append(_of_set(document, child))
    return np.concatenate(found) if sum(map(len, found)) else None


def _triples(document: _Document, one: Element) -> Array:
    numbers = document.numbers(one)
    if len(numbers) % 3:
        told = f"{len(numbers)} co-ordinates, which is no multiple of 3"
        document.problems.add(one.mark, told)
        numbers = []
    return np.array(numbers).reshape(-1, 3)


def _of_set(document: _Document, one: Element) -> Array:
    """The points of a set that a reference names: all, those from one to another, or a single
    one, counted from 1.
    """
    points = document.named(one)
    listed = None if points is None else points.first("Points")
    if listed is None:
        document.problems.add(one.mark, f'no points with the id "{shorten(one.text)}" in clear')
        return np.empty((0, 3))
    every = _triples(document, listed)
    bounds = one.attributes.get("range", one.attributes.get("index", "")).split()
    if not bounds:
        return every
    numbers = [int(text) for text in bounds if re.fullmatch("[0-9]{1,9}", text)]
    if len(numbers) != len(bounds) or not 1 <= numbers[0] <= numbers[-1] <= len(every):
        told = f'"{shorten(" ".join(bounds))}" are not among the {len(every)} points of the set'
        document.problems.add(one.mark, told)
        return np.empty((0, 3))
    return every[numbers[0] - 1 : numbers[-1]]


def read(content: bytes, file: str, unit: Fraction | None) -> Report:
    """Features of QIF results; see `Format`.

    :raises ExperimentError: not well-formed, no QIF, no results, or a wrong number.
    """
    root = parse_xml(content, file)
    if root.name != "QIFDocument" or not NAMESPACE.fullmatch(root.namespace):
        told = f"<{shorten(root.name)}> is no document of QIF 2 or 3"
        raise refused(file, told, line=root.mark.line, column=root.mark.column)
    problems = ReportProblems(file)
    by_id = {one.attributes["id"]: one for one in root.walk() if "id" in one.attributes}
    document = _Document(root, problems, by_id, _units(root, problems, unit))
    sets = [*root.all("Results"), *root.all("MeasurementsResults")]
    results = [one for of in sets for one in of.walk() if one.name == "MeasurementResults"]
    features = tuple(feature for one in results for feature in _features(document, one))
    if not results:
        problems.add(root.mark, "no measurement results; is it a plan, or a model?")
    problems.finish()
    others = Counter(
        "characteristic"
        for one in results
        for below in one.walk()
        if re.search("Characteristic(?:Measurement|Actual)$", below.name)
    )
    return Report(file, QIF.title, features, others)


QIF = Format("qif", "QIF results", lambda text: BEGINNING.search(text) is not None, read)
