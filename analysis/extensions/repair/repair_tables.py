"""Repairs as lines of text and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ballplate.presentation import Data, finite, number, picked
from ballplate.rank import Verdict, changed_names, length
from ballplate.results import given_words, qualification_data
from ballplate.simulator.inputs import listed
from ballplate.uncertainty import OFFSET_TRIAL, exact_offsets

from .changes import KINDS
from .offers import duration

if TYPE_CHECKING:
    from .repair_search import Repair, Repairs
    from .scale import ScaleCertificate
    from .written import Edit

# Names of errors that a line has room for.
MOST_NAMES = 8


def repair_lines(repairs: Repairs | None, judged: Verdict) -> list[str]:
    """Return lines of each repair, with its change of the file; empty for a sufficient design."""
    if repairs is None:
        return []
    lines = []
    for k, repair in enumerate(repairs.complete, start=1):
        lines.append(f"repair {k}: {changes_in_words(repair)}: {_worth(repair, judged)}")
        lines += [f"repair {k}, in the file: {edit}" for edit in repair.edits]
    if not repairs.complete:
        lines.append("repair: no changes were found that determine everything")
    for repair in repairs.partial:
        lines.append(
            f"repair of {_directions(repair, judged)} alone: {changes_in_words(repair)}: leaves"
            f" {_rank(repair.deficiency)}"
        )
        lines += [
            f"repair of {_numbers(repair)} alone, in the file: {edit}" for edit in repair.edits
        ]
    return lines


def changes_in_words(repair: Repair) -> str:
    """Return the changes of a repair as imperative sentences."""
    return "; and ".join(change.words for change in repair.changes)


def _rank(deficiency: int) -> str:
    return f"rank deficiency {deficiency}" if deficiency else "full rank"


def _worth(repair: Repair, judged: Verdict) -> str:
    words = _rank(repair.deficiency)
    if repair.weak:
        count = "1 direction is" if repair.weak == 1 else f"{repair.weak} directions are"
        words += (
            f", but {count} weakly determined, the weakest known only to {length(repair.worst)} in"
            " corrected points"
        )
    elif repair.is_faint:
        words += ", but only just: see the smallest singular value"
    else:
        words += ", and no weak direction"
    u6 = None if repair.prediction is None else repair.prediction.quantities.get("U6")
    if u6 is not None:
        words += f"; average U6 {number(1e6 * u6.average)} µm{_with_offsets(repair)}"
    words += caveat(repair)
    minutes = f"{duration(repair.seconds)} more" if repair.seconds else "no time more"
    words += f"; {repair.readings:+d} readings, {minutes}" if repair.readings else ""
    if repair.removes:
        words += f"; removes {_directions(repair, judged)}"
    return f"{words}; smallest singular value {repair.smallest:.3g}"


def caveat(repair: Repair) -> str:
    """Return what the figures after a repair take for granted."""
    return "" if repair.prediction is None else given_words(repair.prediction.qualifications)


def _with_offsets(repair: Repair) -> str:
    """Return U6 with uncertain offsets, if it differs."""
    if repair.prediction is None or repair.prediction.experiment is None:
        return ""
    if not exact_offsets(repair.prediction.experiment):
        return ""
    loose, trial = repair.loosened, f"with {1e6 * OFFSET_TRIAL:g} µm on the exact probe offsets"
    if loose is None:
        return f", undetermined {trial}"
    return f", {number(1e6 * loose.total / loose.count)} µm {trial}"


def _directions(repair: Repair, judged: Verdict) -> str:
    names = list(
        dict.fromkeys(name for k in repair.removes for name in changed_names(judged.null[k]))
    )
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"{_numbers(repair)} ({', '.join(names[:MOST_NAMES])}{more})"


def _numbers(repair: Repair) -> str:
    numbers = [k + 1 for k in repair.removes]
    if len(numbers) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1)):
        return f"undetermined {numbers[0]} to {numbers[-1]}"
    return f"undetermined {listed(list(map(str, numbers)))}"


def certificate_lines(certificate: ScaleCertificate | None) -> list[str]:
    """Return lines of the certificate that provides scale, with its change of the file, if one is
    needed.
    """
    if certificate is None:
        return []
    if certificate.change is None:
        return ["scale: no single calibrated distance that was tried can replace the probe offsets"]
    u, average = f"{1e6 * certificate.offset_uncertainty:g}", number(1e6 * certificate.average)
    words = (
        f"scale: {certificate.change.words}: average U6 {average} µm with {u} µm on the probe"
        " offsets"
    )
    return [words, *(f"scale, in the file: {edit}" for edit in certificate.edits)]


def certificate_data(certificate: ScaleCertificate | None) -> Data | None:
    """Return that certificate as plain data in metres, if one is needed; without a text if the
    search failed.
    """
    if certificate is None:
        return None
    return {
        "text": None if certificate.change is None else certificate.change.words,
        "offset_uncertainty": certificate.offset_uncertainty,
        "average_U6": finite(certificate.average),
        "edits": _edit_data(certificate.edits),
    }


def repair_data(repairs: Repairs | None) -> Data | None:
    """Return repairs as plain data in metres at full precision, if any are needed."""
    if repairs is None:
        return None
    return {
        "complete": [_data(repair) for repair in repairs.complete],
        "partial": [_data(repair) for repair in repairs.partial],
    }


def _data(repair: Repair) -> Data:
    u6 = None if repair.prediction is None else repair.prediction.quantities.get("U6")
    loose = repair.loosened
    return {
        "changes": [
            {"kind": KINDS[change.kind], "text": change.words} for change in repair.changes
        ],
        "rank_deficiency": repair.deficiency,
        "removes": [k + 1 for k in repair.removes],
        "weakly_determined": repair.weak,
        "weakest": repair.worst,
        "smallest_singular_value": repair.smallest,
        "average_U6": None if u6 is None else finite(u6.average),
        "average_U6_with_uncertain_offsets": None if loose is None else loose.total / loose.count,
        "offset_uncertainty": OFFSET_TRIAL,
        "rests_on_exact_offsets": repair.rests_on_offsets,
        "qualifications": qualification_data(
            () if repair.prediction is None else repair.prediction.qualifications
        ),
        **picked(repair, "readings", "seconds"),
        "edits": _edit_data(repair.edits),
    }


def _edit_data(edits: Sequence[Edit]) -> list[Data]:
    return [{"path": edit.path, "adds": edit.is_new, "value": edit.value} for edit in edits]
