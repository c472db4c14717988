"""Repairs from Python."""

from __future__ import annotations

from pathlib import Path

from ballplate.arguments import PathLike, load, load_all
from ballplate.simulator.inputs import ensure_path, read_text


def repair(path: PathLike, variant: str | None = None) -> str:
    """Return the text of an experiment file with the first full repair of `check --suggest`, for
    one variant or for each; the rest keeps every byte, line ends included.

    A file without undetermined parameters is returned unchanged. No file is written. A repair with
    a certificate or a probe that the file does not state is left out.

    :raises ExperimentError: the file cannot be used; no changes were found, or writing them would
        change the rest of the file.

    >>> import ballplate as bp
    >>> turned = "{name: straight, corner: {x: 250 mm, y: 250 mm}, quarter_turns: 1}"
    >>> turned in bp.repair("designs/hocken_borchardt/angles.yaml", variant="shifted only")
    True
    """
    from ballplate.results import check
    from ballplate.simulator.experiment import with_pool

    from .mending import mended
    from .repair_search import repairs

    ensure_path("path", path)
    text = read_text(Path(path))
    for experiment in load_all(path) if variant is None else [load(path, variant)]:
        judged = check(experiment).verdict
        if not judged.deficiency:
            continue
        chosen_repair = repairs(with_pool(experiment)).to_write(judged)
        if chosen_repair is None:
            words = (
                "no changes were found that determine everything without a certificate or a probe"
                " that the file does not state"
            )
            raise experiment.refused((), words)
        text = mended(text, Path(path), experiment.name, chosen_repair, experiment.trust)
    return text
