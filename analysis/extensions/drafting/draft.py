"""The commented experiment file of a data sheet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np
from ballplate.simulator.inputs import LengthFunction, Target, typed_length, yaml_text

from .data_sheet import DataSheet
from .machine_tables import chain_words, table
from .places import Settings, Tips
from .sheet_values import function_text, rounded

# The standard uncertainty of a reading, as a share of the constant part of the MPE.
REPEATABILITY = 1 / 3
# The target of U (k = 2), as a share of the MPE.
TARGET = 1 / 2
# Errors of the simulated machine, as a share of the MPE at the space diagonal: with it the errors
# of lengths have a standard deviation of about half the MPE, found from simulated machines.
ERRORS = 1 / 8


def draft(
    sheet: DataSheet,
    texts: Mapping[str, str],
    next_command: str,
    starts: Sequence[Settings],
    hours: float = 0.0,
) -> str:
    """Return the text of an experiment file with the positions `starts`, which take some `hours`;
    `texts` as stated and `next_command` go into its comments.

    :raises ValueError: the plate, the tips and the volume do not go together.
    """
    places, tips, mpe = sheet.places, sheet.tips_there, sheet.mpe
    error = ERRORS * float(mpe.at(np.linalg.norm(sheet.volume)))
    usual = LengthFunction(TARGET * mpe.constant, TARGET * mpe.slope)
    target = sheet.target or Target(usual, 2.0)
    balls = [sheet.plate.columns, sheet.plate.rows]
    plate = {"kind": "grid", "balls": balls, "size": [*map(typed_length, sheet.plate.size)]}
    unseen = table("unseen")[sheet.arrangement]
    if tips.form == "flat":
        unseen = [name for name in unseen if name in ("ECX", "ECY")]
    functions = _flow(dict.fromkeys(unseen, 1))
    left_out = f"\n  # A single tip does not show these rotations.\n  functions: {functions}"
    from_mpe = (
        f"a third of the constant part of the MPE, {function_text(mpe)}.\n"
        "  # Better: the standard deviation of repeated readings of a ball."
    )
    text = files(__package__).joinpath("draft.yaml").read_text(encoding="utf-8")
    return Template(text).substitute(
        stated="\n#   ".join(
            f"{name}: {' '.join(said.split())}" for name, said in texts.items() if said
        ),
        next_command=next_command,
        kind=sheet.machine_type,
        volume=_flow([*map(typed_length, sheet.volume)]),
        repeatability=rounded(sheet.repeatability)
        if sheet.repeatability
        else rounded(REPEATABILITY * mpe.constant, 2),
        repeatability_words="as stated." if sheet.repeatability else from_mpe,
        arrangement=sheet.arrangement,
        chain=chain_words(sheet.arrangement, "xyz"[: len(sheet.volume)]),
        functions=left_out if len(tips.offsets) == 1 else "",
        position=rounded(error, 2),
        rotation=f"{1e6 * error / max(sheet.volume):.2g} urad",
        probes=_tips(tips, rounded(sheet.tips.uncertainty)),
        influences=_influences(sheet.temperature),
        plate=_flow(plate | {"role": "plate"}),
        rule=rule(sheet, len(starts), hours),
        positions=_entries(starts),
        certificate=function_text(sheet.certificate.stated),
        factor=f"{sheet.certificate.coverage_factor:g}",
        calibration=_certificate(sheet.certificate.standard),
        candidates=_entries(place for place in places if place not in starts),
        first=next(iter(tips.offsets)),
        target=function_text(target.stated),
        target_words="as stated" if sheet.target else "half the MPE",
        coverage_factor=f"{target.coverage_factor:g}",
    )


def rule(sheet: DataSheet, count: int, hours: float) -> str:
    """Return why a draft has so many positions, which take some hours, as lines of a comment; empty
    without a choice.
    """
    if len(table("starts")[sheet.tips_there.form][sheet.tips_there.pointing]) == 1:
        return ""
    more = "" if hours <= sheet.hours else f", more than the {sheet.hours:g} h for measuring"
    return (
        f"\n# {count} positions of a simple strategy, {hours:.1f} h{more}. On machines of many"
        f" shapes, U6 was\n# {table('nearness')[str(count)]} times that of a plan of as many."
    )


def _tips(tips: Tips, qualification: str) -> str:
    """Return the probes as a file has them; all but the reference have an uncertainty."""
    probes, uncertainty = dict[str, Settings](), dict[str, str]()
    for name, offset in tips.offsets.items():
        where = {"offset": [*map(typed_length, offset)]}
        probes[name] = (table("angles")[name] if tips.form == "head" else where) | uncertainty
        uncertainty = {"standard_uncertainty": qualification}
    head = f"head: {{tip: [0 mm, 0 mm, {typed_length(-2 * tips.length)}]}}\n"
    lines = "".join(f"\n  {name}: {_flow(probe)}" for name, probe in probes.items())
    return f"{head if tips.form == 'head' else ''}probes:{lines}"


def _influences(uncertainty: str | None) -> str:
    """Return the temperatures as a file has them, nothing if they are exactly known."""
    if uncertainty is None:
        return ""
    measured = {"value": "20 degC", "standard_uncertainty": uncertainty}
    measured["sensor_uncertainty"] = uncertainty
    expansion = {"value": "11.5 um/m/K", "standard_uncertainty": "0 um/m/K"}
    quantities = {"expansion": expansion, "temperature": measured}
    lines = (
        f"    {body}_{name}: {_flow(value)}"
        for body in ("artefact", "scale")
        for name, value in quantities.items()
    )
    return "\n".join(
        [
            "",
            "# Temperatures, in all positions alike and in each; plate and scales of steel.",
            "influences:",
            "  - kind: temperature",
            *lines,
            "",
        ]
    )


def _certificate(standard: LengthFunction) -> str:
    """Return the uncertainties of the distances: the part that grows with length is an error of
    scale, common to all.
    """
    if standard.slope:
        common = function_text(LengthFunction(0.0, standard.slope))
        if "L/" not in common:
            common = common.rpartition("+ ")[2]
        return f"standard_uncertainty: {rounded(standard.constant)}\n    common: {common}"
    return f"standard_uncertainty: {function_text(standard)}"


def _flow(content: Any) -> str:
    """Return content of a file in one line."""
    return yaml_text(content, flow_style=True).strip()


def _entries(items: Iterable[Settings]) -> str:
    return "".join(f"\n    - {_flow(item)}" for item in items)
