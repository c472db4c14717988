"""A drafted experiment from Python."""

from __future__ import annotations

from pathlib import Path

from ballplate.simulator.experiment import Experiment, load
from ballplate.simulator.inputs import ensure_type


def design(
    machine_type: str,
    volume: str,
    mpe: str,
    plate: str,
    certificate: str,
    tips: str | None = None,
    target: str | None = None,
    repeatability: str | None = None,
    temperature: str | None = None,
    hours: str | None = None,
) -> Experiment:
    """Return an experiment with a pool, drafted from a machine's data sheet as by `ballplate init`.

    All values are texts, quantities with units. The type of machine is moving bridge, fixed bridge,
    gantry, cantilever, horizontal arm, column, or an arrangement such as MB1; the volume has three
    edges, or two for two dimensions; of an MPE such as 0.9 um + L/400, L is in mm and the result in
    um; the certificate is an expanded uncertainty with its k; tips are one (in two dimensions,
    where it is the default), star (default) or head, with or without the length of a stylus and the
    standard uncertainty of offsets. The target is one of the expanded uncertainty of lengths, by
    default half the MPE; the repeatability is a standard deviation, by default a third of the
    constant part of the MPE; the temperature is the standard uncertainty of temperatures, by
    default exactly known; the hours, by default 6, decide how many positions it begins with.

    :raises ValueError: a text cannot be read, or the plate does not fit into the volume within the
        reach of the tips.

    >>> import ballplate as bp
    >>> sheet = {"volume": "900 1200 700 mm", "mpe": "0.9 um + L/400", "plate": "6 x 6, 420 mm"}
    >>> bp.design("moving bridge", certificate="0.4 um + 0.5 um/m, k=2", **sheet)
    <Experiment design: ball plate on a machine of type moving bridge>
    """
    from .checked_draft import drafted
    from .data_sheet import data_sheet

    texts = {
        "machine_type": machine_type,
        "volume": volume,
        "mpe": mpe,
        "plate": plate,
        "certificate": certificate,
        "tips": tips or "",
        "target": target or "",
        "repeatability": repeatability or "",
        "temperature": temperature or "",
        "hours": hours or "",
    }
    for name, text in texts.items():
        ensure_type(str, "a text, of a quantity with its unit", **{name: text})
    path = Path("design.yaml")
    return load(path, text=drafted(path, data_sheet(texts), texts, "ballplate plan"))[0]
