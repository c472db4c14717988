"""The fitted map of a map file's tree, or its faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from ballplate.results import LackOfFit
from ballplate.simulator.design import Probes, Volume
from ballplate.simulator.experiment import MapData, check_ends, check_installed
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import (
    ExperimentError,
    Mapping as MappingNode,
    Node,
    Problems,
    Sequence as SequenceNode,
    Trust,
    describe,
    listing,
    shorten,
    to_python,
    validated,
)
from ballplate.simulator.machines import (
    Array,
    CustomModelError,
    ErrorModel,
    build_error_model,
    kind_of,
)

from .fitted_map import FittedMap, LeftOut
from .map_content import checksum_of
from .map_sections import MapSettings
from .model_files import absolute, fingerprints


# In one piece: what is checked needs what was found right before it.
def map_of_tree(root: Node, source: Path, problems: Problems, trust: Trust) -> FittedMap | None:
    """The map of a tree, or None after reporting faults."""
    if not isinstance(root, MappingNode) or "map" not in root.items:
        description = (
            describe(to_python(root)) if not isinstance(root, MappingNode) else "no key map"
        )
        text = (
            f"is no map file ({description}); write one with:"
            " ballplate fit FILE READINGS -o map.yaml"
        )
        problems.add((), text)
        return None
    problems.add_empty()
    # Before the kind of the error model, which is unknown without its extension.
    stated = root.items.get("extensions")
    check_installed(to_python(stated) if isinstance(stated, SequenceNode) else (), problems)
    if problems.messages:
        return None
    settings = validated(MapSettings, root, problems)
    if settings is None:
        return None
    ends = settings.volume.stated.values()
    if not check_ends(settings.volume.stated, ("volume",), problems):
        return None
    lower, upper = (np.array(end) for end in zip(*ends, strict=True))
    volume = Volume(lower, upper)
    model = _model(settings, volume, source.parent, problems, trust)
    probes = _probes(settings, len(lower), problems)
    if model is None or probes is None:
        return None
    values = np.array([parameter.value for parameter in settings.parameters])
    _check_parameters(settings, model, problems)
    if problems.messages:
        return None
    size = len(values) + int(probes.free.sum())
    covariance = _triangle(settings, size, problems)
    undetermined = _directions(settings, size, problems)
    if (np.diagonal(covariance) < 0.0).any():
        problems.add(("covariance",), "has a variance below zero; write the map again")
    elif not problems.messages:
        _check_unchanged(settings.checksum, root, covariance, undetermined, problems)
    if problems.messages:
        return None
    data = settings.data
    return FittedMap(
        title=settings.title,
        model=model,
        settings=absolute(to_python(root.items["error_model"]), source.parent),
        volume=volume,
        values=values,
        probes=probes,
        drawn_offsets=np.array(
            [probe.nominal or probe.offset for probe in settings.probes.values()]
        ),
        probe=settings.probe,
        covariance=covariance,
        undetermined=undetermined,
        sigma=settings.sigma.value,
        sigma_is_estimated=settings.sigma.estimated,
        degrees_of_freedom=settings.sigma.degrees_of_freedom,
        repeatability=np.array(settings.repeatability),
        coverage_factor=settings.coverage_factor,
        frame=settings.frame,
        temperatures=settings.temperatures,
        left_out=tuple(LeftOut(**left_out.model_dump()) for left_out in settings.left_out),
        data=None if data is None else MapData(**data.model_dump()),
        lack_of_fit=LackOfFit(**settings.lack_of_fit.model_dump()),
        experiment=settings.experiment,
        program=settings.program,
        date=settings.date,
        sum_of_squares=settings.sigma.sum_of_squares,
    )


def _model(
    settings: MapSettings, volume: Volume, folder: Path, problems: Problems, trust: Trust
) -> ErrorModel | None:
    """The error model, or None after reporting faults."""
    model_settings: Any = settings.error_model
    d = len(volume.lower)
    kind = kind_of(model_settings)
    if d not in kind.dimensions:
        problems.add(
            ("volume",), f"has {d} axes, but {model_settings.kind} models have {kind.dimensions[0]}"
        )
        return None
    try:
        model_settings = kind.read(model_settings, folder, trust)
        wrong = list(kind.wrong(model_settings, d))
        for below, text in wrong:
            problems.add(("error_model", *below), text)
        # What is not to be run is refused where the model is made.
        may_look = trust.modules or not kind.is_code
        if wrong or may_look and not _has_its_files(settings, folder, problems):
            return None
        return build_error_model(model_settings, *volume.corners)
    except CustomModelError as error:
        problems.add(("error_model", error.key), str(error))
    except ExperimentError as error:
        problems.take(error, ("error_model", "file"))
    return None


def _has_its_files(settings: MapSettings, folder: Path, problems: Problems) -> bool:
    """True if the files that the error model uses are unchanged; reports others."""
    before = len(problems.messages)
    model_data = to_python(problems.root)["error_model"]  # type: ignore[index,unused-ignore]
    present = fingerprints(absolute(model_data, folder))
    for name, fingerprint in settings.files.items():
        if name not in present or present[name] != fingerprint:
            text = (
                "has changed since the map was written, and the map may no longer belong to it;"
                " restore the earlier file, or fit again"
            )
            problems.add(("files", name), text)
    return len(problems.messages) == before


def _probes(settings: MapSettings, d: int, problems: Problems) -> Probes | None:
    """The probes, or None after reporting faults."""
    for name, probe in settings.probes.items():
        if {len(probe.offset), len(probe.nominal or probe.offset)} != {d} or any(
            AXIS_NAMES.index(axis) >= d for axis in probe.estimated
        ):
            problems.add(("probes", name), f"is not of {d} axes, as the volume")
    if len(settings.repeatability) != d:
        problems.add(("repeatability",), f"is not of {d} axes, as the volume")
    if settings.probe not in settings.probes:
        text = f"is not one of the probes; known: {listing(settings.probes)}"
        problems.add(("probe",), text)
    if problems.messages:
        return None
    free = [
        [axis in probe_settings.estimated for axis in AXIS_NAMES[:d]]
        for probe_settings in settings.probes.values()
    ]
    offsets = np.array([probe_settings.offset for probe_settings in settings.probes.values()])
    return Probes(tuple(settings.probes), offsets, np.array(free, bool))


def _check_parameters(settings: MapSettings, model: ErrorModel, problems: Problems) -> None:
    """Report parameters that are not those of the error model."""
    expected_parameters, stated_parameters = model.parameters, settings.parameters
    if len(expected_parameters) != len(stated_parameters):
        text = (
            f"has {len(stated_parameters)} entries, but the error model"
            f" {len(expected_parameters)} parameters"
        )
        problems.add(("parameters",), f"{text}; the file is incomplete, or was edited")
        return
    for k, (expected, parameter) in enumerate(
        zip(expected_parameters, stated_parameters, strict=True)
    ):
        if (expected.name, expected.unit) != (parameter.name, parameter.unit):
            text = (
                f'is "{shorten(parameter.name)}" in {parameter.unit}, but the error model has'
                f' "{expected.name}" in {expected.unit} there: the file was edited; write it again'
                " with"
                " fit -o"
            )
            problems.add(("parameters", k), text)


def _triangle(settings: MapSettings, size: int, problems: Problems) -> Array:
    """The covariance (size, size) of the rows of its lower triangle."""
    rows = settings.covariance
    triangle = np.zeros((size, size))
    if len(rows) != size:
        text = (
            f"has {len(rows)} rows; {size} parameters and estimated offsets need {size}: the file"
            " is incomplete, or was edited"
        )
        problems.add(("covariance",), text)
        return triangle
    for k, row in enumerate(rows):
        triangle[k, : k + 1] = _numbers(row, k + 1, ("covariance", k), problems)
        triangle[:k, k] = triangle[k, :k]
    return triangle


def _directions(settings: MapSettings, size: int, problems: Problems) -> Array:
    """Undetermined directions (size, k)."""
    rows = [
        _numbers(row, size, ("undetermined", k), problems)
        for k, row in enumerate(settings.undetermined)
    ]
    return np.array(rows).reshape(-1, size).T


def _numbers(row: str | float, count: int, steps: tuple[str, int], problems: Problems) -> Array:
    """The numbers of a row, zeros after reporting faults."""
    words = str(row).split()
    try:
        values = np.array(list(map(float, words)))
    except ValueError:
        values = np.full(len(words), np.nan)
    if len(words) == count and np.isfinite(values).all():
        return values
    text = f"{len(words)} numbers instead of {count}"
    if len(words) == count:
        text = "has an entry that is no finite number"
    problems.add(steps, f"{text}; write the map again")
    return np.zeros(count)


def _check_unchanged(
    checksum: str | None,
    root: MappingNode,
    covariance: Array,
    undetermined: Array,
    problems: Problems,
) -> None:
    """Report a file that was edited."""
    head = {
        key: value
        for key, value in to_python(root).items()
        if key not in ("covariance", "undetermined")
    }
    if checksum is not None and checksum != checksum_of(head, covariance, undetermined):
        text = (
            "does not match the content of the file: it was edited or damaged since it was"
            " written; write it again with fit -o, or remove the checksum if the changes are"
            " meant"
        )
        problems.add(("checksum",), text)
