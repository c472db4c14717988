"""Entries of quantities that contradict themselves are refused by their symbol; targets of plans
are those of the quantity.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.planning.campaign_choice import Request, campaign
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.functions import Coordinates, Distances, Parameters
from ballplate.simulator.experiment.loading import with_pool
from ballplate.uncertainty.quantities import QUANTITIES, QuantityKind, evaluation_points

from tests.reference.small_quickstart import OF_ENTRIES

PAIR = np.array([[0, 1]])
POOL = {
    "candidates": [
        {
            "planes": ["z"],
            "levels": ["100 mm", "400 mm"],
            "corners": {"x": ["50 mm"], "y": ["50 mm"]},
            "probes": ["down"],
        }
    ]
}


def no_tuple(design: Design, layout: object) -> Any:
    return Distances(evaluation_points(design))


def no_name(design: Design, layout: object) -> Any:
    return (Distances(evaluation_points(design), PAIR),)


def no_point(design: Design, layout: object) -> Any:
    return (Distances(evaluation_points(design), 1000 * PAIR, ("one",)),)


def coordinates(design: Design, layout: object) -> Any:
    return (Coordinates(evaluation_points(design)),)


def two(design: Design, layout: object) -> Any:
    return 2 * (Distances(evaluation_points(design), PAIR, ("one",)),)


def parameters(design: Design, layout: Any) -> Any:
    return (Parameters(np.eye(len(layout)), ("one",), ("m",)),)


def one_parameter(design: Design, layout: Any) -> Any:
    return (Parameters(np.eye(len(layout))[:1], ("one",), ("m",)),)


WRONG = [
    (no_tuple, {}, "give a tuple"),
    (no_name, {}, "1 pairs, 0 names and 0 targets"),
    (no_point, {}, "not (m, 2) of places 0 to 199"),
    (coordinates, {"are_lengths": True}, "are_lengths applies to Distances and Combinations only"),
    (two, {}, "combine all in one"),
    (parameters, {}, "1 names and 1 units"),
    (one_parameter, {"effect": "something"}, "effect applies to"),
]


@pytest.mark.parametrize(("functions", "fields", "words"), WRONG)
def test_a_wrong_entry_is_refused_by_its_symbol(
    monkeypatch: pytest.MonkeyPatch,
    functions: Callable[..., Any],
    fields: Any,
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Not as an error of ballplate."""
    monkeypatch.setitem(QUANTITIES, "U9", QuantityKind("something", functions, **fields))
    assert main(["run", "designs/quickstart.yaml"]) == 3
    err = capsys.readouterr().err
    assert "quantity U9: " in err and words in err and "internal" not in err


@pytest.mark.parametrize("field", ["about_balls", "has_target"])
def test_targets_and_balls_are_of_lengths(field: str) -> None:
    with pytest.raises(ValueError, match="need are_lengths"):
        QuantityKind("something", coordinates, **{field: True})  # type: ignore[arg-type]


def target(criterion: str, **sections: Any) -> float | None:
    experiment = with_pool(bp.quickstart().with_(OF_ENTRIES).with_(pool=POOL, **sections))
    return campaign(experiment, Request(criterion)).target


def test_a_plan_has_the_target_of_its_quantity() -> None:
    constant = {"target_uncertainty": "3 um"}
    assert target("U6", **constant) == pytest.approx(3e-6)
    assert target("U6-maximum", **constant) == 3e-6
    assert target("U5", **constant) is None


def test_tasks_have_targets_of_their_own() -> None:
    ends = {"from": ["100 mm", "100 mm", "100 mm"], "to": ["500 mm", "100 mm", "100 mm"]}
    far = {"from": ["100 mm", "100 mm", "100 mm"], "to": ["100 mm", "900 mm", "100 mm"]}
    own = "1 um + L/1000000"
    tasks = [{"name": "near", **ends, "target_uncertainty": own}, {"name": "far", **far}]
    given = {"evaluation.tasks": tasks, "target_uncertainty": "3 um"}
    # 1.4 µm for 400 mm, and that of the file.
    assert target("tasks", **given) == pytest.approx(0.5 * (1.4e-6 + 3e-6))
    assert target("tasks-maximum", **given) is None
