"""Times of readings as clocks show them are those of the plain file in seconds."""

from __future__ import annotations

from datetime import datetime, timedelta

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
from ballplate.extensions.laboratory.clock_times import clock_time
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.quantities import QuantityError
from ballplate.simulator.inputs.units import DURATION_UNITS
from ballplate.simulator.inputs.yamltree import GivenText
from ballplate.simulator.readings.reading_sources import source_rows

from tests.extensions.laboratory import wording

DRIFT = {"kind": "drift", "axes": {"standard_uncertainty": "2 um/h"}}
START = datetime(2026, 3, 4, 8, 5, 17)


@pytest.fixture(scope="module")
def experiment() -> bp.Experiment:
    return bp.quickstart().with_(influences=[DRIFT])


@pytest.fixture(scope="module")
def table(experiment: bp.Experiment) -> pd.DataFrame:
    """Readings in order, whose times have gaps, of which one is longer than a night."""
    found = bp.simulate(experiment)
    steps = np.random.default_rng(3).integers(15, 40, len(found))
    return found.assign(time_s=np.cumsum(steps))


def times(experiment: bp.Experiment, *tables: pd.DataFrame) -> np.ndarray:
    """Seconds of rows, from their mean on."""
    design = lay_out(experiment)
    sources = [GivenText(f"{k}.csv", one.to_csv(index=False)) for k, one in enumerate(tables)]
    settings = experiment.readings
    units = {"time": DURATION_UNITS}
    wrong: list[Message] = []
    rows = source_rows(sources, design, settings, wrong, units).rows
    assert not wrong
    seconds = np.array([row.lengths[-1] for row in rows])
    return np.asarray(seconds - seconds.mean())


WAYS = {
    "time": lambda t: t.strftime("%H:%M:%S"),
    "Zeit [hh:mm:ss]": lambda t: t.strftime("%H:%M:%S"),
    "timestamp": lambda t: t.isoformat(),
    "date_time": lambda t: t.isoformat(" "),
    "Time": lambda t: t.isoformat() + "Z",
    "Uhrzeit": lambda t: t.strftime("%d.%m.%Y %H:%M:%S"),
}


@pytest.mark.parametrize("name", WAYS)
def test_clock_times_are_those_in_seconds(
    name: str, experiment: bp.Experiment, table: pd.DataFrame
) -> None:
    clock = [WAYS[name](START + timedelta(seconds=int(s))) for s in table["time_s"]]
    other = table.drop(columns="time_s").assign(**{name: clock})
    np.testing.assert_allclose(times(experiment, other), times(experiment, table), atol=1e-6)


def test_dates_count_over_midnight_and_in_any_order(
    experiment: bp.Experiment, table: pd.DataFrame
) -> None:
    """And zones of their own, as in a night when clocks are set back."""
    late = datetime(2026, 10, 24, 23, 30)
    seconds = table["time_s"].to_numpy()
    clock = [
        (late + timedelta(seconds=int(s), hours=-1 if s > 4000 else 0)).isoformat()
        + ("+01:00" if s > 4000 else "+02:00")
        for s in seconds
    ]
    other = table.drop(columns="time_s").assign(time=clock)
    np.testing.assert_allclose(times(experiment, other), times(experiment, table), atol=1e-6)
    shuffled = other.sample(frac=1.0, random_state=4)
    expected = times(experiment, table.loc[shuffled.index])
    np.testing.assert_allclose(times(experiment, shuffled), expected, atol=1e-6)


def test_what_does_not_tell_the_day_is_refused(
    experiment: bp.Experiment, table: pd.DataFrame
) -> None:
    late = datetime(2026, 3, 4, 23, 0)
    clock = [(late + timedelta(seconds=int(s))).strftime("%H:%M:%S") for s in table["time_s"]]
    bare = table.drop(columns="time_s")
    after = next(k for k, text in enumerate(clock) if text < "12")
    with pytest.raises(ExperimentError, match=rf"the time goes back from 23:.*line {after + 1}\)"):
        times(experiment, bare.assign(time=clock))
    # Two files, one of each day, are no better; from the later one on, they are not in order.
    first, second = bare.assign(time=clock)[:after], bare.assign(time=clock)[after:]
    with pytest.raises(ExperimentError, match="another day; write dates"):
        times(experiment, first, second)
    with pytest.raises(ExperimentError, match=wording.NO_CLOCK_TIMES):
        times(experiment, first, table[after:])
    dated = [(late + timedelta(seconds=int(s))).isoformat() for s in table["time_s"]]
    with pytest.raises(ExperimentError, match=wording.DATES_WITHOUT_A):
        times(experiment, first, bare.assign(time=dated)[after:])
    with pytest.raises(ExperimentError, match=wording.NO_TIME_AND_OTHER_ROWS_HAVE):
        bp.fit(experiment, bare.assign(time=[*clock[:after], *[""] * (len(bare) - after)]))
    with pytest.raises(ExperimentError, match=wording.IS_NO_TIME_OF_A_CLOCK):
        times(experiment, bare.assign(time=12.5))


@pytest.mark.parametrize(
    "text", ["", "25:00", "10:60", "10:05:60", "2026-02-30T10:00", "11/22/2026 10:05", "10", "x:y"]
)
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(QuantityError, match=wording.IS_NO_TIME):
        clock_time(text)
