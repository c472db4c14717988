"""Qualifications: what the figures of a prediction take for granted, decided for all outputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ballplate.presentation.formatting import Data, picked
from ballplate.simulator.inputs.settings import number_of
from ballplate.uncertainty.scale import Scale

from .extension_results import PredictedAssumptions
from .text_blocks import scale_warnings

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment


@dataclass(frozen=True)
class Qualification:
    """A condition of figures and verdicts: a noun, `given`, for their own line, and a line of
    `text`.
    """

    kind: Literal["undetermined", "scale", "assumption", "map", "reach"]
    given: str
    text: str


def qualifications_of(
    deficiency: int,
    scale: Scale | None,
    assumptions: PredictedAssumptions | None,
    experiment: Experiment | None,
) -> Iterator[Qualification]:
    """Yield the qualifications of a prediction: undetermined directions, scale that rests on exact
    offsets, assumptions that more than double U6, and lack of fit of the maps that it uses.
    """
    if deficiency:
        given = number_of(deficiency, "undetermined direction")
        yield Qualification("undetermined", given, f"warning: {given}")
    for text in scale_warnings(scale):
        yield Qualification("scale", "exact probe offsets as scale", text)
    for assumed, text in () if assumptions is None else assumptions.doubling:
        yield Qualification("assumption", assumed, text)
    for campaign in () if experiment is None else experiment.earlier_campaigns:
        if campaign.caution:
            text = f"warning: {campaign.file}: {campaign.caution}"
            yield Qualification("map", f"the map {campaign.file} in spite of its fit", text)


def given_words(qualified: Iterable[Qualification]) -> str:
    """Return the addition to a verdict; empty without qualifications.

    >>> given_words([Qualification("assumption", "rigid plates", "…")])
    ', given rigid plates'
    """
    words = ", ".join(dict.fromkeys(each.given for each in qualified))
    return words and f", given {words}"


def qualification_data(qualified: Iterable[Qualification]) -> list[Data]:
    """Return qualifications as plain data."""
    return [picked(each, "kind", "given", "text") for each in qualified]
