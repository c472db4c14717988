"""Calibrated distances in a file: their keys, and how they are read."""

from __future__ import annotations

from typing import Literal

import numpy as np
from ballplate.simulator.design.observations.calibration import (
    FAR_FROM_DRAWING,
    MOST_TIED_BALLS,
    far_from_drawing,
)
from ballplate.simulator.design.observations.distances import DistanceCalibration
from ballplate.simulator.geometry.ball_layouts import COINCIDENT, BallLayout, frozen, pairs
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import PositiveLength, UncertaintyFunction
from ballplate.simulator.inputs.settings import Forms, Name, NonEmpty, Settings, Text, hint, listing
from ballplate.simulator.inputs.yamltree import mark_of
from numpy.typing import NDArray
from pydantic import Field

from .references import References
from .stated_values import (
    CertificateEntry,
    CommonPartSettings,
    FileValues,
    check_keys,
    is_digital,
    joint_key,
    read_digital,
    uncertainties_of,
)

ListedPairs = NonEmpty[tuple[Name, Name]]
PairSelection = Forms[Text, ListedPairs, ListedPairs]


class CertifiedDistance(Settings):
    """A distance from a certificate."""

    balls: tuple[Name, Name] = Field(description="the two balls")
    distance: PositiveLength = Field(description="distance of their centres")


CertifiedDistances = NonEmpty[CertifiedDistance]


class DistancesSettings(CommonPartSettings):
    """Calibrated distances between balls of an artefact."""

    kind: Literal["distances"] = Field(description="calibrated distances between balls")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    pairs: PairSelection = Field(
        description=(
            "a set that the artefact has, such as corner sides, corner diagonals, corners (both),"
            " neighbours, braced or all, or a list of pairs of balls"
        ),
        examples=["corners"],
    )
    dimensions: Literal[2, 3] | None = Field(
        None, description="3 (default): distances in space; 2: in the artefact's plane"
    )
    standard_uncertainty: UncertaintyFunction | None = Field(
        None,
        description=(
            "of each distance; may grow with it; 0 um if it is exact; left out if values or"
            " covariance state it"
        ),
    )
    values: Forms[Text, CertifiedDistances, CertifiedDistances] | None = Field(
        None,
        description=(
            "CSV file with columns ball_1, ball_2 and distance_mm, and standard_uncertainty_um, or"
            " expanded_uncertainty_um and k; a DCC (XML); or a list of"
            " {balls: [a, b], distance: …}; default: nominal distances"
        ),
    )
    form: Literal["distance", "projection"] = Field(
        "distance",
        description="only for a length standard: distance, or projection on its nominal axis",
    )
    repeatability: Literal["included", "ignored"] = Field(
        "included",
        description=(
            "only for a length standard: whether reading it has the machine's repeatability"
        ),
    )


def read_distances(
    settings: DistancesSettings, artefact: str, steps: Steps, references: References
) -> DistanceCalibration | None:
    layout = references.layouts[artefact]
    is_right = _suits_role(settings, artefact, steps, references)
    if references.dimension == 2 and settings.dimensions == 3:
        text = "a two-dimensional experiment has distances in 2 dimensions; remove it"
        references.problems.add((*steps, "dimensions"), text)
        is_right = False
    dimensions = settings.dimensions or 3
    if references.dimension == 2:
        dimensions = 2
    indices = _pairs(settings.pairs, layout, (*steps, "pairs"), references)
    if indices is None or references.dimension is None:
        return None
    if not _can_be_tied(len(np.unique(indices)), (*steps, "pairs"), references):
        return None
    nominal = _nominal(indices, layout, dimensions, (*steps, "pairs"), references)
    if nominal is None:
        return None
    is_right &= check_keys(settings, steps, references)
    if not is_right:
        return None
    certified = _certified_distances(settings, indices, layout, nominal, steps, references)
    if certified is None:
        return None
    values, in_file, covariance = certified
    names = [(layout.names[i], layout.names[j]) for i, j in indices]
    uncertainty = settings.standard_uncertainty
    of_item = None if uncertainty is None else uncertainty.at(nominal)
    uncertainties = uncertainties_of(
        settings, names, True, of_item, in_file, covariance, nominal, steps, references
    )
    if uncertainties is None:
        return None
    # The root is absent where the certificate states no covariance.
    standard, root = uncertainties
    if root is not None and references.artefacts[artefact].role == "length_standard":
        text = (
            "a length standard's lengths are read as independent; leave this out, or give"
            f' "{artefact}" the role of a plate'
        )
        references.problems.add((*steps, joint_key(settings)), text)
        return None
    indices.setflags(write=False)
    return DistanceCalibration(
        artefact,
        indices,
        dimensions,
        frozen(values),
        settings.values is not None,
        uncertainty if root is None else None,
        standard,
        settings.form,
        settings.repeatability,
        root=root,
    )


def _nominal(
    indices: NDArray[np.intp],
    layout: BallLayout,
    dimensions: Literal[2, 3],
    steps: Steps,
    references: References,
) -> Array | None:
    """Return nominal distances (m,), or report one that is zero."""
    difference = layout.coordinates[indices[:, 1]] - layout.coordinates[indices[:, 0]]
    nominal = np.linalg.norm(difference[:, :dimensions], axis=1)
    if np.any(nominal < COINCIDENT):
        i, j = indices[int(np.argmin(nominal))]
        text = (
            f'balls "{layout.names[i]}" and "{layout.names[j]}" have no distance in the plane; use'
            " dimensions: 3"
        )
        references.problems.add(steps, text)
        return None
    return np.asarray(nominal)


def _suits_role(
    settings: DistancesSettings, artefact: str, steps: Steps, references: References
) -> bool:
    """True if keys that are for length standards only are of one, after saying which are not."""
    is_right = True
    if references.artefacts[artefact].role != "length_standard":
        for key in ("form", "repeatability"):
            if key in settings.model_fields_set:
                text = (
                    "is only for artefacts with role: length_standard; remove it, or give"
                    f' "{artefact}" that role'
                )
                references.problems.add((*steps, key), text, of_key=True)
                is_right = False
    return is_right


def _can_be_tied(balls: int, steps: Steps, references: References) -> bool:
    text = (
        f"distances tie {balls} balls together, at most {MOST_TIED_BALLS} are possible; "
        "calibrate fewer distances, such as corner sides, or co-ordinates"
    )
    return references.require(balls <= MOST_TIED_BALLS, steps, text)


def _pairs(
    selection: str | tuple[tuple[str, str], ...],
    layout: BallLayout,
    steps: Steps,
    references: References,
) -> NDArray[np.intp] | None:
    problems = references.problems
    if isinstance(selection, str):
        # Pairs of all these balls would fill the memory before they can be refused.
        if selection == "all" and not _can_be_tied(len(layout.names), steps, references):
            return None
        try:
            pair_list = pairs(layout, selection)
        except ValueError as error:
            problems.add(steps, str(error))
            return None
        if not len(pair_list):
            problems.add(steps, "the artefact has a single ball and no pairs; remove it")
            return None
        return pair_list
    index = {name: i for i, name in enumerate(layout.names)}
    pairs_seen: dict[frozenset[str], int] = {}
    before = len(problems.messages)
    for i, names in enumerate(selection):
        for j, name in enumerate(names):
            if name not in index:
                text = f'unknown ball "{name}"; {hint(name, layout.names)}'
                problems.add((*steps, i, j), text)
        if names[0] == names[1]:
            text = f'a ball has no distance from itself; name two balls, not "{names[0]}" twice'
            problems.add((*steps, i), text)
        pair = frozenset(names)
        if pair in pairs_seen:
            text = f"is already in entry [{pairs_seen[pair]}]; remove one of the two"
            problems.add((*steps, i), text)
        pairs_seen.setdefault(pair, i)
    if len(problems.messages) > before:
        return None
    return np.array([[index[a], index[b]] for a, b in selection], dtype=np.intp)


def _certified_distances(
    settings: DistancesSettings,
    indices: NDArray[np.intp],
    layout: BallLayout,
    nominal: Array,
    steps: Steps,
    references: References,
) -> tuple[Array, Array, tuple[Array, Array] | None] | None:
    """Values (m,), standard uncertainties (m,) in their file, NaN without any, and covariance."""
    if settings.values is None:
        return nominal, np.full(len(nominal), np.nan), None
    problems, place = references.problems, (*steps, "values")
    wanted = [(layout.names[i], layout.names[j]) for i, j in indices]
    table_entries = _entries(settings, wanted, place, references)
    if table_entries is None:
        return None
    before = len(problems.messages)
    by_pair = _by_pair(table_entries.entries, layout, references)
    missing = [f"{a}–{b}" for a, b in wanted if frozenset((a, b)) not in by_pair]
    drawn = {frozenset(pair): float(length) for pair, length in zip(wanted, nominal, strict=True)}
    for entry in table_entries.entries:
        expected, distance = drawn.get(frozenset(entry.names)), entry.value
        if (
            expected is not None
            and distance > 0
            and not abs(distance - expected) <= FAR_FROM_DRAWING * expected
        ):
            text = f"{far_from_drawing(distance, expected)}; correct one of the two"
            problems.add_at(entry.mark, entry.steps, text)
    if missing and len(problems.messages) == before:
        problems.add(place, f"no distance for {listing(missing)}; add it, or leave it out of pairs")
    if len(problems.messages) > before:
        return None
    chosen = [by_pair[frozenset(pair)] for pair in wanted]
    return (
        np.array([entry.value for entry in chosen]),
        np.array([entry.uncertainty for entry in chosen]),
        table_entries.covariance,
    )


def _entries(
    settings: DistancesSettings,
    wanted: list[tuple[str, str]],
    steps: Steps,
    references: References,
) -> FileValues | None:
    """Return the entries of the file or the list of values, or report faults."""
    from .certificate_tables import read_rows

    if is_digital(settings.values):
        return read_digital(settings, wanted, True, steps[:-1], references)
    if isinstance(settings.values, str):
        rows_read = read_rows(settings, ["ball_1", "ball_2"], ["distance"], [], steps, references)
        if rows_read is None:
            return None
        entries = [
            CertificateEntry(
                (row.texts[0], row.texts[1]), row.lengths[0], float(u[0]), row.mark, steps
            )
            for row, u in zip(*rows_read, strict=True)
        ]
        return FileValues(entries)
    listed = [
        CertificateEntry(
            entry.balls,
            entry.distance,
            np.nan,
            mark_of(references.problems.root, (*steps, i)),
            (*steps, i),
        )
        for i, entry in enumerate(settings.values or ())
    ]
    return FileValues(listed)


def _by_pair(
    entries: list[CertificateEntry], layout: BallLayout, references: References
) -> dict[frozenset[str], CertificateEntry]:
    """Return entries by their balls, and report those that are not distances of two balls, each
    once.
    """
    problems, known_names = references.problems, set(layout.names)
    by_pair = {}
    for entry in entries:
        names, distance, mark, place = entry.names, entry.value, entry.mark, entry.steps
        for name in names:
            if name not in known_names:
                problems.add_at(mark, place, f'unknown ball "{name}"; {hint(name, layout.names)}')
        pair = frozenset(names)
        if len(pair) == 1:
            text = f'a ball has no distance from itself; name two balls, not "{names[0]}" twice'
            problems.add_at(mark, place, text)
        if pair in by_pair:
            text = (
                f'the distance of "{names[0]}" and "{names[1]}" is given twice; remove one of'
                " the two"
            )
            problems.add_at(mark, place, text)
        if distance <= 0:
            problems.add_at(mark, place, "a distance must be above zero; correct it")
        by_pair[pair] = entry
    return by_pair
