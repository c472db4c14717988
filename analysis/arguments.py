"""Arguments of the Python functions: experiments, tables, readings and maps."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ballplate.simulator.experiment.loading import load as load_file
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.arguments import ensure_path, ensure_type
from ballplate.simulator.inputs.messages import refused
from ballplate.simulator.inputs.settings import hint
from ballplate.simulator.inputs.yamltree import GivenText

PathLike = str | os.PathLike[str]

if TYPE_CHECKING:
    import pandas
    from ballplate.simulator.readings.observed_readings import ObservedReadings

    # A table of readings, or several; None for those that the experiment names.
    Tables: TypeAlias = PathLike | pandas.DataFrame | Sequence[PathLike | pandas.DataFrame] | None

SIGMAS = ("estimated", "given")


def load(path: PathLike, variant: str | None = None) -> Experiment:
    """The experiment of a file, or one of its variants.

    :raises ExperimentError: the file is invalid, or has several variants and none was chosen.

    >>> load("designs/quickstart.yaml")
    <Experiment quickstart: 5 x 5 ball plate in six positions>
    >>> load("designs/npl/6.1.1.yaml", variant="B").label
    '6.1.1[B]'
    """
    ensure_type(str, "the name of a variant", variant=variant)
    experiments = load_all(path)
    names = [str(loaded.name) for loaded in experiments]
    if variant is not None:
        if variant in names:
            return experiments[names.index(variant)]
        advice = (
            hint(variant, names) if experiments[0].name is not None else "the file has no variants"
        )
        raise refused(path, f'no variant "{variant}"; {advice}', "variants")
    if len(experiments) > 1:
        text = (
            "the file has several variants; choose one with variant=, or load_all:"
            f" {', '.join(names)}"
        )
        raise refused(path, text, "variants")
    return experiments[0]


def load_all(path: PathLike) -> tuple[Experiment, ...]:
    """The experiment of a file, or all of its variants in their order.

    >>> [one.name for one in load_all("designs/npl/6.1.1.yaml")]
    ['A', 'B', 'C', 'D']
    """
    ensure_path("path", path)
    return load_file(path)


def experiment_of(given: Any) -> Experiment:
    if isinstance(given, Experiment):
        return given
    if isinstance(given, str | os.PathLike):
        return load(given)
    advice = "convert it with experiment()" if isinstance(given, Mapping) else "give either"
    kind = type(given).__name__
    raise TypeError(f"experiment: {kind} is neither an experiment nor the path of a file; {advice}")


def table_of(name: str, table: PathLike | pandas.DataFrame) -> Path | GivenText:
    if isinstance(table, str | os.PathLike):
        return Path(table)
    import pandas

    if not isinstance(table, pandas.DataFrame):
        raise TypeError(f"{name}={table!r}; give the path of a CSV file, or a data frame")
    return GivenText(name, table.to_csv(index=False))


def tables_of(tables: Tables, experiment: Experiment) -> list[Path | GivenText]:
    """Tables of readings, or those that the experiment names."""
    if tables is None:
        named = experiment.readings.named_files
        if not named:
            raise ValueError("readings: the experiment names no files; give a table")
        return [experiment.source.parent / name for name in named]
    if not isinstance(tables, list | tuple):
        return [table_of("readings", tables)]
    if not tables:
        raise ValueError("readings: no table; give one at least")
    return [table_of(f"readings[{k}]", table) for k, table in enumerate(tables)]


def observed_of(
    experiment: Experiment | PathLike,
    readings: Tables,
    certificate: PathLike | pandas.DataFrame | None,
) -> tuple[Experiment, ObservedReadings]:
    """An experiment with its certificate, and what its readings are."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.inputs.extensions import service
    from ballplate.simulator.readings.reading_files import read_readings

    chosen = experiment_of(experiment)
    tables, doubt_count = tables_of(readings, chosen), len(chosen.doubts)
    if certificate is not None:
        read = service("CertificateFiles").read
        chosen = read(table_of("certificate", certificate), chosen)
    observed = read_readings(tables, lay_out(chosen), settings=chosen.readings)
    return chosen, replace(observed, certificate_doubts=chosen.doubts[doubt_count:])
