"""Loading of a part file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.geometry import rotation_matrix
from ballplate.simulator.inputs import (
    OPENED,
    ExperimentError,
    Mapping,
    Node,
    Problems,
    Steps,
    Trust,
    hint,
    read_tree,
    to_python,
    validated,
)

from ..machine_files import RandomPart, load_machine, random_part
from .datums import sensed
from .fitting import GeometricElement
from .part import FORMS, Dimension, PartExpansion, PartFeature, Place, Workpiece
from .part_features import FLAT, read_feature
from .part_sections import DIMENSIONS, PartSettings
from .values import size, undetermined

ROUND, DIRECTED = ("circle", "sphere", "cylinder"), ("plane", "line", "cylinder", "cone")
# Kinds of elements that a kind of dimension is of; others are of all.
OF = {
    **dict.fromkeys(("diameter", "radius"), ROUND),
    "flatness": ("plane",),
    "straightness": ("line",),
    "roundness": ("circle", "sphere"),
    "cylindricity": ("cylinder",),
    **dict.fromkeys(("angle", "parallelism", "perpendicularity"), DIRECTED),
}


def load_part(path: str | os.PathLike[str], trust: Trust = OPENED) -> Workpiece:
    """Load a part file; tables of points that it names are read from its folder.

    Dimensions that their points or datums do not determine are `Workpiece.undetermined`.

    :raises ExperimentError: the file, or a table, is invalid.
    """
    source = Path(path)
    problems = Problems(read_tree(source))
    problems.add_empty()
    problems.root = _with_like(problems.root, problems)
    settings = validated(PartSettings, problems.root, problems)
    part = None if settings is None else _part(settings, problems, source.parent, trust)
    if part is None or problems.messages:
        raise ExperimentError(sorted(problems.messages))
    return part


def _with_like(root: Node, problems: Problems) -> Node:
    """Return the tree with the keys of features that others are like."""
    features = root.items.get("features") if isinstance(root, Mapping) else None
    if not isinstance(root, Mapping) or not isinstance(features, Mapping):
        return root
    found = dict[str, Any]()
    for name, node in features.items.items():
        found[name] = node
        if not isinstance(node, Mapping) or "like" not in node.items:
            continue
        like = str(to_python(node.items["like"]))
        base = found.get(like)
        if not isinstance(base, Mapping) or base is node:
            del found[name]
            problems.add(("features", name, "like"), f"no such feature above; {hint(like, found)}")
            continue
        items = {**base.items, **node.items}
        del items["like"]
        found[name] = Mapping(node.mark, items, {**base.key_marks, **node.key_marks})
    return replace(root, items={**root.items, "features": replace(features, items=found)})


def _part(settings: PartSettings, problems: Problems, folder: Path, trust: Trust) -> Workpiece:
    features = dict[str, PartFeature]()
    for name, stated in settings.features.items():
        read = read_feature(name, stated, features, problems, folder, trust)
        if read is not None:
            features[name] = read
    part = Workpiece(
        settings.part,
        features,
        (),
        tuple(
            Place(
                name,
                rotation_matrix(place.rotation or (0.0, 0.0, place.quarter_turns * np.pi / 2)),
                np.array(place.origin),
            )
            for name, place in settings.places.items()
        ),
        settings.probing,
        settings.material or PartExpansion.model_validate({}),
        settings.short_waves,
        settings.share_of_tolerance,
        random=_random(settings, problems, folder, trust),
    )
    if problems.messages:
        return part
    dimensions: dict[str, Dimension] = {}
    for k, stated in enumerate(settings.dimensions):
        one = _dimension(part, stated, ("dimensions", k), problems)
        if one is not None and one.name in dimensions:
            problems.add(("dimensions", k), f'another is called "{one.name}"; add name: …')
        elif one is not None:
            dimensions[one.name] = one
    open_ = {name: text for name, one in dimensions.items() if (text := undetermined(part, one))}
    return replace(part, dimensions=tuple(dimensions.values()), undetermined=open_)


def _random(
    settings: PartSettings, problems: Problems, folder: Path, trust: Trust
) -> RandomPart | None:
    if settings.random_part is None:
        return None
    try:
        path = trust.file(folder, settings.random_part)
        return random_part(load_machine(path, trust=trust))
    except ExperimentError as error:
        problems.take(error, ("random_part",))
        return None


def _dimension(
    part: Workpiece, settings: Any, steps: Steps, problems: Problems
) -> Dimension | None:
    stated = settings.stated
    kind = next(kind for kind in DIMENSIONS if kind in stated)
    names, datums = (
        (value,) if isinstance(value, str) else value
        for value in (stated[kind], stated.get("datums", ()))
    )
    for key, used in ((kind, names), ("datums", datums)):
        for name in used:
            if name not in part.features:
                problems.add((*steps, key), f'no feature "{name}"; {hint(name, part.features)}')
    if problems.has_below(steps):
        return None
    elements = [part.features[name].nominal for name in names]
    first = elements[0]
    for one in elements:
        if one.kind not in OF.get(kind, (one.kind,)):
            text = f"a {one.kind} has no {kind}; name a {' or '.join(OF[kind])}"
            problems.add((*steps, kind), text)
    components = 0 if kind in FORMS else None
    if kind == "position":
        components = len(sensed(first))
    elif datums:
        components = 0 if first.kind == "plane" else 2
        to = part.features[datums[0]].nominal
        is_same = (to.kind == "plane") == (first.kind == "plane")
        cosine = abs(to.direction @ first.direction)
        is_so = abs(cosine - (is_same == (kind == "parallelism"))) < 1e-9
        if not is_so or to.kind not in DIRECTED:
            problems.add((*steps, kind), f"{names[0]} has no nominal {kind} to {datums[0]}")
    if problems.has_below(steps):
        return None
    nominal = float(size(kind, elements, elements)) if components is None else 0.0
    if text := _meaningless(kind, elements, nominal):
        problems.add((*steps, kind), text)
    if set(names) & set(datums):
        problems.add((*steps, "datums"), f"{names[0]} is its own datum; name others")
    limits = stated.get("tolerance")
    if isinstance(limits, float):
        limits = (-limits if components is None else None, limits)
    lower, upper = limits or (None, None)
    if upper is not None and upper <= (lower or 0.0):
        problems.add((*steps, "tolerance"), "leaves nothing; write a width, or [lower, upper]")
    return Dimension(
        name=stated.get("name", f"{kind} {', '.join(names)}"),
        kind=kind,
        features=names,
        datums=datums,
        nominal=nominal,
        tolerance=limits,
        unit="rad" if kind == "angle" else "m",
        form=stated.get("nominal", 0.0),
        zone=stated.get("evaluation") == "minimum zone",
        components=components,
    )


def _meaningless(kind: str, elements: Sequence[GeometricElement], nominal: float) -> str:
    """Return why a distance or an angle has no value that changes smoothly, or an empty text."""
    if kind not in ("distance", "angle"):
        return ""
    first, second = elements
    cosine = abs(first.direction @ second.direction)
    if kind == "angle":
        return "" if cosine < 1 - FLAT else "of parallel directions; state their orientation"
    if nominal < FLAT:
        return "is 0; state a position"
    planes = sum(one.kind == "plane" for one in elements)
    directed = sum(one.kind in DIRECTED for one in elements)
    is_so = directed < 2 or planes == 0 or abs(cosine - (planes == 2)) < FLAT
    return "" if is_so else "of features that are not parallel; state an angle"
