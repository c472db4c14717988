"""The number of threads that linear algebra may use changes no bit."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

PROGRAM = """
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.loading import load
(experiment,) = load("designs/quickstart.yaml")
found = predict(experiment)
print([(q.maximum.hex(), q.average.hex()) for q in found.quantities.values()], found.verdict.singular_values.tobytes())
"""


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two processors")
def test_the_number_of_threads_changes_no_bit() -> None:
    found = set()
    for threads in ("1", "2"):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        found.add(done.stdout)
    assert len(found) == 1
