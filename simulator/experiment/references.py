"""What a file refers to by name: artefacts, their balls, and probes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.geometry.ball_layouts import (
    ArtefactSettings,
    BallLayout,
    corner_balls,
    frozen,
)
from ballplate.simulator.inputs.messages import Step, Steps
from ballplate.simulator.inputs.number_arrays import Array, Indices
from ballplate.simulator.inputs.problems import Problems, written_text
from ballplate.simulator.inputs.settings import hint, listing, shorten
from ballplate.simulator.inputs.trust import UNKNOWN, Trust
from ballplate.simulator.inputs.yamltree import Sequence as SequenceNode, written

# Of all positions with their repeats: half a million readings take half a gigabyte.
MOST_READINGS = 2_000_000


@dataclass(frozen=True, eq=False)
class References:
    """Objects that can be referred to.

    ``probes`` and ``artefact_names`` are names as written, also of invalid entries; ``artefacts``
    and ``layouts`` have only valid ones. ``dimension`` and ``volume`` may be missing from the file
    or invalid.
    """

    problems: Problems
    folder: Path
    dimension: int | None
    probes: tuple[str, ...]
    artefact_names: tuple[str, ...]
    artefacts: dict[str, ArtefactSettings]
    layouts: dict[str, BallLayout]
    trust: Trust = UNKNOWN
    volume: Volume | None = None
    # Counts, like the problems, are shared by all copies with another volume.
    tally: Counter[str] = field(default_factory=Counter)

    def file(self, name: object) -> Path:
        """Return the file that the experiment names.

        :raises ExperimentError: it is outside the permitted folders.
        """
        return self.trust.file(self.folder, name)

    def count_readings(self, count: int, steps: Steps) -> bool:
        """Count further readings; return false, after one message, if there are too many."""
        # The message comes with the position that exceeds the limit. Further ones are refused
        # without it.
        before = self.tally["readings"]
        self.tally["readings"] += count
        if before <= MOST_READINGS < self.tally["readings"]:
            text = (
                f"there are {self.tally['readings']} readings up to here, repeats counted; at most"
                f" {MOST_READINGS} are possible: read fewer balls, or less often"
            )
            self.problems.add(steps, text)
        return self.tally["readings"] <= MOST_READINGS

    def artefact(self, name: str | None, steps: Steps) -> str | None:
        """Return the artefact of a position or calibration, or report faults."""
        if name is None:
            if len(self.artefact_names) > 1:
                choice = listing(self.artefact_names)
                self.problems.add(
                    (*steps, "artefact"), f'missing; add "artefact", one of: {choice}'
                )
            return self.artefact_names[0] if len(self.artefact_names) == 1 else None
        place = (*steps, "artefact")
        return name if self._is_known("artefact", self.artefact_names, name, place) else None

    def check_written(self, steps: Steps) -> None:
        """Report unknown names in an invalid position or calibration."""
        name = written_text(self.problems.root, *steps, "artefact")
        if name is not None:
            self.artefact(name, steps)
        probes = written(self.problems.root, *steps, "probes")
        for i in range(len(probes.items)) if isinstance(probes, SequenceNode) else ():
            probe = written_text(self.problems.root, *steps, "probes", i)
            if probe is not None:
                self.is_probe(probe, (*steps, "probes", i))

    def probe_names(self, names: tuple[str, ...] | None, steps: Steps) -> tuple[str, ...] | None:
        """Return the probes of a reading, or report faults."""
        if names is None:
            if len(self.probes) > 1:
                choice = listing(self.probes)
                self.problems.add((*steps, "probes"), f'missing; add "probes", some of: {choice}')
            return self.probes if len(self.probes) == 1 else None
        return names if self._known_once("probe", self.probes, names, (*steps, "probes")) else None

    def is_not_negative(self, uncertainty: float | None, steps: Steps) -> bool:
        """True if an uncertainty is absent, zero or above; otherwise a message."""
        return self.require(
            uncertainty is None or uncertainty >= 0.0,
            steps,
            "is below zero; give it without the sign",
        )

    def has_axes(self, setting: object, steps: Steps) -> bool:
        """True unless a stated list has another length than the number of axes; then a message."""
        count = len(setting) if isinstance(setting, tuple) else self.dimension
        return self.require(
            self.dimension in (None, count),
            steps,
            f"has {count} axes, but the experiment has {self.dimension}",
        )

    def is_position(self, name: str, positions: Collection[str], steps: Steps) -> bool:
        """True if a name is of a position; otherwise a message."""
        return self._is_known("position", positions, name, steps)

    def is_probe(self, name: str, steps: Steps, of_key: bool = False) -> bool:
        """True if a name is of a probe; otherwise a message."""
        return self._is_known("probe", self.probes, name, steps, of_key)

    def are_probes(self, names: Sequence[str], steps: Steps) -> bool:
        """True if names listed at a path are of probes, each once, after reporting faults."""
        return self._known_once("probe", self.probes, names, steps)

    def balls(self, chosen: Sequence[str], layout: BallLayout, steps: Steps) -> Indices | None:
        """Return the indices of balls, all, the corners or listed ones, or report faults."""
        index = {name: i for i, name in enumerate(layout.names)}
        if chosen == "all":
            indices = np.arange(len(index))
        elif chosen == "corners":
            try:
                indices = corner_balls(layout)
            except ValueError as error:
                self.problems.add(steps, str(error))
                return None
        elif self._known_once("ball", index, chosen, steps):
            indices = np.array([index[name] for name in chosen], dtype=np.intp)
        else:
            return None
        indices.setflags(write=False)
        return indices

    def has_dimension(self, point: Sequence[float], steps: Steps) -> bool:
        """True if a point has as many co-ordinates as the experiment, after saying where not."""
        return self.require(
            self.dimension in (None, len(point)),
            steps,
            f"has {len(point)} co-ordinates, but the experiment has {self.dimension} dimensions;"
            f" give {self.dimension}",
        )

    def is_in_volume(self, point: Sequence[float], steps: Steps) -> bool:
        """True if a point has the right number of co-ordinates and lies in the measuring volume,
        after saying where not.
        """
        if not self.has_dimension(point, steps):
            return False
        lower, upper = (point, point) if self.volume is None else self.volume.of_readings
        is_inside = bool(np.all((lower <= np.array(point)) & (np.array(point) <= upper)))
        return self.require(is_inside, steps, "is outside the measuring volume; correct it")

    def refuse_in_plane(self, *steps: Step) -> None:
        """Say that a key is one of three dimensions."""
        self.problems.add(steps, "has no meaning in two dimensions; remove it", of_key=True)

    def _is_known(
        self,
        noun: str,
        names_known: Collection[str],
        name: str,
        steps: Steps,
        of_key: bool = False,
    ) -> bool:
        is_known = name in names_known
        if not is_known:
            # Only now: to find the nearest of thousands of names takes long.
            text = f'unknown {noun} "{name}"; {hint(name, names_known)}'
            self.problems.add(steps, text, of_key)
        return is_known

    def _known_once(
        self, noun: str, names_known: Collection[str], names: Sequence[str], steps: Steps
    ) -> bool:
        names_seen = set()
        before = len(self.problems.messages)
        for i, name in enumerate(names):
            if name not in names_known:
                self.problems.add(
                    (*steps, i), f'unknown {noun} "{shorten(name)}"; {hint(name, names_known)}'
                )
            elif name in names_seen:
                self.problems.add(
                    (*steps, i), f'{noun} "{shorten(name)}" is listed twice; remove one of the two'
                )
            names_seen.add(name)
        return len(self.problems.messages) == before

    def require(self, is_right: bool, steps: Steps, text: str) -> bool:
        """Report a fault unless the condition holds; return the condition."""
        if not is_right:
            self.problems.add(steps, text)
        return is_right


def lengths_per_axis(
    setting: Any, steps: Steps, references: References
) -> tuple[Array | None, bool]:
    """Return lengths of all axes (d,), if stated, and whether the statement is valid."""
    dimension = references.dimension
    if setting is None or dimension is None:
        return None, True
    if isinstance(setting, float):
        return frozen([setting] * dimension), True
    listed = setting if isinstance(setting, tuple) else (setting.x, setting.y, setting.z)
    lengths_given = tuple(length for length in listed if length is not None)
    text = (
        f"has {len(lengths_given)} axes, but the experiment has {dimension}; give one length for"
        " all, or"
        f" {dimension}"
    )
    return frozen(lengths_given), references.require(len(lengths_given) == dimension, steps, text)
