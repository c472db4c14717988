"""Repairs that `ballplate check` writes into files."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

from ballplate.cli import check_overwritten, note, write_outputs
from ballplate.results import CheckedDesign, CheckedFile, Wanted, advised, check_files
from ballplate.simulator.inputs import ExperimentError, Message, read_text, refused

from .mending import mended
from .repairs import Repairs

MARK = "\ufeff"
BAD_FILE = 3


def with_repairs(
    checked: CheckedFile, wanted: Wanted, options: Namespace
) -> tuple[CheckedFile, int]:
    """Write the best repair of each design that invents nothing into a checked file and return its
    new check.

    Unrepaired designs keep their suggestions. The number is the least exit status.
    """
    path = Path(checked.file)
    messages: list[Message] = []
    statuses = []
    status = 0
    try:
        mark, text = _text(path) if checked.designs else ("", "")
        new = text
        for design in checked.designs:
            found, judged = _suggestions(design), design.prediction.verdict
            repair = found.to_write(judged, wanted.nothing_weak)
            name = f"{path}: {design.prediction.label}"
            is_bad = judged.deficiency or wanted.nothing_weak
            if is_bad and found.repairs and found.repairs[0].invents:
                words = "a certificate or a probe that the file does not state"
                statuses.append(f"{name}: not written, {words}: {found.repairs[0].words}")
            if repair is None:
                if not judged.deficiency:
                    statuses.append(f"{name}: nothing to repair")
                continue
            try:
                new = mended(new, path, design.variant, repair, wanted.trust(path))
            except ExperimentError as error:
                messages += error.messages
                continue
            statuses.append(f"{name}: repaired: {repair.words}")
        if new != text:
            status = _write(path, mark, text, new, options)
    except ExperimentError as error:
        status = BAD_FILE
        messages += error.messages
    for line in statuses if status != BAD_FILE else ():
        note(options, line)
    if not status and new != text:
        (checked,) = check_files([path], options.variant, wanted)
    designs = tuple(_as_asked(design, options.suggest) for design in checked.designs)
    return replace(checked, designs=designs, messages=(*checked.messages, *messages)), status


def _as_asked(design: CheckedDesign, with_suggestions: bool) -> CheckedDesign:
    """Remove suggestions of sufficient designs, unless requested."""
    if with_suggestions or design.prediction.verdict.deficiency:
        return design
    return advised(replace(design, suggestions=Repairs()))


def _suggestions(design: CheckedDesign) -> Repairs:
    """Return the suggestions of a design; empty without a search."""
    return design.suggestions if isinstance(design.suggestions, Repairs) else Repairs()


def _text(path: Path) -> tuple[str, str]:
    """Return the byte order mark of a file, possibly empty, and its text.

    :raises ExperimentError: it is not a file that can be changed.
    """
    if not path.is_file():
        raise refused(path, "is not a file that can be changed")
    text = read_text(path)
    return MARK if path.read_bytes().startswith(MARK.encode()) else "", text


def _write(path: Path, mark: str, text: str, new: str, options: Namespace) -> int:
    """Replace a file that still has the old text; return the exit status.

    :raises ExperimentError: the text has changed, or the file cannot be written.
    """
    check_overwritten(path)
    if _text(path) != (mark, text):
        changed = "the file has changed meanwhile and is not overwritten; start again"
        raise refused(path, changed)
    content = (mark + new).encode()
    is_written = write_outputs({path: lambda place: place.write_bytes(content)}, True)
    return 0 if is_written else BAD_FILE
