"""Rank report of a design: null directions in the names of errors, balls and positions.

A null direction is a change of parameters that no observation notices. It is described by the
parameters that trade against one another: error functions with their size and shape, the
deformation of the artefact, the motion of positions.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from ballplate.rank.canonical import elementary_mixture, principal_directions
from ballplate.rank.missing_bars import reasons, relative_changes
from ballplate.simulator.computing.rounding import above, comparable, printable
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.quantities import Target
from ballplate.simulator.machines.protocol import Array, HasLines, Unit

# Parts of a direction that move points by less than this fraction of its largest part are not told.
NEGLIGIBLE = 0.01

# What moves points by less than this fraction of a direction's largest part is rounding.
ROUNDING = 1e-9

# A gap beyond this is one to mere rounding, and counts as this.
GREAT = 1e9

# A direction is weak when one standard deviation along it moves corrected points, relative to one
# another, by more than the target uncertainty at half the volume's diagonal or, without a target,
# this many times the repeatability.
WEAK = 10.0

# Curves that no polynomial of this degree describes are called irregular.
HIGHEST = 10
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
    """An artefact's share: the largest displacement of a ball in metres, and the deformation in
    words.
    """

    name: str
    peak: float
    words: str


@dataclass(frozen=True)
class PositionPart:
    """A position's or a probe's share: its shift in metres, its turn in radians, and their axes in
    words if any.
    """

    name: str
    shift: float
    turn: float
    along: str = ""
    about: str = ""


@dataclass(frozen=True)
class LengthPart:
    """The change of an unknown length, or of a parameter of an influence quantity, in its
    `unit`.
    """

    name: str
    change: float
    unit: Unit = "m"


@dataclass(frozen=True)
class Direction:
    """A change of parameters that observations do not show, or show too weakly.

    Null directions are scaled so that the part that moves points most moves them by one micrometre;
    weak ones are as long as their standard deviation. `standard_deviation` is what a weak one adds
    to corrected points, relative to one another, in metres, as the root mean square over the
    evaluation `points`; it adds more than `limit`, beyond which a direction is weak, at `beyond` of
    them. It is infinite for a null direction.
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
        """Whether it changes nothing but poses of some positions."""
        others = self.functions, self.artefacts, self.probes, self.lengths, self.influences
        return (
            not any(others)
            and bool(self.positions)
            and all(part.name in positions for part in self.positions)
        )

    def __str__(self) -> str:
        return in_words(self)


def rank_complaint(deficiency: int, expected: int | None) -> str:
    """A rank that is not the expected one, in words that are true where the file expects nothing.

    >>> rank_complaint(1, None)
    'rank deficiency 1, and the file does not say expected_rank_deficiency: 1'
    >>> rank_complaint(0, 2)
    'full rank where the file expects rank deficiency 2'
    """
    found = f"rank deficiency {deficiency}" if deficiency else "full rank"
    if expected is None:
        return f"{found}, and the file does not say expected_rank_deficiency: {deficiency}"
    return (
        f"{found} where the file expects"
        f" {f'rank deficiency {expected}' if expected else 'full rank'}"
    )


@dataclass(frozen=True)
class Verdict:
    """Whether a design determines its parameters.

    `singular_values` are in standard deviations per micrometre, largest first, see `Spectrum`;
    `gap` is the ratio across the border between determined and undetermined, `GREAT` at most.
    `reasons` tell what bars and gauges lack.
    """

    parameters: int
    observations: int
    deficiency: int
    expected: int | None
    singular_values: Array
    gap: float
    null: tuple[Direction, ...]
    weak: tuple[Direction, ...]
    reasons: tuple[str, ...] = ()

    @property
    def as_expected(self) -> bool:
        """Whether the deficiency is the one the file states; a file that states none expects full
        rank.
        """
        return self.deficiency == (self.expected or 0)

    @property
    def complaint(self) -> str:
        """What is wrong where the deficiency is not as expected; otherwise empty."""
        return "" if self.as_expected else rank_complaint(self.deficiency, self.expected)


def verdict(
    at: Linearisation, expected: int | None = None, target: Target | None = None
) -> Verdict:
    """Judge a design from its spectrum; how the balls follow the undetermined directions is asked
    for where there are any.
    """
    design, layout, found = at.design, at.layout, at.spectrum
    weak, effect = _weak_roots(at, target)
    limit = weak_limit(design, target)
    open_ = np.concatenate([at.shared_null, weak], axis=1)
    return Verdict(
        design.parameter_count,
        design.observation_count,
        found.deficiency,
        expected,
        found.values,
        found.gap if np.isinf(found.gap) else min(found.gap, GREAT),
        null_directions(at),
        _weak_directions(design, layout, weak, effect, limit),
        reasons(design, layout, open_),
    )


def null_directions(at: Linearisation) -> tuple[Direction, ...]:
    """The undetermined directions, in a basis in which each involves as little as possible."""
    return tuple(_told(at.design, at.layout, *change) for change in null_changes(at))


def null_changes(at: Linearisation) -> list[tuple[Array, Array]]:
    """Each undetermined direction as it is told: changes (s,) of the shared parameters, and (n, d)
    of the balls, the part that moves points most by one micrometre.
    """
    found = []
    for mixture in independent_mixture(at).T:
        shared, balls = at.shared_null @ mixture, at.ball_null @ mixture
        size = _largest(at.layout, shared, balls) / 1e-6
        found.append(_signed(at.design, at.layout, shared / size, balls / size))
    return found


def weak_changes(at: Linearisation, target: Target | None = None) -> list[Array]:
    """Each weak direction as it is told, weakest first: changes (s,) of the shared parameters, one
    standard deviation long.
    """
    still = np.zeros_like(at.design.balls.places)
    return [_signed(at.design, at.layout, root, still)[0] for root in _weak_roots(at, target)[0].T]


def independent_mixture(at: Linearisation) -> Array:
    """Mixtures (k, k) of the null directions in which they are reported: each involves as little as
    possible.
    """
    return elementary_mixture(at.shared_null / at.spectrum.scale[:, None])


def _weak_roots(at: Linearisation, target: Target | None) -> tuple[Array, Array]:
    """Weak directions (s, k), one standard deviation long, weakest first, and what each adds to
    corrected points.
    """
    root, effect = _principal(at)
    columns = np.flatnonzero(above(effect, weak_limit(at.design, target)))[::-1]
    return root[:, columns], effect[columns]


def effects(at: Linearisation) -> Array:
    """What one standard deviation along each determined direction adds to corrected points, in
    metres, (rank,).

    Relative to one another, that is, as the root mean square over the points; empty where the
    design has none.
    """
    return _principal(at)[1]


def _principal(at: Linearisation) -> tuple[Array, Array]:
    """Determined directions (s, rank), one standard deviation long, and the effect of each on
    corrected points.
    """
    design, layout, found = at.design, at.layout, at.spectrum
    if not len(design.evaluation.points) or found.rank == 0:
        return np.zeros((len(layout), 0)), np.zeros(0)
    root = found.principal_root
    change = relative_changes(design, layout, root)
    # Two points whose errors are independent differ by the root of two times the error of one, per
    # co-ordinate.
    effect = np.sqrt(2.0 / change[:, :, 0].size) * change.reshape(-1, found.rank)
    return principal_directions(found.values[: found.rank], root, effect, found.scale)


def weak_limit(design: Design, target: Target | None) -> float:
    """The effect, in metres, beyond which a direction is weak."""
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
        description = _told(design, layout, *_signed(design, layout, root, still))
        weak = replace(
            description, artefacts=(), standard_deviation=size, points=len(design.evaluation.points)
        )
        directions.append(replace(weak, beyond=count, limit=limit))
    return tuple(directions)


def _signed(
    design: Design, layout: SharedLayout, shared: Array, balls: Array
) -> tuple[Array, Array]:
    """A direction less rounding, with the sign that makes the first of its changes a positive
    one.
    """
    shared, balls = _less_rounding(layout, shared, balls)
    told = _told(design, layout, shared, balls)
    if told.functions:
        first = told.functions[0].peak
    elif told.lengths:
        first = told.lengths[0].change
    else:
        every = np.concatenate([shared / layout.scale, balls.ravel()])
        first = float(every[comparable(np.abs(every)).argmax()])
    return (shared, balls) if first >= 0.0 else (-shared, -balls)


def _largest(layout: SharedLayout, shared: Array, balls: Array) -> float:
    """What a direction moves points by at the most, in metres."""
    parts = np.abs(shared / layout.scale), np.abs(balls)
    return max(float(part.max(initial=0.0)) for part in parts)


def _less_rounding(layout: SharedLayout, shared: Array, balls: Array) -> tuple[Array, Array]:
    """A direction with zeros for what is mere rounding."""
    least = ROUNDING * _largest(layout, shared, balls)
    return np.where(np.abs(shared / layout.scale) > least, shared, 0.0), np.where(
        np.abs(balls) > least, balls, 0.0
    )


def _told(design: Design, layout: SharedLayout, shared: Array, balls: Array) -> Direction:
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
        LengthPart(one.name, float(change), one.unit)
        for one, change in zip(design.influence_parameters, shared[layout.influences], strict=True)
        if above(abs(change) * one.effect, NEGLIGIBLE * largest)
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
    """The axis that a vector lies along, if it lies along one."""
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
        told = FunctionPart(name, parameter.meaning, peak, parameter.unit, form)
        parts.append((effect[members].max(), told))
    order = np.argsort(-comparable([size for size, _ in parts]), kind="stable")
    return tuple(parts[k][1] for k in order)


def shape(t: Array, values: Array) -> str:
    """Word for a curve's shape: the lowest degree of polynomial, up to 10, that describes it; none
    for a constant.

    >>> t = np.linspace(0, 1, 50)
    >>> shape(t, 3 * t), shape(t, t - t**2), shape(t, t**5), shape(t, 0 * t + 2)
    ('linear', 'quadratic', 'of degree 5', '')
    """
    if not np.ptp(values):
        return ""
    basis = np.polynomial.chebyshev.chebvander(2 * t - 1, HIGHEST)
    size = float(np.abs(values).max())
    for degree in range(1, HIGHEST + 1):
        part = basis[:, : degree + 1]
        left = values - part @ np.linalg.lstsq(part, values, rcond=None)[0]
        if np.abs(left).max() <= 1e-3 * size:
            return SHAPES.get(degree, f"of degree {degree}")
    return "irregular"


def deformation(places: Array, displacement: Array) -> str:
    """Words for how an artefact deforms, from ball places and their displacements, both (n, d).

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
    linear = np.linalg.lstsq(centred, moved, rcond=1e-9)[0].T
    rest = moved - centred @ linear.T
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
    if above((rest**2).sum(), 0.02 * total):
        out_of_plane = (
            d == 3
            and extent[2] == 0
            and above((rest[:, 2] ** 2).sum(), 0.5 * float((rest**2).sum()))
        )
        words.append("bends out of its plane" if out_of_plane else "distorts unevenly")
    return ", ".join(words) if words else "deforms"


def in_words(direction: Direction) -> str:
    """A direction as a sentence: what trades against what, and by how much."""
    parts = []
    if direction.functions:
        told = [_function_words(part) for part in direction.functions[:8]]
        more = len(direction.functions) - len(told)
        parts.append(", ".join(told) + (f" and {more} errors more" if more > 0 else ""))
    for artefact in direction.artefacts:
        parts.append(f"{artefact.name} {artefact.words} (balls by up to {length(artefact.peak)})")
    if direction.positions:
        told = [_position_words(part) for part in direction.positions[:6]]
        more = len(direction.positions) - len(told)
        parts.append(
            "moved positions: " + ", ".join(told) + (f" and {more} more" if more > 0 else "")
        )
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
    if np.isinf(direction.standard_deviation):
        end = (
            "change together without changing any observation"
            if len(parts) > 1
            else "changes no observation"
        )
    else:
        end = (
            f"known only to {length(direction.standard_deviation)} in corrected points, relative to"
            f" one another (root mean square over {direction.points} points; more than"
            f" {length(direction.limit)} at {direction.beyond} of them)"
        )
    return "; ".join(parts) + f": {end}"


def _function_words(part: FunctionPart) -> str:
    form = f", {part.shape}" if part.shape else ""
    return f"{part.name} ({part.meaning}{form}) by {_amount(part.peak, part.unit)}"


def _position_words(part: PositionPart) -> str:
    amounts = [length(part.shift) + part.along] if part.shift > 1e-12 else []
    amounts += [_amount(part.turn, "rad") + part.about] if part.turn > 1e-12 else []
    return f"{part.name} ({', '.join(amounts)})"


def length(value: float) -> str:
    """A small length in micrometres.

    >>> length(2.5e-7)
    '0.25 µm'
    """
    return _amount(value, "m")


def _amount(value: float, unit: str) -> str:
    """A small value in the unit it reads well in, without an exponent below a million.

    >>> _amount(8.12e-3, "K"), _amount(1.234e-3, "m"), _amount(2e-9, "rad")
    ('8.12 mK', '1230 µm', '0.002 µrad')
    """
    shown = {"m": "µm", "rad": "µrad", "1": "ppm", "1/K": "ppm/K", "K": "mK"}
    shown |= {"m/h": "µm/h", "1/h": "ppm/h"}
    amount = (1e3 if unit == "K" else 1e6) * value
    text = f"{printable(amount):.3g}"
    return (
        f"{float(text):.0f} {shown[unit]}"
        if "e+" in text and abs(amount) < 1e6
        else f"{text} {shown[unit]}"
    )


def changed_names(direction: Direction) -> list[str]:
    """Errors that a direction changes, or else what it changes instead."""
    if direction.functions:
        return [part.name for part in direction.functions]
    artefacts, lengths = (
        [part.name for part in direction.artefacts],
        [part.name for part in direction.lengths],
    )
    return [
        *artefacts,
        *lengths,
        *(part.name for part in (*direction.probes, *direction.positions)),
    ]
