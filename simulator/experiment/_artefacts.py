"""Artefacts get their balls, and with them what a file can refer to by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from ballplate.simulator.geometry.artefacts import BallsSettings, BryanGaugeSettings
from ballplate.simulator.geometry.ball_layouts import (
    MOST_BALLS,
    ArtefactSettings,
    BallLayout,
    LayoutError,
    coincident_balls,
)
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.problems import Problems, written_keys
from ballplate.simulator.inputs.settings import hint, shorten
from ballplate.simulator.inputs.trust import Trust
from ballplate.simulator.inputs.units import format_length
from ballplate.simulator.inputs.yamltree import Mapping, Node, Sequence as SequenceNode, written

from .references import References
from .validation import Sections

DEFAULT_PROBE = "probe"

# Of all artefacts together.
MOST_BALLS_OF_ALL = 100_000


def resolve_references(
    sections: Sections, folder: Path, problems: Problems, trust: Trust
) -> References:
    """Return what positions and calibrations can refer to; tables of balls are read from
    ``folder``.
    """
    root = problems.root
    dimension = _dimension(root)
    probes = written_keys(root, "probes")
    if not probes and written(root, "probes") is None and dimension in (2, None):
        probes = (DEFAULT_PROBE,)
    artefacts = {}
    layouts = {}
    balls = 0
    for key, settings in sections.artefacts.items():
        name, steps = str(key), ("artefacts", str(key))
        listed = _with_coordinates(settings, folder, steps, problems, trust)
        if listed is None:
            continue
        try:
            layout = listed.layout()
        except LayoutError as error:
            problems.add(steps, f'kind "{settings.kind}" has a wrong layout: {error}')
            continue
        balls += len(layout.names)
        if balls > MOST_BALLS_OF_ALL:
            text = (
                f"there are {balls} balls up to here; at most {MOST_BALLS_OF_ALL} of all artefacts"
                " are possible"
            )
            problems.add(steps, text)
            break
        where = (*steps, "directions" if isinstance(listed, BryanGaugeSettings) else "coordinates")
        twins = coincident_balls(layout)
        for i, j in twins[:3]:
            text = (
                f'balls "{layout.names[i]}" and "{layout.names[j]}" have the same location;'
                " correct one of them"
            )
            problems.add(where, text)
        if dimension == 2 and np.any(layout.coordinates[:, 2]):
            high = int(np.flatnonzero(layout.coordinates[:, 2])[0])
            text = (
                f'ball "{layout.names[high]}" has the third co-ordinate'
                f" {format_length(layout.coordinates[high, 2])}, but the experiment is"
                " two-dimensional; give two co-ordinates, or machine.volume a z axis"
            )
            problems.add(where, text)
        elif not twins:
            artefacts[name], layouts[name] = listed, layout
        if listed.reads == "in plane":
            text = "only a plate in space is read in its plane; remove it, and flatness"
            if listed.role != "plate" or dimension == 2:
                problems.add((*steps, "reads"), text)
        if listed.axes is not None:
            _check_axes(listed, layout, (*steps, "axes"), dimension, problems)
    names = written_keys(root, "artefacts")
    return References(problems, folder, dimension, probes, names, artefacts, layouts, trust)


def _check_axes(
    settings: ArtefactSettings,
    layout: BallLayout,
    steps: Steps,
    dimension: int | None,
    problems: Problems,
) -> None:
    """Report axes of an artefact without axes, or through unknown balls."""
    assert settings.axes is not None
    if settings.role != "plate":
        problems.add(steps, "a length standard's balls are not estimated; remove its axes")
    elif dimension == 3:
        text = (
            "axes are those of a plate in two dimensions; remove them, or the z axis of"
            " machine.volume"
        )
        problems.add(steps, text)
    for key in ("origin", "x", "y"):
        name = getattr(settings.axes, key)
        if name is not None and name not in layout.names:
            problems.add(
                (*steps, key), f'unknown ball "{shorten(name)}"; {hint(name, layout.names)}'
            )


def _with_coordinates(
    settings: ArtefactSettings, folder: Path, steps: Steps, problems: Problems, trust: Trust
) -> ArtefactSettings | None:
    if not isinstance(settings, BallsSettings) or settings.file is None:
        return settings
    from ballplate.simulator.inputs.tables import read_table

    steps = (*steps, "file")
    try:
        rows = read_table(trust.file(folder, settings.file), ["ball"], ["x", "y"], ["z"])
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    coordinates = {}
    complete = True
    for row in rows:
        if row.texts[0] in coordinates:
            problems.add_at(
                row.mark,
                steps,
                f'ball "{row.texts[0]}" is listed twice; remove one of the two lines',
            )
            complete = False
        coordinates[row.texts[0]] = row.lengths
    if len(coordinates) > MOST_BALLS:
        problems.add(steps, f"has {len(coordinates)} balls; at most {MOST_BALLS} are possible")
        return None
    return (
        settings.model_copy(update={"coordinates": coordinates, "file": None}) if complete else None
    )


def _dimension(root: Node) -> int | None:
    """Return the number of axes of the volume as written, even with invalid values."""
    volume = written(root, "machine", "volume")
    if isinstance(volume, Mapping):
        # Neither may be meant where an axis has another name.
        return 3 if "z" in volume.items else 2 if set(volume.items) <= {"x", "y"} else None
    if isinstance(volume, SequenceNode) and len(volume.items) in (2, 3):
        return len(volume.items)
    return None
