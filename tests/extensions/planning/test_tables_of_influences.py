"""The table to fill in has columns of what influence quantities ask of each reading."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import ballplate as bp
import numpy as np
import pandas as pd

from tests.extensions.influences.test_temperature import STATED
from tests.reference.small_quickstart import small_quickstart

DRIFT = {"kind": "drift", "axes": {"standard_uncertainty": "2 um/h"}}
PLAIN = ["position", "ball", "probe", "x_mm", "y_mm", "z_mm"]
FURTHER = ["temperature_artefact_degC", "temperature_scales_degC", "time"]


def test_a_filled_table_fits_as_the_same_numbers_do() -> None:
    experiment = small_quickstart(influences=[STATED, DRIFT])
    empty = pd.read_csv(io.StringIO(bp.sheet(experiment).template()))
    assert list(empty.columns) == [*PLAIN, *FURTHER]
    readings = bp.simulate(experiment, seed=3)[PLAIN]
    assert empty[PLAIN[:3]].equals(readings[PLAIN[:3]])
    rows = np.arange(len(readings))
    warm = {FURTHER[0]: 20.4 + 1e-3 * rows, FURTHER[1]: 20.9 - 1e-3 * rows}
    begun = datetime(2026, 3, 4, 7, 30)
    filled = empty.assign(
        **{axis: readings[axis] for axis in PLAIN[3:]},
        **warm,
        time=[(begun + timedelta(seconds=int(20 * k))).isoformat() for k in rows],
    )
    expected = bp.fit(experiment, readings.assign(**warm, time_s=20.0 * rows))
    found = bp.fit(experiment, filled)
    one, two = (each.to_frame()["value"].to_numpy(float) for each in (found, expected))
    np.testing.assert_allclose(one, two, rtol=1e-7, atol=1e-15)
    # Left empty they are as if they were not there.
    bare = empty.assign(**{axis: readings[axis] for axis in PLAIN[3:]})
    one, two = (
        bp.fit(experiment, table).to_frame()["value"].to_numpy(float) for table in (bare, readings)
    )
    np.testing.assert_array_equal(one, two)
