"""A change of parameters that observations do not show, by the names of errors, balls and
positions, and as a sentence.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.numerics import printable
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.machines.protocol import Unit

# Unit of small values → unit in which sentences show them, 1e-6 as large, of temperatures 1e-3.
SHOWN = {
    "m": "µm",
    "rad": "µrad",
    "1": "ppm",
    "1/K": "ppm/K",
    "K": "mK",
    "m/h": "µm/h",
    "1/h": "ppm/h",
}


@dataclass(frozen=True)
class FunctionPart:
    """An error function's share of a direction: its largest value along the axis, in `unit`, and
    its shape.
    """

    name: str
    meaning: str
    peak: float
    unit: str
    shape: str


@dataclass(frozen=True)
class ArtefactPart:
    """An artefact's share: the largest displacement of a ball in metres, and the deformation as
    text.
    """

    name: str
    peak: float
    words: str


@dataclass(frozen=True)
class PositionPart:
    """A position's or a probe's share: its shift in metres, its rotation in radians, and their axes
    as text, or empty.
    """

    name: str
    shift: float
    turn: float
    along: str = ""
    about: str = ""


@dataclass(frozen=True)
class LengthPart:
    """The change of an unknown length or influence parameter, in its `unit`."""

    name: str
    change: float
    unit: Unit = "m"


@dataclass(frozen=True)
class Direction:
    """A change of parameters that observations do not show, or show too weakly.

    Null directions are scaled so that their largest share moves points by one micrometre; weak ones
    are one standard deviation long. `standard_deviation` is the contribution of a weak one to
    corrected points, relative to one another, in metres (root mean square over the evaluation
    `points`), infinite for a null direction. It exceeds `limit`, beyond which a direction is weak,
    at `beyond` of the points.
    """

    functions: tuple[FunctionPart, ...]
    artefacts: tuple[ArtefactPart, ...]
    positions: tuple[PositionPart, ...]
    standard_deviation: float = float("inf")
    probes: tuple[PositionPart, ...] = ()
    lengths: tuple[LengthPart, ...] = ()
    influences: tuple[LengthPart, ...] = ()
    points: int = 0
    beyond: int = 0
    limit: float = float("inf")

    def is_pose_of(self, positions: Collection[str]) -> bool:
        """Return whether it changes poses of these positions only."""
        further_shares = self.functions, self.artefacts, self.probes, self.lengths, self.influences
        return (
            not any(further_shares)
            and bool(self.positions)
            and all(part.name in positions for part in self.positions)
        )

    def __str__(self) -> str:
        return in_words(self)


def in_words(direction: Direction) -> str:
    """Return a direction as a sentence: the changes that trade against each other, with sizes; of
    a weak one the largest.
    """
    parts = []
    is_null = np.isinf(direction.standard_deviation)
    if direction.functions:
        described = [_function_words(part) for part in direction.functions[: 8 if is_null else 3]]
        more = len(direction.functions) - len(described)
        further = f" and {number_of(more, 'further error')}" if more > 0 else ""
        parts.append(", ".join(described) + further)
    for artefact in direction.artefacts:
        parts.append(f"{artefact.name} {artefact.words} (balls by up to {length(artefact.peak)})")
    if direction.positions and (is_null or not direction.functions):
        parts.append(f"moved positions: {moved_positions(direction)}")
    if direction.probes:
        parts.append(
            "offsets of probes: "
            + ", ".join(_position_words(part) for part in direction.probes[:6])
        )
    if direction.lengths:
        parts.append(
            ", ".join(f"{part.name} ({length(part.change)})" for part in direction.lengths)
        )
    if direction.influences:
        parts.append(
            ", ".join(
                f"{part.name} ({_amount(part.change, part.unit)})" for part in direction.influences
            )
        )
    if is_null:
        end = (
            "change together without changing any observation"
            if len(parts) > 1
            else "changes no observation"
        )
    else:
        end = (
            f"known only to {length(direction.standard_deviation)} in corrected points, relative to"
            f" one another (root mean square over {direction.points} points; more than"
            f" {length(direction.limit)} at {direction.beyond} points)"
        )
    return "; ".join(parts) + f": {end}"


def moved_positions(direction: Direction) -> str:
    """Return the motions of positions along a direction as text, of at most six; may be empty."""
    described = [_position_words(part) for part in direction.positions[:6]]
    more = len(direction.positions) - len(described)
    return ", ".join(described) + (f" and {more} more" if more > 0 else "")


def _function_words(part: FunctionPart) -> str:
    form = f", {part.shape}" if part.shape else ""
    return f"{part.name} ({part.meaning}{form}) by {_amount(part.peak, part.unit)}"


def _position_words(part: PositionPart) -> str:
    amounts = [length(part.shift) + part.along] if part.shift > 1e-12 else []
    amounts += [_amount(part.turn, "rad") + part.about] if part.turn > 1e-12 else []
    return f"{part.name} ({', '.join(amounts)})"


def length(value: float) -> str:
    """Return a small length in micrometres as text.

    >>> length(2.5e-7)
    '0.25 µm'
    """
    return _amount(value, "m")


def _amount(value: float, unit: str) -> str:
    """Return a small value in a suitable unit as text, without an exponent below a million.

    >>> _amount(8.12e-3, "K"), _amount(1.234e-3, "m"), _amount(2e-9, "rad")
    ('8.12 mK', '1230 µm', '0.002 µrad')
    """
    amount = (1e3 if unit == "K" else 1e6) * value
    text = f"{printable(amount):.3g}"
    if "e+" in text and abs(amount) < 1e6:
        text = f"{float(text):.0f}"
    return f"{text} {SHOWN[unit]}"
