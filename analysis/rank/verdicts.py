"""Rank report of a design: null directions in the names of errors, balls and positions.

A null direction is a change of parameters that no observation detects. It is described by the
parameters that trade against one another: error functions with their size and shape, the
deformation of the artefact, the motion of positions.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from ballplate.rank.canonical import elementary_mixture, principal_directions
from ballplate.simulator.computing.decompositions import lstsq
from ballplate.simulator.computing.rounding import above, comparable, printable
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.quantities import Target
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.machines.error_names import AXIS_ERRORS
from ballplate.simulator.machines.protocol import Array, HasLines, Unit

# Shares of a direction that move points by less than this fraction of its largest are not reported.
NEGLIGIBLE = 0.01

# Changes that move points by less than this fraction of a direction's largest are rounding.
ROUNDING = 1e-9

# Limit of the gap: a greater one separates determined directions from rounding.
GREAT = 1e9

# Factor of the repeatability beyond which a direction is weak without a target: see `weak_limit`.
WEAK = 10.0

# Highest degree of polynomial tried for a curve before it is called irregular.
HIGHEST = 10

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
SHAPES = {1: "linear", 2: "quadratic", 3: "cubic"}


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
    `gap` is the ratio across the border between determined and undetermined, `GREAT` at most.
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
    return tuple(_described(at.design, at.layout, *change) for change in null_changes(at))


def null_changes(at: Linearisation) -> list[tuple[Array, Array]]:
    """Return each undetermined direction as reported: changes (s,) of the shared parameters and (n,
    d) of the balls, at most one micrometre.
    """
    changes = []
    for mixture in independent_mixture(at).T:
        shared, balls = at.shared_null @ mixture, at.ball_null @ mixture
        size = _largest(at.layout, shared, balls) / 1e-6
        changes.append(_signed(at.design, at.layout, shared / size, balls / size))
    return changes


def weak_changes(at: Linearisation, target: Target | None = None) -> list[Array]:
    """Return each weak direction as reported, weakest first: changes (s,) of the shared parameters,
    one standard deviation long.
    """
    still = np.zeros_like(at.design.balls.places)
    return [_signed(at.design, at.layout, root, still)[0] for root in _weak_roots(at, target)[0].T]


def independent_mixture(at: Linearisation) -> Array:
    """Return mixtures (k, k) of the null directions in which each involves few parameters."""
    return elementary_mixture(at.shared_null / at.spectrum.scale[:, None])


def _weak_roots(at: Linearisation, target: Target | None) -> tuple[Array, Array]:
    """Return weak directions (s, k), one standard deviation long, weakest first, and their effects
    on corrected points.
    """
    limit = weak_limit(at.design, target)
    change = relative_changes(at.design, at.layout, at.shared)
    # All directions together have less effect than that: none is weak.
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
    directions = []
    of_points = np.sqrt(2.0 * (relative_changes(design, layout, roots) ** 2).mean(axis=1))
    beyond = above(of_points, limit).sum(axis=0)
    for root, size, count in zip(roots.T, effect.tolist(), beyond.tolist(), strict=True):
        still = np.zeros_like(design.balls.places)
        description = _described(design, layout, *_signed(design, layout, root, still))
        weak = replace(
            description, artefacts=(), standard_deviation=size, points=len(design.evaluation.points)
        )
        directions.append(replace(weak, beyond=count, limit=limit))
    return tuple(directions)


def _signed(
    design: Design, layout: SharedLayout, shared: Array, balls: Array
) -> tuple[Array, Array]:
    """Return a direction without rounding errors, its first change positive."""
    shared, balls = _less_rounding(layout, shared, balls)
    direction = _described(design, layout, shared, balls)
    if direction.functions:
        first = direction.functions[0].peak
    elif direction.lengths:
        first = direction.lengths[0].change
    else:
        changes = np.concatenate([shared / layout.scale, balls.ravel()])
        first = float(changes[comparable(np.abs(changes)).argmax()])
    return (shared, balls) if first >= 0.0 else (-shared, -balls)


def _largest(layout: SharedLayout, shared: Array, balls: Array) -> float:
    """Return the largest displacement of points in a direction, in metres."""
    parts = np.abs(shared / layout.scale), np.abs(balls)
    return max(float(part.max(initial=0.0)) for part in parts)


def _less_rounding(layout: SharedLayout, shared: Array, balls: Array) -> tuple[Array, Array]:
    """Return a direction with zeros for rounding errors."""
    least = ROUNDING * _largest(layout, shared, balls)
    return np.where(np.abs(shared / layout.scale) > least, shared, 0.0), np.where(
        np.abs(balls) > least, balls, 0.0
    )


def _described(design: Design, layout: SharedLayout, shared: Array, balls: Array) -> Direction:
    d = design.dimension
    functions = _function_parts(design, layout, shared)
    effect = np.abs(shared / layout.scale)
    largest = _largest(layout, shared, balls)
    positions = []
    for k in design.posed_positions:
        columns = layout.pose_columns[k]
        values = np.where(columns >= 0, shared[np.maximum(columns, 0)], 0.0)
        if above(effect[columns[columns >= 0]].max(initial=0.0), NEGLIGIBLE * largest):
            shift, turn = np.linalg.norm(values[:d]), np.linalg.norm(values[d:])
            along, about = _single_axis(values[:d], " along "), _single_axis(values[d:], " about ")
            positions.append(
                PositionPart(design.positions.names[k], float(shift), float(turn), along, about)
            )
    artefacts = []
    for artefact in design.artefacts.plates:
        members = design.balls.of(artefact)
        moved = np.linalg.norm(balls[members], axis=1)
        if above(moved.max(initial=0.0), NEGLIGIBLE * largest):
            words = deformation(design.balls.places[members], balls[members])
            artefacts.append(
                ArtefactPart(design.artefacts.names[artefact], float(moved.max()), words)
            )
    probes = []
    for k, columns in enumerate(layout.offset_columns):
        values = np.where(columns >= 0, shared[np.maximum(columns, 0)], 0.0)
        if above(np.abs(values).max(), NEGLIGIBLE * largest):
            probes.append(PositionPart(design.probes.names[k], float(np.linalg.norm(values)), 0.0))
    lengths = tuple(
        LengthPart(name, float(change))
        for name, change in zip(design.unknown_lengths.names, shared[layout.lengths], strict=True)
        if above(abs(change), NEGLIGIBLE * largest)
    )
    influences = tuple(
        LengthPart(parameter.name, float(change), parameter.unit)
        for parameter, change in zip(
            design.influence_parameters, shared[layout.influences], strict=True
        )
        if above(abs(change) * parameter.effect, NEGLIGIBLE * largest)
    )
    return Direction(
        functions,
        tuple(artefacts),
        tuple(positions),
        probes=tuple(probes),
        lengths=lengths,
        influences=influences,
    )


def _single_axis(vector: Array, word: str) -> str:
    if len(vector) == 1 or not vector.any():
        return ""
    axis = int(comparable(np.abs(vector)).argmax())
    return f"{word}{'xyz'[axis]}" if abs(vector[axis]) > 0.999 * np.linalg.norm(vector) else ""


def _function_parts(
    design: Design, layout: SharedLayout, shared: Array
) -> tuple[FunctionPart, ...]:
    a, parameters = shared[layout.model], layout.parameters[layout.model]
    effect = np.abs(a / layout.scale[layout.model])
    largest = float(np.abs(shared / layout.scale).max(initial=0.0))
    parts = []
    model = design.model
    for name in dict.fromkeys(p.function for p in parameters):
        members = [i for i, p in enumerate(parameters) if p.function == name]
        if not above(effect[members].max(), NEGLIGIBLE * largest):
            continue
        parameter = parameters[members[0]]
        if isinstance(model, HasLines):
            t = np.linspace(0.0, 1.0, 201)
            lines = model.lines(name, t)
            values = np.stack([line.basis @ a[members] for line in lines])
            peak = float(values.flat[comparable(np.abs(values)).argmax()])
            k = int(comparable(np.ptp(values, axis=1)).argmax())
            form = " ".join(filter(None, (shape(t, values[k]), lines[k].words)))
        else:
            peak, form = float(a[members[0]]), ""
        meaning = parameter.meaning
        if form == "linear" and name in AXIS_ERRORS and AXIS_ERRORS[name].is_straightness:
            meaning, form = AXIS_ERRORS[name].slope_meaning, ""
        function_part = FunctionPart(name, meaning, peak, parameter.unit, form)
        parts.append((effect[members].max(), function_part))
    order = np.argsort(-comparable([size for size, _ in parts]), kind="stable")
    return tuple(parts[k][1] for k in order)


def shape(t: Array, values: Array) -> str:
    """Return a word for a curve's shape: the lowest degree of polynomial, up to 10, that describes
    it; empty for a constant.

    >>> t = np.linspace(0, 1, 50)
    >>> shape(t, 3 * t), shape(t, t - t**2), shape(t, t**5), shape(t, 0 * t + 2)
    ('linear', 'quadratic', 'of degree 5', '')
    """
    if not np.ptp(values):
        return ""
    basis = np.asarray(np.polynomial.chebyshev.chebvander(2 * t - 1, HIGHEST), float)
    size = float(np.abs(values).max())
    for degree in range(1, HIGHEST + 1):
        part = basis[:, : degree + 1]
        residual = values - part @ lstsq(part, values, rcond=None)[0]
        if np.abs(residual).max() <= 1e-3 * size:
            return SHAPES.get(degree, f"of degree {degree}")
    return "irregular"


def deformation(places: Array, displacement: Array) -> str:
    """Return a description of an artefact's deformation, from ball places and their displacements,
    both (n, d).

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> deformation(square, square * [1.0, -1.0])
    'stretches along its x and shrinks along its y'
    """
    n, d = places.shape
    moved = without_rigid_motion(places, displacement[:, :, None])[:, :, 0]
    total = float((moved**2).sum())
    if total <= 1e-12 * float((displacement**2).sum()):
        return "moves as a whole"
    centred = places - places.mean(axis=0)
    linear = lstsq(centred, moved, rcond=1e-9)[0].T
    remainder = moved - centred @ linear.T
    extent = np.ptp(places, axis=0)
    words = []
    if above(((centred @ linear.T) ** 2).sum(), 0.02 * total):
        names = ("x", "y", "z")
        stretch = np.array([linear[i, i] * (extent[i] > 0) for i in range(d)])
        flat = [i for i in range(d) if extent[i] > 0]
        largest = np.abs(linear).max()
        used = [i for i in flat if above(abs(stretch[i]), 0.05 * largest)]
        if len(used) > 1 and np.ptp(stretch[used]) < 0.02 * largest and len(used) == len(flat):
            words.append("changes its size as a whole")
        else:
            grow = " and ".join(
                f"its {names[i]}" for i in used if stretch[i] * stretch[used[0]] > 0
            )
            shrink = " and ".join(
                f"its {names[i]}" for i in used if stretch[i] * stretch[used[0]] < 0
            )
            if grow:
                words.append(
                    f"stretches along {grow}" + (f" and shrinks along {shrink}" if shrink else "")
                )
        sheared = [
            (i, j)
            for i in flat
            for j in flat
            if i < j and above(abs(linear[i, j] + linear[j, i]), 0.1 * largest)
        ]
        words += [f"shears in its {names[i]}{names[j]} plane" for i, j in sheared]
    if above((remainder**2).sum(), 0.02 * total):
        out_of_plane = (
            d == 3
            and extent[2] == 0
            and above((remainder[:, 2] ** 2).sum(), 0.5 * float((remainder**2).sum()))
        )
        words.append("bends out of its plane" if out_of_plane else "distorts unevenly")
    return ", ".join(words) if words else "deforms"


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
