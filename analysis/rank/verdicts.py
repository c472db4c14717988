"""Rank report of a design: its verdict, null directions and weak directions.

A null direction is a change of parameters that no observation detects: parameters that trade
against one another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing.numerics import above, comparable, svd
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.quantities import Target

if TYPE_CHECKING:
    from .directions import Direction


# Rounding decides the basis that a decomposition gives of the null space, and no reader could
# compare two. The projector onto the space does not depend on it. The parameter with the largest
# diagonal element of the projector has most freedom. It becomes a pivot, the projector of the
# directions that leave it unchanged is formed, and so on. With these pivots the directions have one
# reduced echelon form. Each of them is elementary: no undetermined direction involves only some of
# its parameters.
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
    # Of equal singular values any rotated set of vectors is as good. Their effects on corrected
    # points choose one, unless these are equal, too.
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


# Limit of the gap: a greater one separates determined directions from rounding.
GREAT = 1e9

# Factor of the repeatability beyond which a direction is weak without a target: see `weak_limit`.
WEAK = 10.0


def rank_complaint(deficiency: int, expected: int | None) -> str:
    """Return text about an unexpected rank.

    >>> rank_complaint(1, None)
    'rank deficiency 1, and the file does not say expected_rank_deficiency: 1'
    >>> rank_complaint(0, 2)
    'full rank where the file expects rank deficiency 2'
    """
    rank = f"rank deficiency {deficiency}" if deficiency else "full rank"
    if expected is None:
        return f"{rank}, and the file does not say expected_rank_deficiency: {deficiency}"
    return (
        f"{rank} where the file expects"
        f" {f'rank deficiency {expected}' if expected else 'full rank'}"
    )


@dataclass(frozen=True)
class Verdict:
    """Whether a design determines its parameters.

    `singular_values` are in standard deviations per micrometre, largest first, see `Spectrum`;
    `gap` is the ratio across the border between determined and undetermined, at most `GREAT`, and
    infinite without a border.
    """

    parameters: int
    observations: int
    deficiency: int
    expected: int | None
    singular_values: Array
    gap: float
    null: tuple[Direction, ...]
    weak: tuple[Direction, ...]

    @property
    def as_expected(self) -> bool:
        """Whether the deficiency is the one in the file, by default none."""
        return self.deficiency == (self.expected or 0)

    @property
    def complaint(self) -> str:
        """Text about an unexpected deficiency, or empty."""
        return "" if self.as_expected else rank_complaint(self.deficiency, self.expected)


def verdict(
    at: Linearisation, expected: int | None = None, target: Target | None = None
) -> Verdict:
    """Judge a design from its spectrum; the balls' null directions are computed only if there are
    any.
    """
    design, layout, spectrum = at.design, at.layout, at.spectrum
    weak, effect = _weak_roots(at, target)
    limit = weak_limit(design, target)
    return Verdict(
        design.parameter_count,
        design.observation_count,
        spectrum.deficiency,
        expected,
        spectrum.values,
        spectrum.gap if np.isinf(spectrum.gap) else min(spectrum.gap, GREAT),
        null_directions(at),
        _weak_directions(design, layout, weak, effect, limit),
    )


def relative_changes(design: Design, layout: SharedLayout, directions: Array) -> Array:
    """Return how directions (s, k) move the corrected points relative to one another, (points, d,
    k) metres.
    """
    points = design.evaluation.points
    offsets = np.broadcast_to(design.probes.offsets[design.evaluation.probe], points.shape)
    jacobian = design.model.jacobian(points, np.zeros(len(design.model.parameters)), offsets)
    return without_rigid_motion(points, jacobian @ directions[layout.model])


def null_directions(at: Linearisation) -> tuple[Direction, ...]:
    """Return the undetermined directions, in a basis in which each involves few parameters."""
    if not at.deficiency:
        return ()
    from ._descriptions import described

    return tuple(described(at.design, at.layout, *change) for change in null_changes(at))


def null_changes(at: Linearisation) -> list[tuple[Array, Array]]:
    """Return each undetermined direction as reported: changes (s,) of the shared parameters and (n,
    d) of the balls, at most one micrometre.
    """
    if not at.deficiency:
        return []
    from ._descriptions import largest_displacement, signed

    changes = []
    for mixture in independent_mixture(at).T:
        shared, balls = at.shared_null @ mixture, at.ball_null @ mixture
        size = largest_displacement(at.layout, shared, balls) / 1e-6
        changes.append(signed(at.design, at.layout, shared / size, balls / size))
    return changes


def weak_changes(at: Linearisation, target: Target | None = None) -> list[Array]:
    """Return each weak direction as reported, weakest first: changes (s,) of the shared parameters,
    one standard deviation long.
    """
    from ._descriptions import signed

    still = np.zeros_like(at.design.balls.places)
    return [signed(at.design, at.layout, root, still)[0] for root in _weak_roots(at, target)[0].T]


def independent_mixture(at: Linearisation) -> Array:
    """Return mixtures (k, k) of the null directions in which each involves few parameters."""
    return elementary_mixture(at.shared_null / at.spectrum.scale[:, None])


def _weak_roots(at: Linearisation, target: Target | None) -> tuple[Array, Array]:
    """Return weak directions (s, k), one standard deviation long, weakest first, and their effects
    on corrected points.
    """
    limit = weak_limit(at.design, target)
    # Relative to one another: a motion of all corrected points as one body is no error of the
    # machine.
    change = relative_changes(at.design, at.layout, at.shared)
    # Where the squares of all effects together are at most half of the limit's square, a margin for
    # rounding, none is weak, and their decomposition is spared.
    if 2.0 * (change**2).sum() <= 0.5 * limit**2 * change[:, :, :1].size:
        return np.zeros((len(at.layout), 0)), np.zeros(0)
    root, effect = _principal(at)
    columns = np.flatnonzero(above(effect, limit))[::-1]
    return root[:, columns], effect[columns]


def effects(at: Linearisation) -> Array:
    """Return the effect of one standard deviation along each determined direction on corrected
    points, relative to one another, in metres, (rank,).

    It is the root mean square over the points; empty without evaluation points.
    """
    return _principal(at)[1]


def _principal(at: Linearisation) -> tuple[Array, Array]:
    """Return determined directions (s, rank), one standard deviation long, and their effects on
    corrected points.
    """
    design, layout, spectrum = at.design, at.layout, at.spectrum
    if not len(design.evaluation.points) or spectrum.rank == 0:
        return np.zeros((len(layout), 0)), np.zeros(0)
    root = spectrum.principal_root
    change = relative_changes(design, layout, root)
    # The difference of two independent points has twice the variance of one.
    effect = np.sqrt(2.0 / change[:, :, 0].size) * change.reshape(-1, spectrum.rank)
    return principal_directions(spectrum.values[: spectrum.rank], root, effect, spectrum.scale)


def weak_limit(design: Design, target: Target | None) -> float:
    """Return the effect, in metres, beyond which a direction is weak: the target uncertainty at
    half the volume's diagonal, by default `WEAK` times the repeatability.
    """
    if target is None:
        return WEAK * float(design.machine.repeatability.max())
    return float(target.at(0.5 * float(np.linalg.norm(design.machine.volume.size))))


def _weak_directions(
    design: Design, layout: SharedLayout, roots: Array, effect: Array, limit: float
) -> tuple[Direction, ...]:
    if not roots.shape[1]:
        return ()
    from ._descriptions import described, signed

    directions = []
    of_points = np.sqrt(2.0 * (relative_changes(design, layout, roots) ** 2).mean(axis=1))
    beyond = above(of_points, limit).sum(axis=0)
    for root, size, count in zip(roots.T, effect.tolist(), beyond.tolist(), strict=True):
        still = np.zeros_like(design.balls.places)
        description = described(design, layout, *signed(design, layout, root, still))
        weak = replace(
            description, artefacts=(), standard_deviation=size, points=len(design.evaluation.points)
        )
        directions.append(replace(weak, beyond=count, limit=limit))
    return tuple(directions)
