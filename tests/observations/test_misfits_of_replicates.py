"""What observations add to S^2 of replicates and to its gradient, against their own rows where each
replicate is.
"""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design, Observations, Replicates, nominal_state
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.design.observations.star import Stars
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.experiment.layout import lay_out

from tests.estimation.test_stars import small

COUNT = 3


def design_with_all(place: str) -> Design:
    """With a star whose place is unknown one of its tips is held."""
    kinds = {
        "calibration": [
            {"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"},
            {"kind": "coordinates", "balls": ["r1c1", "r3c2"], "standard_uncertainty": "0.2 um"},
        ],
        "priors": [
            {"parameter": "EAX", "standard_uncertainty": "5 urad"},
            {"parameter": "x low: rotation y", "standard_uncertainty": "10 urad"},
        ],
    }
    return lay_out(small({"standard_uncertainty": "0.4 um", "place": place}, **kinds))


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        (CalibratedDistances, "stated"),
        (CalibratedCoordinates, "stated"),
        (Priors, "stated"),
        (Stars, "stated"),
        (Stars, "unknown"),
    ],
)
def test_misfits_are_those_of_the_rows_at_each_replicate(
    kind: type[Observations], place: str
) -> None:
    design = design_with_all(place)
    layout = shared_layout(design)
    generator = np.random.default_rng(3)
    s, n, d = len(layout), len(design.balls.names), design.dimension

    def random_step(size: float) -> tuple[np.ndarray, np.ndarray]:
        return size * generator.standard_normal(s) * np.minimum(layout.scale, 1.0), (
            size * generator.standard_normal((n, d))
        )

    start = moved(nominal_state(design), layout, *random_step(1e-3))
    one = design.of(kind)
    true = one.true_values(design, start, design.model)
    one = one.given(value=true)
    steps = [random_step(1e-6) for _ in range(COUNT)]
    errors = 1e-6 * generator.standard_normal((COUNT, len(one)))
    at = Replicates(
        start,
        start,
        np.array([balls.T for _, balls in steps]),
        np.array([shared for shared, _ in steps]),
        np.ones(COUNT),
        np.ones((COUNT, d, n)),
        np.ones((COUNT, s)),
        layout.offset_columns,
    )
    one.add_misfit(one.rows(design, start, None), errors, at)
    assert len(one) > 0
    for k, (shared, balls) in enumerate(steps):
        there = one.given(value=true + errors[k])
        rows = there.rows(design, moved(start, layout, shared, balls), None)
        by_ball, by_shared = np.zeros((n, d)), np.zeros(s)
        if rows.by_shared is not None:
            by_shared += rows.by_shared.T @ rows.residual
        for column in range(rows.by_ball.shape[1]):
            forces = rows.residual[:, None] * rows.by_ball[:, column]
            np.add.at(by_ball, one.balls[:, column], forces)
        # Added to what is there; linear about the start but for a millionth.
        squares = float(rows.residual @ rows.residual)
        assert at.squares[k] - 1.0 == pytest.approx(squares, rel=1e-4)
        for found, wanted in ((at.by_shared[k], by_shared), (at.by_ball[k].T, by_ball)):
            size = np.abs(wanted).max()
            np.testing.assert_allclose(found - 1.0, wanted, atol=1e-4 * size + 1e-9)
    assert max(np.abs(at.by_shared - 1.0).max(), np.abs(at.by_ball - 1.0).max()) > 1.0
