"""Certified problems as they stand in files: a design, readings, and answers computed in many
digits.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs import ExperimentError, Message, hint, refused, shorten

# Above any number that means something here, and below where a float ends.
LARGE = 1e150


@dataclass(frozen=True)
class CertifiedProblem:
    """A problem and what is certified of it: `answers` as they stand under `certified` in its file,
    SI units.

    `path` is the problem's file; the same design as an experiment file and its readings lie beside
    it.
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
        """The readings; None of a problem that is only planned."""
        return self.path.with_suffix(".csv") if "estimate" in self.answers else None


def certified_problems(folder: Path, names: list[str]) -> list[CertifiedProblem]:
    """The problems in a folder by name, or those `names`.

    :raises ExperimentError: there is no such folder or problem, or a file is not one of a problem.
    """
    found = {path.stem: path for path in sorted(folder.glob("*.json"))}
    if not found:
        text = (
            "no certified problems here; name their folder, designs/certified in a checkout, with"
            " --designs"
        )
        raise refused(folder, text)
    unknown = [name for name in names if name not in found]
    if unknown:
        messages = [
            Message(str(folder), 0, 0, "", f'no problem "{name}"; {hint(name, found)}')
            for name in unknown
        ]
        raise ExperimentError(messages)
    return [_problem(found[name]) for name in names or found]


def _problem(path: Path) -> CertifiedProblem:
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("certified"), dict):
        raise refused(path, 'no certified problem: it has no key "certified"')
    for part in data["certified"].keys() & {"as_drawn", "estimate"}:
        complaint = _complaint(data["certified"][part])
        if complaint:
            text = f"{complaint}; make the file anew, or take the shipped one"
            raise refused(path, text, f"certified.{part}")
    return CertifiedProblem(
        str(data.get("name", path.stem)), str(data.get("title", "")), path, data["certified"]
    )


def _complaint(answers: Any) -> str | None:
    """What keeps certified answers from being compared with, None where nothing does."""
    if not isinstance(answers, dict) or not isinstance(answers.get("uncertainties"), dict):
        return 'has no mapping "uncertainties"'
    for symbol, one in answers["uncertainties"].items():
        if not isinstance(one, dict):
            return f"{symbol} is no mapping"
        for key in ("count", "undetermined"):
            if type(one.get(key)) is not int:
                return f'{symbol} has no whole number "{key}"'
        for key in ("maximum", "average"):
            is_undetermined = key in one and one["maximum" if key == "average" else key] is None
            if not is_undetermined and not (_is_number(one.get(key)) and one[key] > 0.0):
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
    """A number, or a list or mapping of such."""
    parts = (
        value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    )
    return _is_number(value) if parts is None else all(map(_are_numbers, parts))


def read_results(path: Path, problems: Sequence[CertifiedProblem]) -> dict[str, Any]:
    """Answers of a program by the names of problems: the mapping under `problems` of a JSON file.

    :raises ExperimentError: it is no such file, or names a problem that is none.
    """
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("problems"), dict):
        text = (
            'expected {"problems": {NAME: {"as_drawn": …, "estimate": …}}} as in'
            " docs/documents/certified.md"
        )
        raise refused(path, text)
    known = {path.stem for one in problems for path in one.path.parent.glob("*.json")}
    messages = [
        Message(
            str(path),
            0,
            0,
            "problems",
            f'no problem "{shorten(name)}"; {hint(name, sorted(known))}',
        )
        for name in data["problems"]
        if name not in known
    ]
    if messages:
        raise ExperimentError(messages)
    return data["problems"]


def read_json(path: Path) -> Any:
    """What a JSON file holds.

    :raises ExperimentError: it cannot be read, or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise refused(path, f"cannot be read ({error.strerror}); name a JSON file") from None
    except (ValueError, RecursionError) as error:
        line, column = getattr(error, "lineno", 0), getattr(error, "colno", 0)
        raise refused(
            path, f"is not JSON ({error}); write it anew", line=line, column=column
        ) from None
