"""Reasons why a spline cannot be fitted, with locations in the caller's units."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class SplineProblem:
    """A fault and its remedy; `text` has {0}, {1}, … for the `places`, in metres or radians."""

    text: str
    places: tuple[float, ...] = ()

    def told(self, place: Callable[[float], str]) -> str:
        """Return the text with each location written by `place`.

        >>> SplineProblem("nothing beyond {0}", (0.25,)).told(lambda x: f"{1000 * x:g} mm")
        'nothing beyond 250 mm'
        """
        return self.text.format(*map(place, self.places))


class SplineError(ValueError):
    """A spline is impossible, undetermined, or evaluated outside its range; `problems` has all
    reasons.
    """

    def __init__(self, problems: Iterable[SplineProblem]) -> None:
        self.problems = tuple(problems)
        super().__init__(
            "; ".join(problem.told(lambda place: f"{place:g}") for problem in self.problems)
        )
