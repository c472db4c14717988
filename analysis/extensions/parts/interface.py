"""Parts from Python."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ballplate.arguments import PathLike, experiment_of, table_of
from ballplate.results import Fit
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_one_of, ensure_path, ensure_whole

if TYPE_CHECKING:
    import pandas

    from ..machine_files import FittedMap
    from .part_result import PartUncertainty


def part(
    file: PathLike,
    design: Experiment | PathLike | None = None,
    fitted: Fit | FittedMap | PathLike | None = None,
    *,
    readings: PathLike | pandas.DataFrame | None = None,
    coordinates: Literal["scale readings", "tip centres"] = "scale readings",
    draws: int = 0,
    seed: int = 1,
) -> PartUncertainty:
    """Return the uncertainty of each dimension of a part file, by a `design` before it is measured,
    or by a `fitted` map: a fit, its `to_map()`, or the path of a map file.

    `readings` of the part's points, a table as for `ballplate part`, are corrected by the map and
    evaluated; `coordinates` says whether they include the stated offsets of probes. `draws` adds
    fits to the points of so many drawn machines.

    :raises ExperimentError: a file is wrong.
    :raises ValueError: not one of both is given, or the part does not fit the machine.

    >>> import ballplate as bp
    >>> bp.part("designs/parts/block.yaml", bp.quickstart()).headline()[:28]
    '15 dimensions in 2 places; 3'
    """
    from ..maps.interface import fitted_map_of
    from ..maps.realisations import Draws
    from .part_file import load_part
    from .part_uncertainty import by_design, by_map

    ensure_path("file", file)
    ensure_one_of(("scale readings", "tip centres"), coordinates=coordinates)
    ensure_whole(0, draws=draws, seed=seed)
    if (design is None) == (fitted is None) or (readings is not None and fitted is None):
        raise ValueError("give one of a design and a map; readings need a map")
    loaded, drawn = load_part(Path(file)), Draws(draws, seed)
    if fitted is not None:
        table = None if readings is None else table_of("readings", readings)
        is_tip = coordinates == "tip centres"
        return by_map(loaded, fitted_map_of("fitted", fitted), drawn, table, is_tip)
    assert design is not None
    return by_design(loaded, experiment_of(design), drawn)
