"""Contents of the page of a design: the results of all commands that evaluate a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ballplate.extensions.campaign.sheet import sheet_of
from ballplate.extensions.diagnosis.redundancy import reliability_of
from ballplate.extensions.maps.length_map import length_map
from ballplate.extensions.pages.design_page import DesignContents, design_page
from ballplate.extensions.pages.document import PageSection
from ballplate.extensions.pages.page_facts import assumptions, target_in_words, unjudged
from ballplate.results import Prediction, Wanted, checked_design
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.design import Design
from ballplate.simulator.experiment import Experiment, with_pool
from ballplate.simulator.inputs import service
from ballplate.uncertainty import Quantity

# Points along each axis of the map of lengths, in two and in three dimensions.
GRID = {2: (7, 7), 3: (5, 5, 5)}


def page_of_design(
    experiment: Experiment, prediction: Prediction, report: Report = unreported
) -> str:
    """Return the page of an experiment's design with its `prediction`; `report` receives the
    progress of the search for suggested changes and of the map of lengths.
    """
    design = prediction.design
    data: dict[str, Any] = {"run": prediction.to_dict()}
    data["lengths"] = length_map(experiment, GRID[design.dimension], report).to_dict()
    judged = prediction.verdict
    pool = with_pool(experiment) if judged.null or judged.weak else None
    checked = checked_design(experiment, pool, Wanted(repairs=pool is not None), report)
    data["check"] = checked.prediction.to_dict()
    reason = unjudged(design)
    if not reason:
        is_estimated = experiment.sigma == "estimated"
        judged_biases = reliability_of(
            design, sigma_is_estimated=is_estimated, experiment=experiment, report=report
        )
        data["reliability"] = judged_biases.to_dict()
    data["sheet"] = sheet_of(experiment).to_dict()
    contents = DesignContents(
        experiment.title,
        data,
        design,
        target_in_words(experiment),
        reason,
        experiment.source.name if experiment.name is None else experiment.label,
        assumptions(experiment, len(design.model.parameters)),
        part_sections(design, prediction.quantities),
    )
    return design_page(contents)


def part_sections(design: Design, quantities: Mapping[str, Quantity]) -> list[PageSection]:
    """Return the sections on the dimensions of the part of a design, if it has any."""
    part = quantities.get("dimensions")
    return [] if part is None else service("sections_of_part")(design, part)
