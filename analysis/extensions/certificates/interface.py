"""Values of certificates from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_type, ensure_whole

if TYPE_CHECKING:
    import pandas


def certificate(
    experiment: Experiment | PathLike, seed: int | None = None, exact: bool = False
) -> pandas.DataFrame:
    """Values of certificates, priors and probe offsets that go with `simulate` of the same seed, as
    a table that `fit` takes.

    >>> import ballplate as bp
    >>> bp.certificate(bp.quickstart()).head(2)[["item", "first", "second"]].values.tolist()
    [['calibration[0]', 'r1c1', 'r1c5'], ['calibration[0]', 'r5c1', 'r5c5']]
    """
    import pandas
    from ballplate.simulator.readings import simulated_readings

    from . import certificate_files

    ensure_whole(0, seed=seed)
    ensure_type(bool, "True or False", exact=exact)
    chosen = experiment_of(experiment)
    certificate_files.ensure_certified(chosen)
    drawn = certificate_files.with_drawn_values(chosen, simulated_readings(chosen, seed, exact))
    rows = certificate_files.certificate_rows(drawn)
    return pandas.DataFrame(rows, columns=list(certificate_files.COLUMNS))
