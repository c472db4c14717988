"""References of positions and calibrations to artefacts, probes and balls by name."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry.artefacts import (
    MOST_BALLS,
    ArtefactSettings,
    BallLayout,
    BallsSettings,
    BryanGaugeSettings,
    coincident_balls,
    corners,
    frozen,
)
from ..inputs.messages import ExperimentError, Step, Steps
from ..inputs.problems import Problems, written_keys, written_text
from ..inputs.quantities import format_length
from ..inputs.settings import hint, listing, shorten
from ..inputs.tables import read_table
from ..inputs.yamltree import Mapping, Node, written
from ..inputs.yamltree import Sequence as SequenceNode
from .model import Floats, Indices
from .sections import ProbeSettings
from .structure import Sections

DEFAULT_PROBE = "probe"

# Of all artefacts together, and of all positions with their repeats: half a million readings take
# half a gigabyte.
MOST_BALLS_OF_ALL = 100_000
MOST_READINGS = 2_000_000


@dataclass
class ReadingCount:
    """What has been counted so far."""

    readings: int = 0


@dataclass(frozen=True, eq=False)
class References:
    """What can be referred to.

    ``probes`` and ``artefact_names`` are names as written, also of entries that are wrong in
    themselves; ``artefacts`` and ``layouts`` have only right ones. ``dimension`` is None where the
    file does not tell it.
    """

    problems: Problems
    folder: Path
    dimension: int | None
    probes: tuple[str, ...]
    artefact_names: tuple[str, ...]
    artefacts: dict[str, ArtefactSettings]
    layouts: dict[str, BallLayout]
    tally: ReadingCount = field(default_factory=ReadingCount)

    def count_readings(self, count: int, steps: Steps) -> bool:
        """Count further readings; tell whether there is room for them, after saying once that there
        is not.
        """
        before = self.tally.readings
        self.tally.readings += count
        if before <= MOST_READINGS < self.tally.readings:
            text = (
                f"there are {self.tally.readings} readings up to here, repeats counted; at most"
                f" {MOST_READINGS} are possible: read fewer balls, or less often"
            )
            self.problems.add(steps, text)
        return self.tally.readings <= MOST_READINGS

    def artefact(self, name: str | None, steps: Steps) -> str | None:
        """Return the artefact that a position or calibration is about, or None after saying what is
        wrong.
        """
        if name is None:
            if len(self.artefact_names) > 1:
                choice = listing(self.artefact_names)
                self.problems.add(
                    (*steps, "artefact"), f'missing; add "artefact", one of: {choice}'
                )
            return self.artefact_names[0] if len(self.artefact_names) == 1 else None
        if name not in self.artefact_names:
            self.problems.add(
                (*steps, "artefact"),
                f'unknown artefact "{name}"; {hint(name, self.artefact_names)}',
            )
            return None
        return name

    def check_written(self, steps: Steps) -> None:
        """Report unknown names in a position or calibration that is wrong in itself."""
        name = written_text(self.problems.root, *steps, "artefact")
        if name is not None:
            self.artefact(name, steps)
        probes = written(self.problems.root, *steps, "probes")
        for i in range(len(probes.items)) if isinstance(probes, SequenceNode) else ():
            probe = written_text(self.problems.root, *steps, "probes", i)
            if probe is not None and probe not in self.probes:
                self.problems.add(
                    (*steps, "probes", i), f'unknown probe "{probe}"; {hint(probe, self.probes)}'
                )

    def probe_names(self, names: tuple[str, ...] | None, steps: Steps) -> tuple[str, ...] | None:
        """Return the probes of a reading, or None after saying what is wrong."""
        if names is None:
            if len(self.probes) > 1:
                choice = listing(self.probes)
                self.problems.add((*steps, "probes"), f'missing; add "probes", some of: {choice}')
            return self.probes if len(self.probes) == 1 else None
        return names if self._known_once("probe", self.probes, names, (*steps, "probes")) else None

    def are_probes(self, names: Sequence[str], steps: Steps) -> bool:
        """Tell whether names listed at a path are of probes, each once, after saying what is
        wrong.
        """
        return self._known_once("probe", self.probes, names, steps)

    def balls(self, chosen: Sequence[str], layout: BallLayout, steps: Steps) -> Indices | None:
        """Return the indices of balls, all, the corners or listed ones, or None after saying what
        is wrong.
        """
        index = {name: i for i, name in enumerate(layout.names)}
        if chosen == "all":
            found = np.arange(len(index))
        elif chosen == "corners":
            try:
                found = corners(layout)
            except ValueError as error:
                self.problems.add(steps, str(error))
                return None
        elif self._known_once("ball", index, chosen, steps):
            found = np.array([index[name] for name in chosen], dtype=np.intp)
        else:
            return None
        found.setflags(write=False)
        return found

    def has_dimension(self, point: Sequence[float], steps: Steps) -> bool:
        """Tell whether a point has as many co-ordinates as the experiment, after saying where
        not.
        """
        return self.require(
            self.dimension in (None, len(point)),
            steps,
            f"has {len(point)} co-ordinates, but the experiment has {self.dimension} dimensions;"
            f" give {self.dimension}",
        )

    def refuse_in_plane(self, *steps: Step) -> None:
        """Say that a key is one of three dimensions."""
        self.problems.add(steps, "has no meaning in two dimensions; remove it", of_key=True)

    def _known_once(
        self, what: str, known: Collection[str], names: Sequence[str], steps: Steps
    ) -> bool:
        seen: set[str] = set()
        before = len(self.problems.messages)
        for i, name in enumerate(names):
            if name not in known:
                self.problems.add(
                    (*steps, i), f'unknown {what} "{shorten(name)}"; {hint(name, known)}'
                )
            elif name in seen:
                self.problems.add(
                    (*steps, i), f'{what} "{shorten(name)}" is listed twice; remove one of the two'
                )
            seen.add(name)
        return len(self.problems.messages) == before

    def require(self, is_right: bool, steps: Steps, text: Callable[[], str] | str) -> bool:
        """Say what is wrong unless it is right; return whether it is."""
        if not is_right:
            self.problems.add(steps, text if isinstance(text, str) else text())
        return is_right


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
        layout = listed.layout()
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


def resolve_probes(sections: Sections, references: References) -> dict[str, Floats]:
    """Return the offsets of the probes that are right."""
    problems, dimension = references.problems, references.dimension
    if written(problems.root, "probes") is None:
        if dimension == 3:
            text = (
                'missing; add "probes", such as {down: [0 mm, 0 mm, -50 mm]}: offsets from the'
                " reference point"
            )
            problems.add(("probes",), text)
        return {DEFAULT_PROBE: frozen(np.zeros(dimension))} if dimension == 2 else {}
    offsets = {}
    for name, settings in sections.entries("probes").items():
        offset = settings.offset if isinstance(settings, ProbeSettings) else settings
        if references.has_dimension(offset, ("probes", name)):
            offsets[str(name)] = frozen(offset)
    return offsets


def resolve_offset_uncertainties(sections: Sections, references: References) -> dict[str, Floats]:
    """Return standard uncertainties (d,) of the offsets that are estimated, infinite where they are
    unknown.
    """
    problems, dimension = references.problems, references.dimension
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
    reference = named[0] if named else references.probes[0] if references.probes else ""
    found: dict[str, Floats] = {}
    for name, settings in listed.items():
        steps: Steps = ("probes", name)
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
        if name == reference and not named and (settings.unknown or stated is not None):
            text = (
                "its offset is held as stated, as the first probe is the reference where none has"
                " reference: true"
            )
            problems.doubt(steps, f"{text}; its stated uncertainty is ignored")
        uncertainty, is_right = lengths_per_axis(
            stated, (*steps, "standard_uncertainty"), references
        )
        if settings.unknown and dimension is not None:
            uncertainty = frozen([np.inf] * dimension)
        if uncertainty is not None and is_right and name != reference:
            found[name] = uncertainty
    return found


def lengths_per_axis(
    stated: Any, steps: Steps, references: References
) -> tuple[Floats | None, bool]:
    """Lengths of all axes (d,), None where nothing is stated, and whether what is stated is
    right.
    """
    dimension = references.dimension
    if stated is None or dimension is None:
        return None, True
    if isinstance(stated, float):
        return frozen([stated] * dimension), True
    listed = stated if isinstance(stated, tuple) else (stated.x, stated.y, stated.z)
    given = tuple(length for length in listed if length is not None)
    text = (
        f"has {len(given)} axes, but the experiment has {dimension}; give one length for all, or"
        f" {dimension}"
    )
    return frozen(given), references.require(len(given) == dimension, steps, text)


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
