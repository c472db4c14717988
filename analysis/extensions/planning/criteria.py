"""Criteria that a plan minimises: uncertainties that do not depend on the frame.

Every criterion is a standard uncertainty, or a mean or a largest of some, and falls with the root
of the information: all of it fourfold makes it half. The reciprocal of its square is then a concave
function of the information, so that a tangent bounds what any selection can reach. A largest value
is no smooth function; it is bounded by a weighted mean, whose weights are on the largest ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, compress

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.estimation import (
    BallPlaces,
    Combinations,
    Distances,
    MeasuredPoints,
    point_rows,
)
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import without_rigid_motion
from ballplate.simulator.inputs import Flags, Target, refused
from ballplate.simulator.machines import Array
from ballplate.uncertainty import QUANTITIES, functions_of

from .candidate_rows import STEP
from .information import Information

CriterionName = str

MAXIMUM = "-maximum"

# Quantities of lengths, the first of which is what a plan makes small unless told.
_LENGTHS = [symbol for symbol, kind in QUANTITIES.items() if kind.are_lengths]
_LENGTHS.sort(key=lambda symbol: not QUANTITIES[symbol].has_target)

DESCRIPTIONS: dict[CriterionName, str] = {}
for _symbol in _LENGTHS:
    _words = QUANTITIES[_symbol].description
    if QUANTITIES[_symbol].by_limits:
        DESCRIPTIONS[_symbol] = f"largest share of what the limits of {_words} leave to the map"
        continue
    DESCRIPTIONS[_symbol] = f"average uncertainty of {_words}"
    DESCRIPTIONS[_symbol + MAXIMUM] = f"largest uncertainty of {_words}"
DESCRIPTIONS |= {
    "A": "root mean square uncertainty of the machine's parameters",
    "D": "geometric mean of the semi-axes of the parameters' uncertainty ellipsoid",
    "E": "uncertainty of the least certain direction of the machine's parameters",
    "condition": (
        "ratio of the uncertainties of the least and the most certain direction of the parameters"
    ),
}
NAMES: tuple[CriterionName, ...] = tuple(DESCRIPTIONS)

# Powers that put the weight of a largest value's bound on the largest ones.
SHARP = 24

# A function counts as open when what the pool leaves open changes it by this, in micrometres for a
# micrometre.
OPEN = 1e-7

# Places in each direction of a block of pairs, whose matrices stay in cache, and up to which blocks
# are kept.
BLOCK = 256
MOST_PLACES_KEPT = 1024

# Evaluation points between all of which a plan can make distances small: thousands of times in a
# search, which with so many takes two minutes on one processor, and ten of a large pool; it grows
# with the square of their number.
MOST_POINTS = 1000

# Functions whose uncertainties are kept, rather than computed twice, for the tangent of a largest
# value.
KEPT = 4_000_000


@dataclass(frozen=True)
class Criterion:
    """A criterion by its `name`: the mean of `functions`, or their largest if `largest`.

    `about_balls` states if it concerns all z or only those of shared parameters. `excluded` counts
    functions that the pool cannot determine. Criteria of eigenvalues have no `functions`; theirs
    are of the model's parameters, `scaled` (n, z), in metres. `target` is the criterion at which
    the target uncertainty is met on average, if there is a target. `needed` holds, by artefact
    whose own distances count, the candidates that set it up: without one of these, the distances
    are undetermined in spite of certificates.
    """

    name: CriterionName
    about_balls: bool
    functions: Several | None
    scaled: Array
    excluded: int = 0
    target: float | None = None
    needed: tuple[tuple[str, tuple[int, ...]], ...] = ()

    @property
    def largest(self) -> bool:
        return self.name.endswith(MAXIMUM) or _is_by_limits(self.name)

    @property
    def unit(self) -> str:
        return "1" if self.name == "condition" or _is_by_limits(self.name) else "m"

    @property
    def is_bounded(self) -> bool:
        """True if a convex relaxation bounds it."""
        return self.name != "condition"

    def value(self, root: Array) -> float:
        """Value in metres, or a ratio, where root root' is the covariance of z."""
        if self.functions is not None:
            uncertainties = self.functions.uncertainties(root)
            if self.largest:
                return max(float(some.max(initial=0.0)) for some in uncertainties)
            return sum(float(some.sum()) for some in uncertainties) / self.functions.count
        sizes = svd(self.scaled @ root, compute_uv=False)
        if self.name == "A":
            return float(np.sqrt((sizes**2).mean()))
        if self.name == "D":
            return float(np.exp(np.log(np.maximum(sizes, np.finfo(float).tiny)).mean()))
        return float(sizes[0]) if self.name == "E" else float(sizes[0] / sizes[-1])

    @property
    def is_sharp(self) -> bool:
        """True if it is a largest value, represented by a mean of high power."""
        return self.largest or self.name == "E"

    def tangent(self, root: Array, power: float = SHARP) -> tuple[float, float, Array]:
        """A smooth function near the criterion; a value no larger than it; the derivative (z, z) of
        this by the covariance.

        The value is a mean with fixed weights, which is a bound for any selection: of all
        functions, or mostly of the largest. The smooth function is the mean of that `power`; its
        logarithm and that of the value have the same derivative.
        """
        if self.functions is not None:
            return (
                _largest_tangent(self.functions, root, power)
                if self.largest
                else _mean_tangent(self.functions, root)
            )
        left_vectors, sizes, _ = svd(self.scaled @ root, full_matrices=False)
        n, value = len(sizes), self.value(root)
        if self.name == "A":
            return value, value, self.scaled.T @ self.scaled / (2 * n * value)
        if self.name == "D":
            half = (left_vectors / sizes).T @ self.scaled
            return value, value, value / (2 * n) * half.T @ half
        # A weighted mean of variances with any fixed weights is at most the largest of them, and so
        # bounds it from below for every selection. Powers put the weights on the largest ones here.
        relative = sizes / sizes[0]
        weights = relative**power / (relative**power).sum()
        value = float(np.sqrt(weights @ sizes**2))
        smooth = float(sizes[0] * (relative ** (power + 2)).mean() ** (1 / (power + 2)))
        half = (left_vectors * np.sqrt(weights)).T @ self.scaled
        return smooth, value, half.T @ half / (2 * value)


def _mean_tangent(functions: Several, root: Array) -> tuple[float, float, Array]:
    def weigh(uncertainties: Array) -> Array:
        return np.stack([_halved(np.ones(len(uncertainties)), uncertainties), uncertainties])

    (_, total), squares = functions.squares(functions.uncertainties(root), weigh)
    value = float(total) / functions.count
    return value, value, squares / functions.count


def _largest_tangent(functions: Several, root: Array, power: float) -> tuple[float, float, Array]:
    uncertainties: Iterable[Array] = functions.uncertainties(root)
    uncertainties = list(uncertainties) if functions.count <= KEPT else uncertainties
    largest = max(float(some.max(initial=0.0)) for some in uncertainties)
    size = max(largest, np.finfo(float).tiny)

    def weigh(some: Array) -> Array:
        relative = some / size
        # Weights that a mean of this power has as its derivative: with them fixed, the weighted
        # mean is a bound for the largest value.
        weights = relative ** (power - 1)
        return np.stack([_halved(weights, some), weights, weights * some, relative**power])

    again = uncertainties if isinstance(uncertainties, list) else functions.uncertainties(root)
    (_, weight, weighted, powers), squares = functions.squares(again, weigh)
    return (
        largest * float(powers / functions.count) ** (1 / power),
        float(weighted / weight),
        squares / weight,
    )


def _halved(weights: Array, uncertainties: Array) -> Array:
    """Return half of `weights` for each uncertainty; exact functions stay exact."""
    is_positive = uncertainties > 0.0
    return np.where(is_positive, 0.5 * weights, 0.0) / np.where(is_positive, uncertainties, 1.0)


@dataclass(frozen=True)
class Linear:
    """Functions with rows (count, z), in metres, for lengths `sizes` (count,).

    `excluded` counts functions that the pool cannot determine. `targets` are optional targets of
    single functions.
    """

    rows: Array
    sizes: Array
    excluded: int = 0
    targets: tuple[Target | None, ...] = ()

    @property
    def count(self) -> int:
        return len(self.rows)

    def lengths(self) -> Iterator[Array]:
        yield self.sizes

    def uncertainties(self, root: Array) -> Iterator[Array]:
        yield np.linalg.norm(self.rows @ root, axis=1)

    def squares(
        self, uncertainties: Iterable[Array], weigh: Callable[[Array], Array]
    ) -> tuple[Array, Array]:
        values = next(iter(uncertainties))
        weighed = weigh(values)
        return weighed.sum(axis=1), (self.rows * weighed[0][:, None]).T @ self.rows


@dataclass(frozen=True)
class PairBlock:
    """Pairs of two runs of points, `first` (rows) and `second` (columns).

    `chosen` (rows, columns) selects pairs, `length` (rows, columns) is their distance, and
    `weights` have, for components i and j >= i, the products of these components of all
    directions, those of i < j doubled.
    """

    first: slice
    second: slice
    chosen: Flags
    length: Array
    weights: tuple[tuple[int, int, Array], ...]


@dataclass(frozen=True)
class Pairs:
    """Distances between all pairs of separate points, except those that the pool cannot determine.

    `places` (n, d) in metres; `displacement` (n, d, z) is theirs, `open_` (n, d, k) the part that
    the pool leaves undetermined, both without the motion of all points together. Blocks of bounded
    size limit memory.
    """

    places: Array
    displacement: Array
    open_: Array

    @cached_property
    def _counts(self) -> tuple[int, int]:
        """Numbers of counted pairs and of undetermined pairs."""
        chosen = apart = 0
        for block in self._blocks():
            chosen += int(block.chosen.sum())
            apart += int(self._apart(block.first, block.second)[1].sum())
        return chosen, apart - chosen

    @property
    def count(self) -> int:
        return self._counts[0]

    @property
    def excluded(self) -> int:
        """Number of pairs of separate points that every selection leaves undetermined."""
        return self._counts[1]

    @cached_property
    def _kept(self) -> tuple[PairBlock, ...]:
        return tuple(self._made())

    def _blocks(self) -> Iterable[PairBlock]:
        return self._kept if len(self.places) <= MOST_PLACES_KEPT else self._made()

    def _made(self) -> Iterator[PairBlock]:
        n = len(self.places)
        runs = [slice(start, min(start + BLOCK, n)) for start in range(0, n, BLOCK)]
        for i, first in enumerate(runs):
            for second in runs[i:]:
                yield self._block(first, second)

    def _apart(self, first: slice, second: slice) -> tuple[Array, Flags]:
        """Return vectors (rows, columns, d) between points, and a mask that selects each distance
        once.
        """
        vector = self.places[first, None] - self.places[None, second]
        apart = (vector**2).sum(axis=2) > 0.0
        return vector, np.triu(apart, 1) if first == second else apart

    def _block(self, first: slice, second: slice) -> PairBlock:
        vector, chosen = self._apart(first, second)
        length = np.linalg.norm(vector, axis=2)
        change = np.zeros_like(length)
        for k in range(self.open_.shape[2]):
            moved = self.open_[first, None, :, k] - self.open_[None, second, :, k]
            np.maximum(change, np.abs((vector * moved).sum(axis=2)), out=change)
        chosen &= change <= OPEN * STEP * np.where(length > 0.0, length, 1.0)
        vector /= np.where(length > 0.0, length, 1.0)[:, :, None]
        d = self.places.shape[1]
        weights = tuple(
            (i, j, (1.0 if i == j else 2.0) * vector[:, :, i] * vector[:, :, j])
            for i in range(d)
            for j in range(i, d)
        )
        return PairBlock(first, second, chosen, length, weights)

    def lengths(self) -> Iterator[Array]:
        for block in self._blocks():
            yield block.length[block.chosen]

    def uncertainties(self, root: Array) -> Iterator[Array]:
        n, d = self.places.shape
        spread = (self.displacement.reshape(n * d, -1) @ root).reshape(n, d, -1)
        # As in `ballplate.uncertainty`, the variance of a distance is that of both ends less twice
        # their covariance, by components, so that a block is a few products of matrices.
        products = [[(spread[:, i] * spread[:, j]).sum(axis=1) for j in range(d)] for i in range(d)]
        for block in self._blocks():
            first, second = spread[block.first], spread[block.second]
            total = np.zeros(block.length.shape)
            for i, j, weight in block.weights:
                apart = products[i][j][block.first, None] + products[i][j][None, block.second]
                product = first[:, i] @ second[:, j].T
                apart -= product
                apart -= product if i == j else first[:, j] @ second[:, i].T
                apart *= weight
                total += apart
            yield np.sqrt(np.maximum(total[block.chosen], 0.0))

    def squares(
        self, uncertainties: Iterable[Array], weigh: Callable[[Array], Array]
    ) -> tuple[Array, Array]:
        sums = []
        # The squares' sum is that of displacements times these.
        moved = np.zeros_like(self.displacement)
        # What follows belongs to other functions.
        for block, squared in zip(self._blocks(), uncertainties, strict=False):
            weighed = weigh(squared)
            sums.append(weighed.sum(axis=1))
            weights_of_block = np.zeros(block.length.shape)
            weights_of_block[block.chosen] = weighed[0]
            first_moves, second_moves = (
                self.displacement[block.first],
                self.displacement[block.second],
            )
            for i, j, weight in block.weights:
                amount = weights_of_block * weight
                moved[block.first, i] += (
                    amount.sum(axis=1)[:, None] * first_moves[:, j] - amount @ second_moves[:, j]
                )
                moved[block.second, i] += (
                    amount.sum(axis=0)[:, None] * second_moves[:, j] - amount.T @ first_moves[:, j]
                )
        size = self.displacement.shape[2]
        total = self.displacement.reshape(-1, size).T @ moved.reshape(-1, size)
        return np.sum(sums, axis=0), 0.5 * (total + total.T)


@dataclass(frozen=True)
class Several:
    """Quantities whose uncertainties count, as functions of z of several kinds, one after the
    other; each in blocks of constant order.
    """

    parts: tuple[Pairs | Linear, ...]

    @property
    def excluded(self) -> int:
        return sum(part.excluded for part in self.parts)

    @property
    def count(self) -> int:
        return sum(part.count for part in self.parts)

    def lengths(self) -> Iterator[Array]:
        """Lengths (some,) in metres that the functions are uncertainties of."""
        return chain.from_iterable(part.lengths() for part in self.parts)

    def uncertainties(self, root: Array) -> Iterator[Array]:
        """Standard uncertainties (some,) in metres, where root root' is the covariance of z."""
        return chain.from_iterable(part.uncertainties(root) for part in self.parts)

    def squares(
        self, uncertainties: Iterable[Array], weigh: Callable[[Array], Array]
    ) -> tuple[Array, Array]:
        """Return sums over all functions: (m,) of `weigh` of their uncertainties (some,), namely
        (m, some), and of their squares (z, z) weighted by the first.
        """
        iterator = iter(uncertainties)
        by_part = [part.squares(iterator, weigh) for part in self.parts]
        return np.sum([sums for sums, _ in by_part], axis=0), np.sum(
            [squares for _, squares in by_part], axis=0
        )


def _is_by_limits(name: CriterionName) -> bool:
    return name in QUANTITIES and QUANTITIES[name].by_limits


def is_about_balls(name: CriterionName) -> bool:
    """True if a criterion needs all balls, beyond their information on the machine."""
    kind = QUANTITIES.get(name.removesuffix(MAXIMUM))
    return kind is not None and kind.about_balls


def refuse_many_points(experiment: Experiment, name: CriterionName) -> None:
    """Refuse more evaluation points than a search can go through.

    :raises ExperimentError: there are more than 1000 and the criterion concerns them.
    """
    count = len(experiment.evaluation.points)
    if name.startswith("U6") and count > MOST_POINTS:
        text = (
            f"{count} points make {count * (count - 1) // 2} distances, which a search for {name}"
            f" computes some thousand times, which takes too long; give at most {MOST_POINTS},"
            " better some hundred, or plan for tasks"
        )
        raise refused(experiment.source, text, "evaluation.points")


def criterion(information: Information, experiment: Experiment, name: CriterionName) -> Criterion:
    """A criterion for a pool.

    :raises ExperimentError: it is about something that the experiment does not have, or that no
        selection determines.
    """
    drawn = information.drawn
    scaled = np.zeros((0, information.basis.size))
    functions = None
    needed = []
    symbol = name.removesuffix(MAXIMUM)
    kind = QUANTITIES.get(symbol)
    if kind is None:
        model = slice(0, len(drawn.design.model.parameters))
        is_determined = np.abs(information.open_[model]).max(axis=1, initial=0.0) <= OPEN
        if not is_determined.all():
            text = f"{name} includes parameters that even all candidates leave undetermined"
            raise refused(experiment.source, text, "pool")
        scaled = _of_shared(information, STEP * np.eye(drawn.shared)[model])
    else:
        parts = list[Pairs | Linear]()
        for quantity_functions in functions_of(symbol, drawn.design, drawn.layout):
            if isinstance(quantity_functions, Combinations):
                parts.append(_combinations(information, experiment, quantity_functions))
                continue
            assert isinstance(quantity_functions, Distances)
            if isinstance(quantity_functions.places, BallPlaces):
                plate = drawn.design.artefacts.names[
                    drawn.design.balls.artefact[quantity_functions.places.index[0]]
                ]
                placing = information.placing(plate)
                if not placing:
                    continue
                needed.append((plate, placing))
            parts.append(_distances(information, quantity_functions))
        functions = Several(tuple(parts))
        if not functions.count:
            reason = "no selection determines any of it; offer other candidates"
            lacks = reason if functions.excluded else f"the experiment has no {kind.needs}"
            text = f"{name} has no function to minimise: {lacks}"
            raise refused(experiment.source, text, "pool")
    excluded = 0 if functions is None else functions.excluded
    target = _target(experiment, name, functions)
    return Criterion(name, is_about_balls(name), functions, scaled, excluded, target, tuple(needed))


def _target(experiment: Experiment, name: CriterionName, functions: Several | None) -> float | None:
    """Return the target uncertainty of the functions (their own or the file's): its mean for an
    average, and for a largest value only a constant one; absent unless all functions have one.
    """
    if functions is None:
        return None
    if _is_by_limits(name):
        return 1.0
    parts = functions.parts
    stated_targets = [
        target for part in parts if isinstance(part, Linear) for target in part.targets
    ]
    of_file = QUANTITIES[name.removesuffix(MAXIMUM)].has_target
    targets = stated_targets or ([experiment.target_uncertainty] if of_file else [])
    known_targets = [target for target in targets if target is not None]
    if not known_targets or len(known_targets) < len(targets):
        return None
    if name.endswith(MAXIMUM):
        standards = {target.standard for target in known_targets}
        only = next(iter(standards))
        return only.constant if len(standards) == 1 and only.slope == 0 else None
    if stated_targets:
        lengths = np.concatenate(list(functions.lengths()))
        return float(
            np.mean([target.at(some) for target, some in zip(known_targets, lengths, strict=True)])
        )
    return (
        sum(float(known_targets[0].at(some).sum()) for some in functions.lengths())
        / functions.count
    )


def _of_shared(information: Information, rows: Array) -> Array:
    """Rows (m, z) of the shared part of z from rows (m, c) of shared columns."""
    return rows @ information.basis.shared_root


def _distances(information: Information, distances: Distances) -> Pairs | Linear:
    """Distances that the pool determines, between all points or named pairs."""
    point_places = distances.places
    places = point_places.at(information.drawn.design, information.drawn.state)
    moved = (
        _of_balls(information, point_places)
        if isinstance(point_places, BallPlaces)
        else _of_points(information, point_places)
    )
    # Without the motion of all places together, no digits are lost where distances are formed.
    displacement, open_ = (without_rigid_motion(places, amount) for amount in moved)
    if distances.pairs is None:
        return Pairs(places, displacement, open_)
    first, second = distances.pairs.T
    unit = places[first] - places[second]
    length = np.linalg.norm(unit, axis=1)
    unit /= length[:, None]
    change, rows = (
        np.einsum("md,mdz->mz", unit, matrix[first] - matrix[second])
        for matrix in (open_, displacement)
    )
    is_kept = np.abs(change).max(axis=1, initial=0.0) <= OPEN * STEP
    targets = tuple(compress(distances.targets, is_kept))
    return Linear(rows[is_kept], length[is_kept], int((~is_kept).sum()), targets)


def _combinations(
    information: Information, experiment: Experiment, combinations: Combinations
) -> Linear:
    """Members with a limit that the pool determines, as shares of what it leaves to them.

    :raises ExperimentError: a limit is below what no plan reduces.
    """
    allowed = combinations.allowed
    for i, name in enumerate(combinations.names):
        if (allowed[combinations.members(i)] <= 0.0).any():
            text = (
                f"no plan holds the limit of {name}, which is exceeded without any uncertainty of"
                " the map; widen it"
            )
            raise refused(experiment.source, text, "pool")
    limited = np.flatnonzero(~np.isnan(allowed))
    moved = _of_points(information, combinations.places)
    rows, change = (
        combinations.weights[limited] @ amount.reshape(combinations.weights.shape[1], -1)
        for amount in moved
    )
    size = abs(combinations.weights[limited]).sum(axis=1)
    is_kept = np.abs(change).max(axis=1, initial=0.0) <= OPEN * STEP * np.asarray(size).ravel()
    rows = rows[is_kept] / allowed[limited[is_kept], None]
    return Linear(rows, np.ones(len(rows)), int((~is_kept).sum()))


def _of_balls(information: Information, places: BallPlaces) -> tuple[Array, Array]:
    """Displacements of balls (n, d, z), and the undetermined part, in metres."""
    basis, n, d = information.basis, len(places.index), information.drawn.design.dimension
    amounts = basis.balls[places.index].reshape(n * d, -1)
    displacement = basis.rows(amounts, np.zeros((n * d, information.drawn.shared)))
    open_ = np.concatenate([basis.ball_open, -basis.ball_shared @ information.open_], axis=1)
    return STEP * displacement.reshape(n, d, -1), STEP * (amounts @ open_).reshape(n, d, -1)


def _of_points(information: Information, places: MeasuredPoints) -> tuple[Array, Array]:
    """Displacements of corrected points (n, d, z), and the undetermined part, in metres."""
    drawn, (n, d) = information.drawn, places.points.shape
    rows = np.zeros((n * d, drawn.shared))
    for some, matrix in point_rows(drawn.design, drawn.layout, drawn.state, places):
        point_matrix = matrix[:, :, drawn.columns].reshape(-1, len(drawn.columns))
        rows[some.start * d : some.start * d + len(point_matrix), : point_matrix.shape[1]] = (
            point_matrix
        )
    rows *= drawn.scale
    return _of_shared(information, rows).reshape(n, d, -1), (rows @ information.open_).reshape(
        n, d, -1
    )
