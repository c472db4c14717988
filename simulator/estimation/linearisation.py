"""Linearisation of an experiment at a state: layout, factor, spectrum and covariance together; the
same with some parameters held; and linear functions, whose uncertainties it gives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.computing.numerics import blank
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.parameters import SharedLayout, shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.inputs.number_arrays import Array, Integers

from .covariance import MICROMETRE, BallCovariance, Spectrum, ball_covariance, in_order, spectrum
from .elimination import Factor, eliminate, ensure_own_rows


@dataclass(frozen=True, eq=False)
class LinearFunctions:
    """Derivatives of m functions: `shared` (m, s) by the shared parameters, `balls` (m, n, d) by
    those of all balls, if any ball contributes; `drawn` are the same for the nominal design, if
    that differs.
    """

    shared: Array
    balls: Array | None = None
    drawn: LinearFunctions | None = None


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A design at a `state`, with its `factor` and `spectrum` there.

    Square roots of covariances are in units of the standard deviation of a unit-weight
    observation. After a fit, the undetermined directions are those of the nominal design: `drawn`
    is then the linearisation there, at whose state functions are tested for changes along null
    directions, and `implied` counts certified values that follow from others.
    """

    design: Design
    layout: SharedLayout
    state: State
    factor: Factor
    spectrum: Spectrum
    drawn: Linearisation | None = None
    implied: int = 0

    @property
    def deficiency(self) -> int:
        """Number of undetermined directions of the shared parameters.

        :raises UnusableError: a ball has fewer rows of its own than co-ordinates.
        """
        self.design.once(ensure_own_rows)
        return self.spectrum.deficiency

    @property
    def degrees_of_freedom(self) -> int:
        """Observations less the parameters that they determine."""
        # An undetermined direction uses up no observation.
        return self.count - self.design.parameter_count + self.deficiency

    @property
    def count(self) -> int:
        """Number of scalar observations that have errors of their own."""
        return self.design.observation_count - self.implied

    @property
    def rank(self) -> int:
        return len(self.layout) - self.deficiency

    @property
    def as_drawn(self) -> Linearisation:
        """The linearisation whose null directions are the undetermined ones."""
        return self.drawn or self

    @cached_property
    def shared(self) -> Array:
        """Square root (s, rank) of the covariance of the shared parameters."""
        return self.spectrum.root

    @property
    def shared_null(self) -> Array:
        """Undetermined directions (s, deficiency) of the shared parameters."""
        return self.as_drawn.spectrum.null

    @cached_property
    def balls(self) -> BallCovariance:
        """Square root of the covariance of the balls, computed on request, since it takes most of
        the time.
        """
        return ball_covariance(self.design, self.factor, self.spectrum)

    @property
    def ball_null(self) -> Array:
        """Motions of the balls along undetermined directions, (n, d, deficiency)."""
        return self.as_drawn.balls.null

    def of_shared(self, rows: Array, drawn: Array | None = None) -> Array:
        """Standard deviations (m,) of `rows` (m, s) applied to the shared parameters; NaN where
        open.

        `drawn` (m, s) are the same functions linearised nominal, if they are others there.
        """
        result = np.sqrt(((rows @ self.shared) ** 2).sum(axis=1))
        rows = rows if drawn is None else drawn
        # `blank` makes NaN of functions that null directions change by more than `TOUCHED` of their
        # size. Rounding leaves a change along null directions even of determined functions. It is
        # judged by the largest change of a function for a step of a micrometre in any direction.
        size = np.sqrt(((rows * self.as_drawn.spectrum.scale) ** 2).sum(axis=1))
        return blank(result, rows @ self.shared_null, size)

    def uncertainty(self, functions: LinearFunctions) -> Array:
        """Standard deviations (m,) of functions; NaN where open."""
        values = np.sqrt((self._root(functions) ** 2).sum(axis=1))
        as_drawn = functions.drawn or functions
        change = as_drawn.shared @ self.shared_null
        size = ((as_drawn.shared * self.as_drawn.spectrum.scale) ** 2).sum(axis=1)
        if as_drawn.balls is not None:
            change = change + np.einsum("mnd,ndk->mk", as_drawn.balls, self.ball_null)
            size = size + MICROMETRE**2 * (as_drawn.balls**2).sum(axis=(1, 2))
        return blank(values, change, np.sqrt(size))

    def covariance(self, functions: LinearFunctions, other_functions: LinearFunctions) -> Array:
        """Return covariances (m, k) of functions with others, without undetermined directions."""
        first, second = self._root(functions), self._root(other_functions)
        # Functions without balls have only the first columns, of the shared parameters. The others
        # are normal variables of their own, uncorrelated with these.
        width = min(first.shape[1], second.shape[1])
        return np.asarray(first[:, :width] @ second[:, :width].T)

    def _root(self, functions: LinearFunctions) -> Array:
        """Return derivatives (m, r) by standard normal variables: shared ones, those of kept
        balls, those of each ball.
        """
        common = functions.shared @ self.shared
        if functions.balls is None:
            return np.asarray(common)
        of_balls = np.einsum("mnd,ndr->mr", functions.balls, self.balls.common)
        of_balls[:, : self.rank] += common
        own_part = np.einsum("mnd,ndj->mnj", functions.balls, self.balls.own)
        return np.concatenate([of_balls, own_part.reshape(len(own_part), -1)], axis=1)

    def of_balls(self) -> Array:
        """Standard deviations (n, d) of the ball co-ordinates; NaN where open."""
        result = np.sqrt((self.balls.common**2).sum(axis=2) + (self.balls.own**2).sum(axis=2))
        return blank(result, self.ball_null, np.full(result.shape, MICROMETRE))


@single_threaded
def linearise(
    design: Design,
    state: State | None = None,
    x: Array | None = None,
    drawn: Spectrum | None = None,
) -> Linearisation:
    """Linearise a design at a `state`, nominal by default, with scale readings `x` (readings, d)
    or error-free ones. With a spectrum `drawn` rank and null space are those, see `spectrum`.

    >>> import ballplate as bp
    >>> linearise(bp.lay_out(bp.quickstart())).rank
    99
    """
    state = nominal_state(design) if state is None else state
    layout = design.once(shared_layout)
    factor = eliminate(design, layout, state, x)
    return Linearisation(design, layout, state, factor, spectrum(factor, drawn))


@single_threaded
def holding(at: Linearisation, held: Integers) -> Linearisation:
    """Return a linearised design with the shared parameters of columns `held` (m,) exactly known.

    No ball is eliminated again. The parameters keep their columns, without uncertainty; quantities
    are those of the design in which they are no parameters. Steps from the result are meaningless.
    """
    factor = _holding(at.factor, held)
    found = spectrum(factor)
    # A held parameter has an uncertainty of zero in every root: those formed of the triangle are
    # multiplied by this scale, and `known` directions are cleared.
    free = np.ones(len(at.layout))
    free[held] = 0.0
    known = None if found.known is None else free[:, None] * found.known
    return replace(
        at, factor=factor, spectrum=replace(found, scale=free * found.scale, known=known)
    )


def _holding(factor: Factor, held: Integers) -> Factor:
    scale, count = factor.layout.scale, len(held)
    # The orthogonal transformations that eliminated the balls did not depend on the shared columns.
    # So a column may be deleted afterwards: the rest of the root is that of the design without the
    # parameter, and needs to be made triangular again. Columns of zeros keep the places of the
    # others, and a row of its own keeps each from counting as undetermined.
    rows = in_order(factor) * scale
    rows[:, held] = 0.0
    # As heavy as the heaviest row: neither undetermined nor the measure of what is.
    exact = np.zeros((count, len(scale)))
    exact[np.arange(count), held] = np.abs(rows).max(initial=0.0) or 1.0
    free = np.ones(len(scale))
    free[held] = 0.0
    changed = replace(
        factor, ball_shared=factor.ball_shared * free, kept_shared=factor.kept_shared * free
    )
    if factor.orders is None or factor.alike is None:
        # The triangle's columns before the first that is held stay as they are.
        start = int(held.min(initial=len(scale)))
        below = np.concatenate([rows, exact])[start:, start:]
        rows[start:, start:] = np.linalg.qr(below, mode="r")
        return replace(changed, root=rows / scale)
    from .graded import triangle

    found = triangle(np.concatenate([rows, exact]), np.zeros((len(rows) + count, 0)))
    return replace(
        changed,
        root=found.root / scale[found.order],
        orders=replace(factor.orders, shared=found.order),
        alike=_holding(factor.alike, held),
    )
