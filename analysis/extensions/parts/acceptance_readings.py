"""Acceptance tests evaluated from measured lengths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import FileRow, GivenText, read_table, refused

from .acceptance_result import Acceptance, acceptance_of
from .acceptance_rules import AGAIN, REPEATS, ROUNDING, Agreed, Sets

OTHERS = {"probe": "-"}


def acceptance_evaluation(
    source: Path | GivenText, agreed: Agreed, probe: str | None = None
) -> Acceptance:
    """Evaluate a CSV file with the columns direction, length_mm (calibrated), measured_mm, and
    optionally probe; those of `probe` are of E150. Of equal lengths of a direction the
    first three rows are the set, and three more those that were measured again.

    :raises ExperimentError: a wrong table, or a set of not three or six.
    """
    found: dict[tuple[str, str, float], list[FileRow]] = {}
    for row in read_table(source, ("direction", *OTHERS), ("length", "measured"), defaults=OTHERS):
        kind = "E150" if row.texts[1] == probe else "E0"
        found.setdefault((kind, row.texts[0], row.lengths[0]), []).append(row)
    if probe is not None and "E150" not in {kind for kind, _, _ in found}:
        raise refused(str(source), f'no row has the probe "{probe}" of E150; name one that has')
    errors = np.full((1, len(found), 2, REPEATS), np.nan)
    for k, rows in enumerate(found.values()):
        if len(rows) not in (REPEATS, 2 * REPEATS):
            text = f"{len(rows)} measurements of this length; give three, or six if measured again"
            raise rows[-1].mark.refused(text)
        errors[0, k].flat[: len(rows)] = [row.lengths[1] - row.lengths[0] for row in rows]
    limits = agreed.mpe.at([at for _, _, at in found])[:, None] + ROUNDING
    inside = (np.abs(errors[0, :, 0]) <= limits).sum(axis=1)
    idle = ~np.isnan(errors[0, :, 1, 0]) & (inside != REPEATS - 1)
    if idle.any():
        kind, way, at = list(found)[int(idle.argmax())]
        text = f"{kind} {way} {1e3 * at:.6g} mm has six rows, and not one of three is outside"
        raise refused(str(source), f"{text}; give three")
    names = np.array([f"{kind} {way} {1e3 * at:.6g} mm" for kind, way, at in found])

    def words(passes: Flags, again: Flags, fails: Flags) -> str:
        if passes[0]:
            e0 = sum(kind == "E0" for kind, _, _ in found)
            return "all within the limits" + (f": {e0} of 35 sets of E0" if e0 < 35 else "")
        pending = again & np.isnan(errors[:, :, 1, 0])
        parts = {"outside": fails & ~pending, "to be measured three times again": pending}
        for part, at in parts.items():
            if at.any():
                return f"{part}: {', '.join(names[at[0]])}"
        return "too many sets were measured again, or R0 is above its MPL"

    told = f"{len(names)} sets of three; a whole test has 35 of E0, and 10 of E150 if it is agreed"
    sets = Sets(*map(np.array, zip(*found, strict=True)))
    return acceptance_of(Path(str(source)).name, agreed, sets, errors, words, (told, AGAIN))
