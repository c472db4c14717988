"""Checks that need several sections: names used twice, artefacts never placed, balls never read."""

from __future__ import annotations

import codecs
from collections.abc import Collection, Iterable, Mapping

import numpy as np
from ballplate.simulator.design.observations.calibration import Calibration
from ballplate.simulator.design.observations.distances import DistanceCalibration, RadiusCalibration
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings, TwoSpheresSettings
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.problems import Problems, written_texts
from ballplate.simulator.inputs.quantities import QuantityError, parse_positive_length
from ballplate.simulator.inputs.settings import hint, listing
from ballplate.simulator.inputs.units import LENGTH_UNITS, plain_unit

from .model import Position
from .readings_section import ColumnsSettings, ReadingsSettings, check_rule
from .references import References
from .validation import Sections


def check_names(problems: Problems) -> None:
    """Report positions that have the same name."""
    first: dict[str, int] = {}
    for i, name in enumerate(written_texts(problems.root, "positions", "name")):
        if name is None:
            continue
        if name in first:
            text = (
                f'"{name}" is the name of positions[{first[name]}] already; names of positions must'
                " differ"
            )
            problems.add(("positions", i, "name"), text)
        first.setdefault(name, i)


def check_use(
    sections: Sections,
    positions: Mapping[int, Position],
    references: References,
    candidates: Collection[Position] | None = (),
    planning: bool = False,
) -> None:
    """Report artefacts without a position, unread balls of plates, and uncalibrated length
    standards of many balls.

    Without a certificate the length of a ball bar or a Bryan gauge is a parameter. ``candidates``
    of a pool (unknown if some are invalid) may set up an artefact; for ``planning`` they may read
    balls that no position reads.
    """
    problems = references.problems
    placed = set()
    uncertain = set()
    in_pool = (
        set(references.artefact_names)
        if candidates is None
        else {candidate.artefact for candidate in candidates}
    )
    readers = [*positions.values(), *(candidates or () if planning else ())]
    if planning:
        placed |= in_pool
        uncertain |= set(references.artefact_names) if candidates is None else set()
    artefacts_written = written_texts(problems.root, "positions", "artefact")
    for i, name in enumerate(artefacts_written):
        if name is None and len(references.artefact_names) == 1:
            name = references.artefact_names[0]
        # A position that cannot be understood may be one of any artefact, or read any ball of its
        # own.
        names = {name} if name in references.artefact_names else set(references.artefact_names)
        placed |= {str(name) for name in names}
        if i not in positions:
            uncertain |= {str(name) for name in names}
    for name in references.artefact_names:
        if not artefacts_written and not readers:
            continue
        if name not in placed and name in in_pool:
            continue
        if name not in placed:
            problems.add(
                ("artefacts", name),
                "is never placed; add a position of it, or remove it",
                of_key=True,
            )
        elif name in references.layouts and name not in uncertain:
            _check_balls_read(
                name, [reader for reader in readers if reader.artefact == name], references
            )
    for name, settings in references.artefacts.items():
        with_one_length = isinstance(settings, TwoSpheresSettings | BryanGaugeSettings)
        if (
            settings.role == "length_standard"
            and not with_one_length
            and not problems.has_below(("calibration",))
        ):
            # An item that names no artefact may be of any; one of the machine has no such key.
            kinds = [
                calibration.kind
                for calibration in sections.calibration.values()
                if getattr(calibration, "artefact", "") in (name, None)
            ]
            if "distances" not in kinds and "coordinates" not in kinds:
                text = (
                    "is a length standard without calibrated distances; add a calibration of kind:"
                    " distances"
                )
                problems.add(("artefacts", name), text, of_key=True)


def check_calibration_read(
    calibration: Calibration,
    steps: Steps,
    positions: Mapping[int, Position],
    position_count: int,
    references: References,
) -> None:
    """Report calibrated balls of a length standard that no position reads; of plates, all are
    reported.
    """
    if not isinstance(calibration, DistanceCalibration):
        return
    if references.artefacts[calibration.artefact].role != "length_standard":
        return
    if len(positions) < position_count:
        return
    artefact_positions = [
        position for position in positions.values() if position.artefact == calibration.artefact
    ]
    layout = references.layouts[calibration.artefact]
    unread = np.setdiff1d(calibration.pairs, read_balls(artefact_positions))
    if artefact_positions and len(unread):
        names = listing(layout.names[i] for i in unread)
        references.problems.add(
            (*steps, "pairs"),
            f"no position reads {_balls(len(unread))} {names}; read them, or leave them out",
        )


def check_radii(calibrations: Mapping[int, Calibration], problems: Problems) -> None:
    """Report a gauge whose radius is calibrated twice."""
    first: dict[str, int] = {}
    for i, calibration in calibrations.items():
        if not isinstance(calibration, RadiusCalibration):
            continue
        if calibration.artefact in first:
            text = (
                f'the radius of "{calibration.artefact}" is already in'
                f" calibration[{first[calibration.artefact]}]"
            )
            problems.add(("calibration", i), f"{text}; remove one of the two")
        first.setdefault(calibration.artefact, i)


def read_balls(positions: Iterable[Position]) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the indices of the balls that are read in any of the positions of one artefact, in
    order.
    """
    return np.unique(
        np.concatenate([np.zeros(0, np.intp), *(position.balls for position in positions)])
    )


def _check_balls_read(name: str, positions: list[Position], references: References) -> None:
    layout = references.layouts[name]
    enabled = [position for position in positions if position.enabled]
    if not enabled:
        # An artefact whose positions are all switched off is left out with them.
        return
    unread = np.setdiff1d(np.arange(len(layout.names)), read_balls(enabled))
    if references.artefacts[name].role == "plate" and len(unread):
        names = listing(layout.names[i] for i in unread)
        text = (
            f"no position reads {_balls(len(unread))} {names}; read them, or leave them out of the"
            " artefact"
        )
        references.problems.add(("artefacts", name), text, of_key=True)


def _balls(count: int) -> str:
    return "ball" if count == 1 else "balls"


def check_readings(sections: Sections, references: References) -> None:
    """Report faults of the readings section beyond its form; read the file of a correction."""
    settings, problems = sections.readings, references.problems
    if not isinstance(settings, ReadingsSettings):
        return
    if settings.unit is not None and plain_unit(settings.unit) not in LENGTH_UNITS:
        text = f'unknown unit "{settings.unit}"; {hint(settings.unit, LENGTH_UNITS)}'
        problems.add(("readings", "unit"), text)
    if settings.encoding is not None and not is_text_encoding(settings.encoding):
        text = f'unknown encoding "{settings.encoding}"; write for example utf-8 or cp1252'
        problems.add(("readings", "encoding"), text)
    if settings.names is not None:
        try:
            check_rule(settings.names)
        except ValueError as error:
            problems.add(("readings", "names"), str(error))
    for name, probe in (settings.probes or {}).items():
        references.is_probe(probe, ("readings", "probes", name))
    if settings.columns is not None:
        if settings.columns.z is not None and references.dimension == 2:
            problems.add(("readings", "columns", "z"), "there are two dimensions; leave z out")
        for axis in AXIS_NAMES:
            columns = getattr(settings.columns, axis)
            if isinstance(columns, dict):
                _check_probes(list(columns), ("readings", "columns", axis), references)
        _check_constants(settings.columns, references)
    offsets = settings.offsets_in_controller or {}
    _check_probes(list(offsets), ("readings", "offsets_in_controller"), references)
    for name, offset in offsets.items():
        references.has_dimension(offset, ("readings", "offsets_in_controller", name))
    if offsets and settings.coordinates not in ("ball centres", "part"):
        text = "applies to coordinates: ball centres, or part; add it, or leave this out"
        problems.add(("readings", "offsets_in_controller"), text)


def _check_constants(columns: ColumnsSettings, references: References) -> None:
    """Report settings that cannot be the same in all rows, and an invalid constant uncertainty."""
    if (columns.ball or "").startswith("="):
        text = "a ball is that of a reading, and not of all rows; name its column"
        references.problems.add(("readings", "columns", "ball"), text)
    if (columns.u or "").startswith("="):
        try:
            parse_positive_length((columns.u or "")[1:].strip())
        except QuantityError as error:
            text = f'{error}; of all rows write for example "=0.2 um"'
            references.problems.add(("readings", "columns", "u"), text)


def is_text_encoding(name: str) -> bool:
    """True if Python has a text encoding of this name.

    >>> is_text_encoding("cp1252"), is_text_encoding("zip"), is_text_encoding("cp 12520")
    (True, False, False)
    """
    try:
        codec = codecs.lookup(name)
        "".encode(name)
    except (LookupError, UnicodeError, ValueError):
        return False
    return codec.name not in ("idna", "punycode", "undefined", "unicode_escape")


def _check_probes(names: list[str], steps: Steps, references: References) -> None:
    for name in names:
        references.is_probe(name, (*steps, name), of_key=True)
