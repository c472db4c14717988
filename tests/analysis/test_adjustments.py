"""Words of adjustments, against the geometry of the axes that they are to put right."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.results.adjustments import adjusted
from ballplate.simulator.machines.metric import SpatialMetricModel, parameters_of_metric

MODEL = SpatialMetricModel(True, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("k", range(3))
def test_a_scale_that_reads_too_short_is_to_read_more(k: int, sign: float) -> None:
    values = sign * 50e-6 * np.eye(6)[k]
    one = adjusted(values, np.eye(6))[k]
    true_length = MODEL.axes(values)[k, k]
    assert one.words == f"let {'XYZ'[k]} read 50 µm per m {'more' if true_length > 1.0 else 'less'}"


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("k", "guideway", "other"), [(3, 1, 0), (4, 2, 0), (5, 2, 1)])
def test_a_guideway_is_turned_back_to_square(
    k: int, guideway: int, other: int, sign: float
) -> None:
    values = sign * 1e-4 * np.eye(6)[k]
    one = adjusted(values, np.eye(6))[k]
    axes = MODEL.axes(values)
    cosine = axes[:, guideway] @ axes[:, other]
    assert one.value == pytest.approx(np.arccos(cosine) - 0.5 * np.pi, rel=1e-9)
    assert one.name == f"angle {'xyz'[other]}{'xyz'[guideway]}"
    turn = f"turn the {'XYZ'[guideway]} guideway by 20.6 arcsec (100 µm per m) towards"
    assert one.words == f"{turn} {'-' if cosine > 0 else '+'}{'XYZ'[other]}"


def test_differences_of_scales_are_known_without_a_length() -> None:
    values = 1e-6 * np.array([1.0, 3.0, 7.0, 0.0, 0.0, 0.0])
    in_common = np.array([[1.0], [1.0], [1.0], [0.0], [0.0], [0.0]])
    found = {one.name: one.value for one in adjusted(values, np.eye(6), in_common)}
    assert np.isnan(found["scale x"])
    assert [found[f"scale {axis} - scale x"] for axis in "yz"] == pytest.approx([2e-6, 6e-6])


def test_a_tensor_that_gives_some_differences_no_length_is_no_metric() -> None:
    with pytest.raises(ValueError, match="no length"):
        parameters_of_metric(np.diag([1.0, 1.0, -1e-6]))
