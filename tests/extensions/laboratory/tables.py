"""Exact readings of the first example, and what is read of tables and reports of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
from ballplate.extensions.laboratory.any_table import TableRows
from ballplate.extensions.laboratory.reading_tables import any_table_rows
from ballplate.simulator.experiment import lay_out
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.readings import read_readings
from ballplate.simulator.readings.reading_sources import Source, source_text

QUICKSTART = bp.quickstart()
DESIGN = lay_out(QUICKSTART)
ROWS = list(bp.simulate(QUICKSTART, exact=True).itertuples(index=False))
EXPECTED = {row[:3]: np.array(row[3:]) / 1000 for row in ROWS}


def observed(paths: Path | Sequence[Path], **stated: object) -> Any:
    """Readings as `fit` has them."""
    experiment = QUICKSTART.with_readings(stated)
    return read_readings(paths, lay_out(experiment), settings=experiment.readings)


def of_table(folder: Path, text: str | bytes, name: str = "lab.csv", **stated: object) -> Any:
    (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return observed(folder / name, **stated)


def rows_of(source: Source, **stated: object) -> TableRows:
    """The rows of a table, without a look at its names."""
    settings, wrong = QUICKSTART.with_readings(stated).readings, list[Message]()
    names = {
        "position": DESIGN.positions.names,
        "ball": DESIGN.balls.names,
        "probe": DESIGN.probes.names,
    }
    found = any_table_rows(source_text(source, settings.encoding), names, settings, wrong, 3, {})
    if wrong:
        raise ExperimentError(wrong)
    return found


def names_read(found: Any) -> list[tuple[str, str, str]]:
    """Position, ball and probe of each reading."""
    read = found.design.readings
    return [
        (DESIGN.positions.names[i], DESIGN.balls.names[j], DESIGN.probes.names[k])
        for i, j, k in zip(read.position, read.ball, read.probe, strict=True)
    ]


def assert_all_planned(found: Any, atol: float = 1e-12, lacks: int = 0) -> None:
    """Every planned reading but those that it lacks is there once, at its place."""
    names = names_read(found)
    assert len(found.missing) == lacks and not found.unplanned
    assert len(set(names)) == len(names) == len(ROWS) - lacks
    np.testing.assert_allclose(found.x, [EXPECTED[name] for name in names], rtol=0, atol=atol)
