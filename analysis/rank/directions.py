"""A change of parameters that observations do not show, by the names of errors, balls and
positions, and as a sentence.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.numerics import comparable, printable, svd
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.machines.protocol import Array, Integers, Unit

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


def elementary_mixture(directions: Array) -> Array:
    """Return mixtures (k, k) that make elementary directions of linearly independent ones (s, k),
    in comparable units.

    >>> mixed = np.array([[1.0, 1.0], [1.0, -1.0], [0.5, 0.5]])
    >>> (mixed @ elementary_mixture(mixed)).tolist()
    [[0.0, 1.0], [1.0, 0.0], [0.0, 0.5]]
    """
    remainder = np.linalg.qr(directions)[0]
    chosen = []
    for _ in range(directions.shape[1]):
        # The remainder of a parameter's row is its freedom when those chosen before are fixed.
        row = int(comparable((remainder**2).sum(axis=1)).argmax())
        unit = remainder[row] / np.linalg.norm(remainder[row])
        remainder = remainder - np.outer(remainder @ unit, unit)
        chosen.append(row)
    return np.asarray(np.linalg.inv(directions[chosen]))


def principal_directions(
    values: Array, root: Array, effect: Array, scale: Array
) -> tuple[Array, Array]:
    """Return directions (s, r) and the lengths (r,) of their effects, in one basis even if singular
    values are equal.

    `root` (s, r) holds right singular vectors over their `values` (r,), largest first, and `effect`
    (m, r) their effects. Directions of equal values are rotated until their effects are orthogonal,
    the largest last; those of equal effects are made elementary, in units of `scale` (s,).
    """
    root, size = root.copy(), np.sqrt((effect**2).sum(axis=0))
    for group in _equal(values):
        if len(group) > 1:
            _, lengths, turned = svd(np.linalg.qr(effect[:, group], mode="r"))
            size[group] = np.concatenate([lengths, np.zeros(len(group) - len(lengths))])[::-1]
            root[:, group] = root[:, group] @ turned[::-1].T
            for equal in _equal(size[group]):
                if len(equal) > 1:
                    columns = group[equal]
                    directions = root[:, columns] / scale[:, None]
                    length = np.sqrt((directions**2).sum(axis=0)).mean()
                    directions = directions @ elementary_mixture(directions)
                    # Reversed, since the weakest direction is last.
                    directions = (directions * length / np.sqrt((directions**2).sum(axis=0)))[
                        :, ::-1
                    ]
                    root[:, columns] = directions * scale[:, None]
    return root, size


def _equal(values: Array) -> list[Integers]:
    """Return indices of sorted values (r,) in groups of equal ones, within rounding."""
    return np.split(np.arange(len(values)), np.flatnonzero(np.diff(comparable(values))) + 1)
