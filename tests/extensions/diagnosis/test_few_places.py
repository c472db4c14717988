"""Readings at few places on a scale: functions of that scale are no functions of its noise."""

from __future__ import annotations

import ballplate as bp


def test_faultless_positions_at_one_level_are_not_suspected() -> None:
    """Two upright positions at the same x, and nothing else, leave most of the machine open. In
    three of these ten campaigns their noise was once laid to displacements that depend on x.
    """
    experiment = bp.quickstart().with_({"positions[x high].level": "250 mm"})
    for seed in range(100, 110):
        readings = bp.simulate(experiment, seed)
        found = bp.fit(experiment, readings[readings["position"].isin(["x low", "x high"])])
        assert not found.diagnosis, seed
