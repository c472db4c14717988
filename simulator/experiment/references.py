"""References of positions and calibrations to artefacts, probes and balls by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..design.lookup import Floats, References, lengths_per_axis
from ..geometry.artefacts import BallsSettings, BryanGaugeSettings
from ..geometry.ball_layouts import (
    MOST_BALLS,
    ArtefactSettings,
    BallLayout,
    LayoutError,
    coincident_balls,
    frozen,
)
from ..inputs.messages import ExperimentError, Steps
from ..inputs.problems import Problems, written_keys
from ..inputs.quantities import format_length
from ..inputs.settings import hint, shorten
from ..inputs.tables import read_table
from ..inputs.yamltree import Mapping, Node, written
from ..inputs.yamltree import Sequence as SequenceNode
from .model import Probe
from .sections import ProbeSettings
from .structure import Sections

DEFAULT_PROBE = "probe"

# Of all artefacts together.
MOST_BALLS_OF_ALL = 100_000


def resolve_references(sections: Sections, folder: Path, problems: Problems) -> References:
    """Return what positions and calibrations can refer to; tables of balls are read from
    ``folder``.
    """
    root = problems.root
    dimension = _dimension(root)
    probes = written_keys(root, "probes")
    if not probes and written(root, "probes") is None and dimension in (2, None):
        probes = (DEFAULT_PROBE,)
    artefacts: dict[str, ArtefactSettings] = {}
    layouts: dict[str, BallLayout] = {}
    balls = 0
    for key, settings in sections.entries("artefacts").items():
        name, steps = str(key), ("artefacts", str(key))
        listed = _with_coordinates(settings, folder, steps, problems)
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
                f'balls "{layout.names[i]}" and "{layout.names[j]}" are at the same place; correct'
                " one of them"
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
        if listed.axes is not None:
            _check_axes(listed, layout, (*steps, "axes"), dimension, problems)
    return References(
        problems, folder, dimension, probes, written_keys(root, "artefacts"), artefacts, layouts
    )


def _check_axes(
    settings: ArtefactSettings,
    layout: BallLayout,
    steps: Steps,
    dimension: int | None,
    problems: Problems,
) -> None:
    """Report axes of an artefact that has none, or through balls that it does not have."""
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


def resolve_probes(sections: Sections, references: References) -> dict[str, Probe]:
    """Return the probes that are right, by name."""
    problems, dimension = references.problems, references.dimension
    if written(problems.root, "probes") is None:
        if dimension == 3:
            text = (
                'missing; add "probes", such as {down: [0 mm, 0 mm, -50 mm]}: offsets from the'
                " reference point"
            )
            problems.add(("probes",), text)
            return {}
        at_reference = Probe(DEFAULT_PROBE, frozen(np.zeros(dimension or 0)))
        return {DEFAULT_PROBE: at_reference} if dimension == 2 else {}
    reference = _reference_probe(sections, references)
    probes = {}
    for key, settings in sections.entries("probes").items():
        name, steps, uncertainty = str(key), ("probes", str(key)), None
        offset = settings
        if isinstance(settings, ProbeSettings):
            offset = settings.offset
            uncertainty = _offset_uncertainty(settings, steps, references)
        if references.has_dimension(offset, steps):
            known = None if name == reference else uncertainty
            probes[name] = Probe(name, frozen(offset), known)
    return probes


def _reference_probe(sections: Sections, references: References) -> str:
    """Name of the probe whose offset is held, what is wrong with it told."""
    problems = references.problems
    listed = {
        str(name): s
        for name, s in sections.entries("probes").items()
        if isinstance(s, ProbeSettings)
    }
    named = [name for name, settings in listed.items() if settings.reference]
    for name in named[1:]:
        problems.add(
            ("probes", name, "reference"),
            f'"{named[0]}" is the reference already; remove one of the two',
        )
    if named:
        return named[0]
    first = references.probes[0] if references.probes else ""
    if first in listed and (listed[first].unknown or listed[first].standard_uncertainty):
        text = (
            "its offset is held as stated, as the first probe is the reference where none has"
            " reference: true"
        )
        problems.doubt(("probes", first), f"{text}; its stated uncertainty is ignored")
    return first


def _offset_uncertainty(
    settings: ProbeSettings, steps: Steps, references: References
) -> Floats | None:
    """Standard uncertainties (d,) of an offset that is estimated, infinite where it is unknown,
    None after saying what is wrong and where nothing is stated.
    """
    problems, dimension = references.problems, references.dimension
    stated = settings.standard_uncertainty
    if settings.unknown and stated is not None:
        problems.add(
            (*steps, "unknown"),
            'does not go with "standard_uncertainty"; remove one of the two',
            True,
        )
    if settings.reference and (settings.unknown or stated is not None):
        key = "unknown" if settings.unknown else "standard_uncertainty"
        problems.add(
            (*steps, key), "the offset of the reference is held as stated; remove it", True
        )
    uncertainty, is_right = lengths_per_axis(stated, (*steps, "standard_uncertainty"), references)
    if settings.unknown and dimension is not None:
        return frozen([np.inf] * dimension)
    return uncertainty if is_right else None


def _with_coordinates(
    settings: ArtefactSettings, folder: Path, steps: Steps, problems: Problems
) -> ArtefactSettings | None:
    if not isinstance(settings, BallsSettings) or settings.file is None:
        return settings
    steps = (*steps, "file")
    try:
        rows = read_table(folder / settings.file, ["ball"], ["x", "y"], ["z"])
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    coordinates: dict[str, tuple[float, ...]] = {}
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
    """Return the number of axes of the volume as written, even where its values are wrong."""
    volume = written(root, "machine", "volume")
    if isinstance(volume, Mapping):
        # Neither may be meant where an axis has another name.
        return 3 if "z" in volume.items else 2 if set(volume.items) <= {"x", "y"} else None
    if isinstance(volume, SequenceNode) and len(volume.items) in (2, 3):
        return len(volume.items)
    return None
