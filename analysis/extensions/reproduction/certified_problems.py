"""Certified problems in files: a design, readings, and answers computed in many digits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs import ExperimentError, Message, hint, refused, shorten

# Larger than any meaningful number, and smaller than the largest float.
LARGE = 1e150


@dataclass(frozen=True)
class CertifiedProblem:
    """A problem with its certified `answers`, as under `certified` in its file `path`, in SI units.

    An experiment file with the same design, and its readings, are in the same folder.
    """

    name: str
    title: str
    path: Path
    answers: dict[str, Any]

    @property
    def experiment_file(self) -> Path:
        return self.path.with_suffix(".yaml")

    @property
    def readings_file(self) -> Path | None:
        """Readings; None of a problem that is only planned."""
        return self.path.with_suffix(".csv") if "estimate" in self.answers else None


def certified_problems(folder: Path, names: list[str]) -> list[CertifiedProblem]:
    """Return the problems in a folder by name, or those `names`.

    :raises ExperimentError: a missing folder or problem, or an invalid file.
    """
    paths = {path.stem: path for path in sorted(folder.glob("*.json"))}
    if not paths:
        text = (
            "no certified problems here; name their folder, designs/certified in a checkout, with"
            " --designs"
        )
        raise refused(folder, text)
    unknown = [name for name in names if name not in paths]
    if unknown:
        messages = [
            Message(str(folder), 0, 0, "", f'no problem "{name}"; {hint(name, paths)}')
            for name in unknown
        ]
        raise ExperimentError(messages)
    return [_problem(paths[name]) for name in names or paths]


def _problem(path: Path) -> CertifiedProblem:
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("certified"), dict):
        raise refused(path, 'no certified problem: it has no key "certified"')
    for key in data["certified"].keys() & {"as_drawn", "estimate"}:
        fault = _fault(data["certified"][key])
        if fault:
            text = f"{fault}; write the file again, or use the shipped one"
            raise refused(path, text, f"certified.{key}")
    return CertifiedProblem(
        str(data.get("name", path.stem)), str(data.get("title", "")), path, data["certified"]
    )


def _fault(answers: Any) -> str | None:
    """Return the reason why certified answers cannot be compared; None for valid ones."""
    if not isinstance(answers, dict) or not isinstance(answers.get("uncertainties"), dict):
        return 'has no mapping "uncertainties"'
    for symbol, uncertainty in answers["uncertainties"].items():
        if not isinstance(uncertainty, dict):
            return f"{symbol} is no mapping"
        for key in ("count", "undetermined"):
            if type(uncertainty.get(key)) is not int:
                return f'{symbol} has no whole number "{key}"'
        for key in ("maximum", "average"):
            is_undetermined = (
                key in uncertainty and uncertainty["maximum" if key == "average" else key] is None
            )
            if not is_undetermined and not (
                _is_number(uncertainty.get(key)) and uncertainty[key] > 0.0
            ):
                return f'{symbol} has no number "{key}" above zero'
    if "sum_of_squares" in answers and not _is_number(answers["sum_of_squares"]):
        return '"sum_of_squares" is no number'
    for group in answers.keys() & {"machine", "balls", "origins"}:
        if not _are_numbers(answers[group]):
            return f'"{group}" is not of numbers alone'
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGE


def _are_numbers(value: Any) -> bool:
    """Return whether a value is a number, or a list or mapping of numbers."""
    parts = (
        value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    )
    return _is_number(value) if parts is None else all(map(_are_numbers, parts))


def read_results(path: Path, problems: Sequence[CertifiedProblem]) -> dict[str, Any]:
    """Return a program's answers by problem: the mapping under `problems` of a JSON file.

    :raises ExperimentError: an invalid file, or an unknown problem.
    """
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("problems"), dict):
        text = (
            'expected {"problems": {NAME: {"as_drawn": …, "estimate": …}}} as in'
            " docs/documents/certified.md"
        )
        raise refused(path, text)
    names = {path.stem for problem in problems for path in problem.path.parent.glob("*.json")}
    messages = [
        Message(
            str(path),
            0,
            0,
            "problems",
            f'no problem "{shorten(name)}"; {hint(name, sorted(names))}',
        )
        for name in data["problems"]
        if name not in names
    ]
    if messages:
        raise ExperimentError(messages)
    return data["problems"]


def read_json(path: Path) -> Any:
    """Return the content of a JSON file.

    :raises ExperimentError: it cannot be read, or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise refused(path, f"cannot be read ({error.strerror}); name a JSON file") from None
    except (ValueError, RecursionError) as error:
        line, column = getattr(error, "lineno", 0), getattr(error, "colno", 0)
        raise refused(
            path, f"is not JSON ({error}); write it again", line=line, column=column
        ) from None
