"""Repairs as lines of text and as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...rank.proposed_bars import listed
from ...rank.verdict import Direction, Verdict, length
from ...results.formatting import finite, number
from .changes import KINDS

if TYPE_CHECKING:
    from .scale import ScaleCertificate
    from .search import Repair, Repairs

# Names of errors that a line has room for.
MOST_NAMES = 8


def repair_lines(found: Repairs | None, judged: Verdict) -> list[str]:
    """What was found, one repair after the other, each with what the file is to say; nothing where
    all is well.
    """
    if found is None:
        return []
    lines = []
    for k, one in enumerate(found.complete, start=1):
        lines.append(f"repair {k}: {_changes(one)}: {_worth(one, judged)}")
        lines += [f"repair {k}, in the file: {edit}" for edit in one.edits]
    if not found.complete:
        tried = _tried(found)
        lines.append(f"repair: no changes were found after which nothing is open; {tried}")
    for one in found.partial:
        lines.append(
            f"repair of {_directions(one, judged)} alone: {_changes(one)}: leaves"
            f" {_rank(one.deficiency)}"
        )
        lines += [f"repair of {_numbers(one)} alone, in the file: {edit}" for edit in one.edits]
    return lines


def _changes(one: Repair) -> str:
    return "; and ".join(change.words for change in one.changes)


def _rank(deficiency: int) -> str:
    return f"rank deficiency {deficiency}" if deficiency else "full rank"


def _worth(one: Repair, judged: Verdict) -> str:
    words = _rank(one.deficiency)
    if one.weak:
        count = "1 direction is" if one.weak == 1 else f"{one.weak} directions are"
        words += (
            f", but {count} weakly determined, the weakest known only to {length(one.worst)} in"
            " corrected points"
        )
    elif one.is_faint:
        words += ", but hardly: see the smallest singular value"
    else:
        words += ", and nothing is weakly determined"
    if one.removes:
        words += f"; removes {_directions(one, judged)}"
    u6 = None if one.prediction is None else one.prediction.quantities.get("U6")
    if u6 is not None:
        words += f"; average U6 {number(1e6 * u6.average)} um"
    return f"{words}; smallest singular value {one.smallest:.3g}"


def _directions(one: Repair, judged: Verdict) -> str:
    names = list(dict.fromkeys(name for k in one.removes for name in _names(judged.null[k])))
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"{_numbers(one)} ({', '.join(names[:MOST_NAMES])}{more})"


def _numbers(one: Repair) -> str:
    numbers = [k + 1 for k in one.removes]
    if len(numbers) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1)):
        return f"undetermined {numbers[0]} to {numbers[-1]}"
    return f"undetermined {listed(list(map(str, numbers)))}"


def _names(direction: Direction) -> list[str]:
    """Errors that a direction changes, or else what it changes instead."""
    if direction.functions:
        return [part.name for part in direction.functions]
    artefacts, lengths = (
        [part.name for part in direction.artefacts],
        [part.name for part in direction.lengths],
    )
    return [
        *artefacts,
        *lengths,
        *(part.name for part in (*direction.probes, *direction.positions)),
    ]


def _tried(found: Repairs) -> str:
    if not found.tried:
        return "there is nothing that could be changed in general"
    counts = ", ".join(f"{count} {KINDS[kind]}" for kind, count in found.tried.items())
    return (
        f"tried: {counts}, and {found.sets} sets of several" if found.sets else f"tried: {counts}"
    )


def certificate_lines(found: ScaleCertificate | None) -> list[str]:
    """The certificate that carries scale, with what the file is to say; nothing where none is
    needed.
    """
    if found is None:
        return []
    if found.change is None:
        return [
            "scale: no single calibrated distance that was tried carries it in place of the probe"
            " offsets"
        ]
    u, average = f"{1e6 * found.offset_uncertainty:g}", number(1e6 * found.average)
    words = f"scale: {found.change.words}: average U6 {average} um with {u} um on the probe offsets"
    return [words, *(f"scale, in the file: {edit}" for edit in found.edits)]


def certificate_data(found: ScaleCertificate | None) -> dict[str, Any] | None:
    """The same as plain data in metres; None where none is needed, and without a text where none
    was found.
    """
    if found is None:
        return None
    return {
        "text": None if found.change is None else found.change.words,
        "offset_uncertainty": found.offset_uncertainty,
        "average_U6": finite(found.average),
        "edits": [
            {"path": edit.path, "adds": edit.is_new, "value": edit.value} for edit in found.edits
        ],
    }


def repair_data(found: Repairs | None) -> dict[str, Any] | None:
    """Repairs as plain data in metres at full precision; None where nothing is to be repaired."""
    if found is None:
        return None
    return {
        "complete": [_data(one) for one in found.complete],
        "partial": [_data(one) for one in found.partial],
        "tried": {KINDS[kind]: count for kind, count in found.tried.items()},
        "sets_tried": found.sets,
    }


def _data(one: Repair) -> dict[str, Any]:
    u6 = None if one.prediction is None else one.prediction.quantities.get("U6")
    return {
        "changes": [{"kind": KINDS[change.kind], "text": change.words} for change in one.changes],
        "rank_deficiency": one.deficiency,
        "removes": [k + 1 for k in one.removes],
        "weakly_determined": one.weak,
        "weakest": one.worst,
        "smallest_singular_value": one.smallest,
        "average_U6": None if u6 is None else finite(u6.average),
        "edits": [
            {"path": edit.path, "adds": edit.is_new, "value": edit.value} for edit in one.edits
        ],
    }
