"""The first example and simulated readings of it, which no test changes."""

from __future__ import annotations

import ballplate as bp
import pandas
import pytest


@pytest.fixture(scope="package")
def experiment() -> bp.Experiment:
    return bp.quickstart()


@pytest.fixture(scope="package")
def readings(experiment: bp.Experiment) -> pandas.DataFrame:
    return bp.simulate(experiment)
