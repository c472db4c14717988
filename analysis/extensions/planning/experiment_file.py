"""Experiment file of the chosen design, in plain YAML, with the durations of the pool."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from ballplate.simulator.experiment import (
    KINDS,
    Candidate,
    Experiment,
    Pool,
    Position,
    TimesSettings,
)
from ballplate.simulator.inputs import (
    format_duration,
    in_one_line,
    provided,
    service,
    to_list,
    to_python,
    yaml_text,
)

from .pools import READING, SET_UP

LEFT_OUT = ("pool", "variants", "expected_rank_deficiency")

# Where an experiment names files, and code of its own; EACH is every entry of a list or mapping.
EACH = "*"
FILES: tuple[tuple[str, ...], ...] = (
    ("error_model", "file"),
    ("true_machine", "file"),
    ("true_machine", "files"),
    ("true_machine", "error_model", "file"),
    ("artefacts", EACH, "file"),
    ("calibration", EACH, "values"),
    ("calibration", EACH, "covariance"),
    ("stars", EACH, "values"),
    ("stars", EACH, "covariance"),
    ("influences", EACH, "values"),
    ("influences", EACH, "covariance"),
    ("readings", "files"),
    ("readings", "compensation", "file"),
    ("evaluation", "points", "file"),
)
CODE: tuple[tuple[str, ...], ...] = (
    ("error_model",),
    ("true_machine", "error_model"),
    ("calibration", EACH),
    ("influences", EACH),
)


def experiment_text(
    experiment: Experiment,
    chosen: Sequence[Candidate],
    header: str,
    folder: Path,
    expected_rank_deficiency: int | None = None,
) -> str:
    """Return the text of an experiment file for a folder, with the chosen candidates, positions in
    their order.

    `experiment` is loaded for planning; overrides of a variant are applied. `header` becomes
    comments at the top. File names are relative to `folder`. A stated rank deficiency is omitted
    unless one is given, as are artefacts without a chosen position and their certificates. A pool
    of times alone has the durations of positions.
    """
    content = _content(experiment, chosen)
    if expected_rank_deficiency is not None:
        content["expected_rank_deficiency"] = expected_rank_deficiency
    source = experiment.source.parent
    if folder.resolve() != source.resolve():
        content = _moved(content, source, folder)
    comments = "".join(f"# {in_one_line(line)}\n" for line in header.splitlines())
    sections = (
        yaml_text({key: value}, None if isinstance(value, dict | list) else False)
        for key, value in content.items()
    )
    return "\n".join([comments, *sections])


def _content(experiment: Experiment, chosen: Sequence[Candidate]) -> dict[str, Any]:
    settings: dict[str, Any] = to_list(to_python(experiment.tree))
    positions = [candidate for candidate in chosen if isinstance(candidate.item, Position)]
    placed = {position.item.artefact for position in positions}
    # Where there is one artefact, nothing says which.
    only = next(iter(settings["artefacts"]))
    items = [
        calibration
        for calibration in settings.get("calibration", [])
        if str(calibration.get("artefact", only)) in placed
        or is_of_machine(str(calibration.get("kind")))
    ]
    items += [
        to_list(candidate.settings)
        for candidate in chosen
        if not isinstance(candidate.item, Position) and candidate.item.artefact in {*placed, ""}
    ]
    settings["artefacts"] = {
        name: entry for name, entry in settings["artefacts"].items() if name in placed
    }
    settings["positions"] = [to_list(position.settings) for position in positions]
    settings["calibration"] = items
    pool = experiment.pool
    if pool is not None:
        names = {candidate.name for candidate in pool.candidates}
        unused = names - {position.name for position in positions}
        influences = (_of_chosen(entry, unused) for entry in settings.get("influences", ()))
        settings["influences"] = [entry for entry in influences if entry]
    content = {
        key: value
        for key, value in settings.items()
        if key not in LEFT_OUT and (value != [] or key == "positions")
    }
    if pool is not None:
        content["pool"] = {"times": _times(settings, pool, chosen)}
    return content


def _of_chosen(influence: dict[str, Any], unused: Collection[str]) -> dict[str, Any]:
    """Return the settings of an influence quantity without positions in `unused`; empty if it
    concerns only these.
    """
    settings = {key: setting for key, setting in influence.items() if key != "positions"}
    stated = influence.get("positions", {})
    if isinstance(stated, Mapping):
        kept = {name: effect for name, effect in stated.items() if name not in unused}
        return settings | ({"positions": kept} if kept else {})
    names = [name for name in stated if name not in unused]
    return settings | {"positions": names} if names else {}


def _times(settings: Mapping[str, Any], pool: Pool, chosen: Sequence[Candidate]) -> dict[str, Any]:
    """Durations, and chosen positions with durations of their own, in the form of a pool."""
    times = {
        key: entry
        for key, entry in settings.get("pool", {}).get("times", {}).items()
        if key != "positions"
    }
    common = TimesSettings.model_validate(times)
    own_times: dict[str, dict[str, str]] = {}
    for entry in chosen:
        if isinstance(entry.item, Position):
            changes = (len(entry.item.probes) - 1) * pool.changes.probe
            set_up = entry.seconds - entry.readings * entry.reading_seconds - changes
            defaults = {"set_up": (set_up, common.set_up, SET_UP)}
            defaults["reading"] = (entry.reading_seconds, common.reading, READING)
            differ = {
                key: format_duration(value)
                for key, (value, given_value, default) in defaults.items()
                if abs(value - (default if given_value is None else given_value)) > 1e-6
            }
            own_times |= {entry.name: differ} if differ else {}
    return {**times, **({"positions": own_times} if own_times else {})}


def _moved(content: dict[str, Any], source: Path, folder: Path) -> dict[str, Any]:
    """Return content with file names and modules relative to another folder."""

    def there(name: Any) -> Any:
        if isinstance(name, list):
            return list(map(there, name))
        if not isinstance(name, str) or Path(name).is_absolute():
            return name
        target = (source / name).resolve()
        try:
            return Path(os.path.relpath(target, folder.resolve())).as_posix()
        except ValueError:
            # On Windows nothing leads from one drive to another.
            return target.as_posix()

    def code(settings: Any) -> Any:
        if not isinstance(settings, dict) or settings.get("kind") != "python":
            return settings
        beside = settings.get("folder", ".")
        module = str(settings["object"]).partition(":")[0]
        if service("module_file")((source / beside).resolve(), module) is None:
            return settings
        return {**settings, "folder": there(beside)}

    for steps in FILES:
        content = _changed(content, steps, there)
    for steps in CODE:
        content = _changed(content, steps, code)
    return content


def _changed(settings: Any, steps: Sequence[str], change: Callable[[Any], Any]) -> Any:
    """Return settings with a change of what is under `steps`, as far as it is there."""
    if not steps:
        return change(settings)
    step, *further = steps
    if step == EACH and isinstance(settings, list):
        return [_changed(entry, further, change) for entry in settings]
    if not isinstance(settings, dict):
        return settings
    keys = settings if step == EACH else settings.keys() & {step}
    return {**settings, **{key: _changed(settings[key], further, change) for key in keys}}


def is_of_machine(kind: str) -> bool:
    """True if items of a kind are of no artefact."""
    settings = None if kind in KINDS else provided("calibrations", kind, "SETTINGS")
    return settings is not None and "artefact" not in settings.model_fields
