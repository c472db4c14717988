"""Checked files as workflow commands of GitHub Actions, which mark the lines of a pull request."""

from __future__ import annotations

import os
from pathlib import Path

from ballplate.results import CheckedDesign, CheckedFile, scale_lines, target_lines, verdict_lines
from ballplate.simulator.inputs import in_lines, in_one_line


def annotation_lines(checked: CheckedFile, workspace: Path | None = None) -> list[str]:
    """Return one line per error of a file and per design, without a mark if as expected.

    File names are relative to `workspace`, the top of the repository, if they are in it.
    """
    lines = [
        _error(
            checked.file if not message.line else message.file,
            message.line,
            message.column,
            "experiment file",
            str(message),
            workspace,
        )
        for message in checked.messages
    ]
    return lines + [
        line
        for design in checked.designs
        for line in _design_lines(checked.file, design, workspace)
    ]


def _design_lines(file: str, design: CheckedDesign, workspace: Path | None) -> list[str]:
    prediction = design.prediction
    lines = [
        *verdict_lines(prediction.verdict, lengths=prediction.lengths),
        *target_lines(prediction.lengths),
        *prediction.qualified,
        *scale_lines(prediction.scale),
    ]
    advice = prediction.advice
    suggested = () if advice is None else advice.lines
    if design.place is None:
        # What stands before the name keeps it from being read as a command, and so does the space
        # after a hash.
        first = "; ".join([lines[0], *prediction.qualified])
        start = f"as expected: {file}: {design.prediction.label}: "
        return [
            in_one_line(f"{start}{line}").replace("##[", "# #[") for line in (first, *suggested)
        ]
    place = design.place
    # The log of a run shows only the message, so that it names the place again.
    text = "\n".join(
        [
            f"{place.file}:{place.line}:{place.column}: {prediction.label}: {lines[0]}",
            *lines[1:],
            *suggested,
        ]
    )
    subject = f"{'rank' if prediction.verdict.complaint else 'goals'} of {prediction.label}"
    return [_error(place.file, place.line, place.column, subject, text, workspace)]


def _error(file: str, line: int, column: int, title: str, text: str, workspace: Path | None) -> str:
    place = {"file": _named_from(workspace, file)}
    if line:
        place |= {"line": str(line), "col": str(column)}
    place["title"] = title
    properties = ",".join(f"{key}={in_property(value)}" for key, value in place.items())
    return f"::error {properties}::{in_message(text)}"


def _named_from(workspace: Path | None, file: str) -> str:
    if workspace is None:
        return file
    path = Path(os.path.abspath(file))
    return path.relative_to(workspace).as_posix() if path.is_relative_to(workspace) else file


def in_message(text: str) -> str:
    r"""A text as the message of a workflow command.

    >>> in_message("5 %\nnext")
    '5 %25%0Anext'
    """
    return in_lines(text).replace("%", "%25").replace("\n", "%0A")


def in_property(text: str) -> str:
    """A text as a property of a workflow command, where colons and commas have a meaning as well.

    >>> in_property("a, b: 100 %")
    'a%2C b%3A 100 %25'
    """
    return in_message(text).replace(":", "%3A").replace(",", "%2C")
