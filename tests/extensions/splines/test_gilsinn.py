"""NISTIR 6517: Table 1, the dome of its Figure 6, and its formulas (25) and (33)."""

from __future__ import annotations

import csv
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.splines.error_curve import ErrorCurve
from ballplate.simulator.splines.spline_fit import pieces

from tests.reference import truncated_powers

OURS, DOCUMENT = (
    Path("designs/gilsinn/table-1.csv"),
    Path("tests/extensions/splines/nistir-6517-table1.csv"),
)
RADIUS = 0.037084


def columns(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def dome(**wanted: object) -> ErrorCurve:
    return bp.spline(OURS, y="semi_finish_error", points="12-32", **wanted).curve


def test_the_shipped_table_is_the_documents() -> None:
    ours, document = columns(OURS), columns(DOCUMENT)
    assert len(document["point"]) == 32
    assert {name: ours[name] for name in document} == document


@pytest.mark.parametrize("every", [4, 5])
def test_the_dome_with_zero_slope_at_the_linear_feature(every: int) -> None:
    fitted = dome(every=every, start_slope="0").fit
    scale, breaks = np.abs(fitted.y).max(), fitted.space.breaks
    assert abs(fitted.values(breaks[:1], 1)[0]) * fitted.space.length < 1e-12 * scale
    for local, digits in ((True, 1e-14), (False, 1e-11)):
        polynomials = pieces(fitted, local)
        for start, end, polynomial in zip(breaks, breaks[1:], polynomials, strict=False):
            places = np.linspace(start, end, 50)
            found = np.polynomial.polynomial.polyval(places - local * start, polynomial)
            expected = fitted.values(places)
            np.testing.assert_allclose(found, expected, rtol=0, atol=digits * scale)
    # The misfit is a small part of the errors, as Table 1's finish errors are.
    assert 2e-6 < fitted.sigma < 3e-6 and scale > 78e-6

    # The document's formulas, with the abscissa in units of the curve's length and in millimetres.
    for unit, bound in ((fitted.space.length, 1e-10), (1e-3, 1e-9)):
        x, knots = fitted.x / unit, np.array(fitted.space.knots) / unit
        c = truncated_powers.constrained(
            x, fitted.y / scale, knots, truncated_powers.powers(x[:1], knots, 1), np.zeros(1), 1e-12
        )
        found = truncated_powers.powers(x, knots) @ c
        np.testing.assert_allclose(found, fitted.values(fitted.x) / scale, rtol=0, atol=bound)
        by_recursion = truncated_powers.pieces(c, knots)
        ours = pieces(fitted, local=False) * unit ** np.arange(4) / scale
        np.testing.assert_allclose(
            ours, by_recursion, rtol=0, atol=10 * bound * np.abs(by_recursion).max()
        )


def test_the_abscissa_is_the_arc_length() -> None:
    x = dome().fit.x
    np.testing.assert_allclose(np.diff(x[1:]), RADIUS * np.radians(4.3237499), rtol=2e-5)


def test_finish_errors_follow_what_the_spline_left_of_the_semi_finish_errors() -> None:
    """The finish cut was corrected by a spline through the semi-finish errors: their residuals show
    in it.
    """
    curve = dome(every=4, start_slope="0")
    finish = np.array(columns(DOCUMENT)["finish_error_um"][11:], dtype=float)
    assert np.corrcoef(curve.fit.residuals, finish)[0, 1] == pytest.approx(0.67, abs=0.01)


SMALL = {"artefacts.plate.balls": [6, 6], "evaluation.points": {"random": 10, "seed": 1}}
VARIANTS = ("joined", "level ends", "cyclic")


@pytest.mark.parametrize(
    ("variant", "changes"),
    [
        ("cyclic", SMALL),
        *(pytest.param(variant, {}, marks=pytest.mark.long) for variant in VARIANTS),
    ],
)
def test_the_shipped_experiment_recovers_its_machine(
    variant: str, changes: dict[str, object]
) -> None:
    """Readings without noise come out again, and the joint of the scales shows in a model that is
    smooth across it.
    """
    own, smooth = (
        bp.load("designs/gilsinn/scales-in-two-parts.yaml", one).with_(changes)
        for one in (variant, "smooth")
    )
    readings = bp.simulate(own, exact=True)
    exact, off = (bp.fit(one, readings, sigma="given") for one in (own, smooth))
    assert exact.to_dict()["sum_of_squares"] < 1e-9
    assert off.to_dict()["sum_of_squares"] > 100
