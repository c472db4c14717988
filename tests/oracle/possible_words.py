"""Whether a sentence on an undetermined direction can be true, parts that are not printed included.

A linear programme looks among all changes of parameters that no observation shows for one with the
printed amounts of errors, with no larger ones of positions and plates, and with nothing unnamed that
is large enough to be printed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from tests.oracle.campaigns import AXES
from tests.oracle.null_words import DEGREES, POSE_AMOUNT, Directions, Sentence, amount_of

Real = NDArray[np.float64]

# A direction is printed with its largest part at 1 µm, and without parts below one hundredth.
LARGEST = 1e-6
UNPRINTED = 0.01 * LARGEST
# A curve has the lowest degree that describes it to this share of its largest value.
SHAPELESS = 1e-3
# A vector lies along an axis to 0.999 of its length, and across it by this at the most.
ACROSS = 0.0448
# Less of a shift or turn is none, in metres and radians.
NO_MOTION = 1e-12
# Of what is wanted, and of each limit: rounding of the solution.
ROUNDING = 1e-3
# Where curves of the third degree may be largest, among 201 places.
PLACES = (42, 67, 100, 133, 158, 200)


class Possible:
    """The null directions that a sentence may be about: limits of linear functions of them."""

    def __init__(self, directions: Directions, sentence: Sentence):
        self.basis = np.linalg.qr(directions.null * directions.size[:, None])[0]
        self.parameters = self.basis / directions.size[:, None]
        self.rows: list[Real] = []
        self.limits: list[Real] = []
        self.curves: dict[str, Real] = {}
        # How large each curve, with the sign that makes its largest value positive, has to be.
        self.wanted: dict[str, float] = {}
        self._unnamed(directions, sentence)
        self._motions(directions, sentence)
        for name, told in sentence.functions.items():
            self._curve(directions.curve(self.parameters, name), name, *told)

    def below(self, change: Real, limit: float | Real) -> None:
        """Limit the sizes of linear functions (m, k)."""
        self.rows += [change, -change]
        self.limits += [np.broadcast_to(limit, len(change))] * 2

    def _unnamed(self, directions: Directions, sentence: Sentence) -> None:
        of_errors = np.array([kind == "function" for kind, _, _ in directions.owner])
        limits = np.where(directions.allowed(sentence), LARGEST, UNPRINTED)
        self.below(self.basis[~of_errors], limits[~of_errors])
        for function in directions.problem.functions:
            if function.name in sentence.functions or sentence.more_functions:
                continue
            # Each coefficient moves a point by less, at the end of an arm.
            most = UNPRINTED * function.free / (directions.span if function.turns else 1.0)
            self.below(directions.curve(self.parameters, function.name)[::5], most)

    def _motions(self, directions: Directions, sentence: Sentence) -> None:
        for name, told in sentence.positions.items():
            pose = directions.pose(self.parameters, name)
            left = {"µm": pose[:3], "µrad": pose[3:]}
            for figure, unit, _, axis in POSE_AMOUNT.findall(told):
                part, most = left.pop(unit), sum(amount_of(figure, unit))
                self.below(part, most)
                if axis:
                    self.below(np.delete(part, AXES.index(axis), axis=0), ACROSS * most)
            for part in left.values():
                self.below(part, NO_MOTION)
        for name, (_, figure, unit) in sentence.plates.items():
            moved = directions.balls(self.parameters, name)[1]
            self.below(moved, sum(amount_of(figure, unit)))

    def _curve(self, curve: Real, name: str, shape: str, figure: str, unit: str) -> None:
        amount, half = amount_of(figure, unit)
        self.below(curve[::5], abs(amount) + half)
        t = np.linspace(0.0, 1.0, len(curve))
        fit = np.linalg.qr(t[:, None] ** np.arange(DEGREES[shape] + 1))[0]
        self.below((curve - fit @ (fit.T @ curve))[::5], SHAPELESS * (abs(amount) + half))
        self.curves[name] = np.sign(amount) * curve
        self.wanted[name] = abs(amount) - half

    def lacking(self, at: dict[str, int]) -> tuple[float, Real]:
        """How much curves at some places lack of what is wanted of them, relative, at the least,
        and the mixture (k,) that comes nearest.
        """
        n, count = self.basis.shape[1], len(at)
        rows, limits = np.vstack(self.rows), np.concatenate(self.limits) * (1 + ROUNDING)
        reached = np.array([self.curves[name][place] for name, place in at.items()])
        least = np.array([self.wanted[name] for name in at])
        both = np.block(
            [[rows, np.zeros((len(rows), count))], [-reached.reshape(count, n), -np.eye(count)]]
        )
        found = linprog(
            np.r_[np.zeros(n), LARGEST / least],
            A_ub=both,
            b_ub=np.r_[limits, -least] / LARGEST,
            bounds=[(None, None)] * n + [(0.0, None)] * count,
        )
        assert found.success, found.message
        return float(found.fun), found.x[:n]

    def nearest(self, at: dict[str, int]) -> tuple[float, dict[str, int]]:
        """The same where each curve is largest in turn."""
        least, mixture = self.lacking(at)
        while least > ROUNDING:
            moved = {name: int((curve @ mixture).argmax()) for name, curve in self.curves.items()}
            left, mixture = self.lacking(moved)
            if left > least - ROUNDING:
                break
            least, at = left, moved
        return least, at


def is_possible(directions: Directions, sentence: Sentence) -> bool:
    """Whether some null direction is what a sentence says."""
    programme = Possible(directions, sentence)
    # The words do not say where a curve is largest; it starts where the directions move it most.
    start = {
        name: int(np.linalg.norm(curve, axis=1).argmax())
        for name, curve in programme.curves.items()
    }
    least, at = programme.nearest(start)
    for name in [name for name, told in sentence.functions.items() if told[0] != "linear"]:
        for place in PLACES:
            if least <= ROUNDING:
                return True
            other, places = programme.nearest(at | {name: place})
            if other < least - ROUNDING:
                least, at = other, places
    return least <= ROUNDING
