"""Certified problems: their answers come out again in many digits, and ballplate's agree with
them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.results import fit, predict
from ballplate.simulator.experiment import lay_out, load
from ballplate.simulator.readings import read_readings
from ballplate.uncertainty import Quantity

from benchmarks.certified.experiment_text import files
from benchmarks.certified.make import dumped, made
from benchmarks.certified.problems import PROBLEMS

FOLDER = Path(__file__).parents[2] / "designs" / "certified"
NAMES = [make()["name"] for make in PROBLEMS]
# Those that take a second or less; the others take a minute or more each.
QUICK = (
    "two-dimensions",
    "bryan-gauge",
    "ball-bar",
    "bars-in-a-plane",
    "bryan-gauge-unknown-radius",
    "one-position",
)


def shipped(name: str) -> dict[str, Any]:
    problem: dict[str, Any] = json.loads(Path(FOLDER, f"{name}.json").read_text(encoding="utf-8"))
    return problem


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.long) for name in NAMES]
)
def test_answers_come_out_again(name: str) -> None:
    number = NAMES.index(name)
    text = dumped(made(PROBLEMS[number](), 1000 + number))
    assert text == Path(FOLDER, f"{name}.json").read_text(encoding="utf-8")


def test_every_problem_is_there_and_its_files_agree() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.json")) == sorted(NAMES)
    for name in NAMES:
        text = Path(FOLDER, f"{name}.json").read_text(encoding="utf-8")
        for other, content in files(json.loads(text, parse_float=str, parse_int=str)).items():
            assert Path(FOLDER, other).read_text(encoding="utf-8") == content


def test_built_and_computed_answers_agree() -> None:
    """The state that readings were built from, and the estimate in many digits, differ by rounding
    to femtometres.
    """
    for name in NAMES:
        problem = shipped(name)
        if "estimate" in problem["certified"]:
            estimate = problem["certified"]["estimate"]
            largest = max(u["maximum"] for u in estimate["uncertainties"].values())
            smallest = min(min(r["standard_uncertainty"]) for r in problem["readings"])
            assert estimate["built_within"] < 1e-14 * max(largest / smallest, 1.0)


def check_uncertainties(found: dict[str, Quantity], certified: dict[str, Any]) -> None:
    """Counts are right, and maxima and averages have nine digits."""
    for symbol, answer in certified.items():
        quantity = found[symbol]
        assert (quantity.count, quantity.undetermined) == (answer["count"], answer["undetermined"])
        for statistic in ("maximum", "average"):
            value = getattr(quantity, statistic)
            if answer["maximum"] is None:
                assert np.isnan(value)
            else:
                assert value == pytest.approx(answer[statistic], rel=1e-9), (symbol, statistic)


@pytest.mark.parametrize("name", NAMES)
def test_ranks_and_uncertainties_as_drawn(name: str) -> None:
    certified = shipped(name)["certified"]["as_drawn"]
    drawn = predict(load(FOLDER / f"{name}.yaml")[0])
    assert drawn.verdict.deficiency == certified["rank_deficiency"]
    check_uncertainties(drawn.quantities, certified["uncertainties"])


@pytest.mark.parametrize(
    "name", [name for name in NAMES if "estimate" in shipped(name)["certified"]]
)
def test_estimates_have_four_digits_of_their_uncertainty(name: str) -> None:
    certified = shipped(name)["certified"]["estimate"]
    experiment = load(FOLDER / f"{name}.yaml")[0]
    observed = read_readings(FOLDER / f"{name}.csv", lay_out(experiment))
    fitted = fit(experiment, observed, monomials=True)
    assert fitted.converged
    check_uncertainties(fitted.quantities, certified["uncertainties"])
    sum_of_squares = fitted.solution.factor.sum_of_squares
    assert sum_of_squares == pytest.approx(certified["sum_of_squares"], rel=1e-4)

    design, state = observed.design, fitted.solution.state
    reported = design.model.reported()
    machine = dict(zip(reported.names, (reported.matrix @ state.a).tolist(), strict=True))
    # Some coefficients are zero in any machine of the model.
    quoted = reported.matrix.any(axis=1)
    assert set(certified["machine"]) == {reported.names[k] for k in np.flatnonzero(quoted)}
    plates = [design.balls.of(k) for k in design.artefacts.plates]
    posed = [k for k in design.posed_positions if not design.positions.held[k].all()]
    estimates: list[tuple[str, Any, Any]] = [
        ("U3", [machine[key] for key in certified["machine"]], [*certified["machine"].values()]),
        *(
            ("U1", state.balls[balls], answer)
            for balls, answer in zip(plates, certified["balls"] or [()] * len(plates), strict=True)
        ),
        ("U2", state.origins[posed], certified["origins"]),
    ]
    for symbol, found, answer in estimates:
        if symbol in certified["uncertainties"] and len(answer):
            unit = certified["uncertainties"][symbol]["average"]
            np.testing.assert_allclose(found, answer, rtol=0.0, atol=1e-4 * unit)
