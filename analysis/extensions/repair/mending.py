"""Changes of an experiment written into its file, with the text about them kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ballplate.simulator.experiment import Experiment, load, place_of
from ballplate.simulator.inputs import (
    Mapping as MappingNode,
    Node,
    Steps,
    format_path,
    mark_of,
    parse_tree,
    to_python,
    written,
)

from .written import Edit, edits, lacks_probes, position_settings
from .yamltext import TextChange, changed_data, with_changes

PLACEMENT = ("plane", "level", "corner", "centre", "quarter_turns", "pose")
READINGS = ("probes", "balls", "repeats", "standard_uncertainty", "readings")


def with_experiment(
    text: str,
    source: Path,
    experiment: Experiment,
    changed: Experiment,
) -> str:
    """Return the text of an experiment's file with the changes of the experiment; values that a
    variant inherits are changed for that variant alone.

    An experiment that was loaded with its faults may have some afterwards.

    :raises ExperimentError: writing would change neighbouring text, or text that aliases refer to.
    """
    is_tolerant = experiment.faults is not None
    before = {experiment.name: experiment}
    if experiment.name is not None:
        before = {
            variant_experiment.name: variant_experiment
            for variant_experiment in load(source, True, experiment.trust, text, is_tolerant)
        }
    # A variant with more entries of a list has a list of its own, in which the others are changed.
    changes = sorted(
        changes_of(experiment, edits(experiment, changed)), key=lambda change: len(change.steps)
    )
    new = with_text_changes(text, source, experiment.name, changes)
    after = {
        variant_experiment.name: variant_experiment
        for variant_experiment in load(source, True, experiment.trust, new, is_tolerant)
    }
    others_differ = before.keys() != after.keys() or any(
        to_python(before[name].tree) != to_python(variant_experiment.tree)
        for name, variant_experiment in after.items()
        if name != experiment.name
    )
    written_as = after.get(experiment.name, experiment)
    if others_differ or edits(written_as, changed) or edits(changed, written_as):
        text = "the change cannot be written in this form; write it by hand"
        raise experiment.refused((), text)
    return new


def with_text_changes(
    text: str, source: Path, variant: str | None, changes: Iterable[TextChange]
) -> str:
    """Return the text with changes of a variant, or of its only experiment.

    :raises ExperimentError: as for `with_experiment`.
    """
    if variant is None:
        return with_changes(text, str(source), changes)
    for change in changes:
        in_file = _in_file(parse_tree(text, str(source)), variant, change)
        text = with_changes(text, str(source), [in_file])
    return text


def changes_of(experiment: Experiment, needed: Iterable[Edit]) -> Iterator[TextChange]:
    """Return the necessary changes of the experiment's file, for a variant those of its tree."""
    experiment_settings = to_python(experiment.tree)
    places = {place.name: place for place in experiment.positions}
    needed = tuple(needed)
    if len(experiment.probes) == 1 and any(edit.steps[0] == "probes" for edit in needed):
        # With more probes than one, what a pool offers has to name its own, too.
        offered = (experiment_settings.get("pool") or {}).get("candidates") or ()
        for k, entry in enumerate(offered):
            for i, group in enumerate(entry.get("readings", [entry])):
                if "probes" not in group:
                    inner = ("readings", i) if "readings" in entry else ()
                    yield TextChange(
                        ("pool", "candidates", k, *inner, "probes"), [*experiment.probes]
                    )
    for edit in needed:
        if edit.steps[0] == "positions" and not edit.is_new:
            name = str(edit.steps[1])
            index = next(
                i
                for i, entry in enumerate(experiment_settings["positions"])
                if str(entry["name"]) == name
            )
            settings = position_settings(experiment, places[name])
            steps = ("positions", index)
            if lacks_probes(experiment_settings["positions"][index]):
                for group in settings.get("readings", [settings]):
                    group.pop("probes", None)
            if places[name].parts and any(
                settings.get(key) != edit.value.get(key) for key in READINGS
            ):
                # Other readings have another room, and the pose stays.
                settings = {key: settings[key] for key in settings if key not in PLACEMENT}
            yield from _of_position(
                steps, experiment_settings["positions"][index], settings, edit.value
            )
        else:
            yield TextChange(edit.steps, edit.value, "append" if edit.is_new else "set")


def _of_position(
    steps: Steps, settings: Mapping[str, Any], before: dict[str, Any], after: dict[str, Any]
) -> Iterator[TextChange]:
    """Return the changes of a position in a file, whose settings were `before`, in the form the
    file uses.
    """
    for group in (PLACEMENT, READINGS):
        if {key: before.get(key) for key in group} == {key: after.get(key) for key in group}:
            continue
        for key in group:
            if key in settings and key not in after:
                yield TextChange((*steps, key), kind="remove")
        for key in group:
            if key in after:
                yield from _of_value((*steps, key), settings.get(key), before.get(key), after[key])


def _of_value(steps: Steps, setting: Any, before: Any, after: Any) -> Iterator[TextChange]:
    """The smallest changes of a value that lead from `before` to `after`."""
    if setting is not None and before == after:
        return
    forms = (setting, before, after)
    if (
        all(isinstance(form, dict) for form in forms)
        and setting.keys() == before.keys() == after.keys()
    ):
        for key, value in after.items():
            yield from _of_value((*steps, key), setting[key], before[key], value)
        return
    if all(isinstance(form, list | tuple) for form in forms) and len(setting) == len(before):
        if len(after) == len(before):
            for i, value in enumerate(after):
                yield from _of_value((*steps, i), setting[i], before[i], value)
            return
        if after[: len(before)] == before:
            yield from (TextChange(steps, value, "append") for value in after[len(before) :])
            return
    yield TextChange(steps, after)


def _in_file(root: Node, variant: str, change: TextChange) -> TextChange:
    """Return the change for one variant, whose new values have paths.

    :raises ExperimentError: the variant already has a value below this path.
    """
    overrides = written(root, "variants", variant)
    assert isinstance(root, MappingNode) and isinstance(overrides, MappingNode)
    place = tuple(map(str, change.steps))
    # A new value is one for a whole entry, and cannot take one away.
    whole = change.steps[: -1 if change.kind == "remove" else 3]
    for path in overrides.items:
        own_place = place_of(root, path)
        if place[: len(own_place)] == own_place:
            steps = ("variants", variant, path, *change.steps[len(own_place) :])
            return TextChange(steps, change.value, change.kind)
        if own_place[: len(whole)] == tuple(map(str, whole)):
            mark = mark_of(root, ("variants", variant, path), of_key=True)
            place_text = format_path(whole)
            text = f"the change concerns {place_text}, which includes this; write it by hand"
            raise mark.refused(text, format_path(("variants", variant)))
    settings: Any = changed_data(to_python(root), change)
    for step in whole:
        settings = settings[step]
    return TextChange(("variants", variant, _path_of(root, whole)), settings)


def _path_of(root: Node, steps: Steps) -> str:
    """Return the path for a variant, with a position's name if that is unique."""
    if len(steps) > 1 and isinstance(steps[1], int):
        name = written(root, steps[0], steps[1], "name")
        named = f"{steps[0]}[{getattr(name, 'value', '')}]"
        path = named + "".join(f".{step}" for step in steps[2:])
        try:
            if place_of(root, path) == tuple(map(str, steps)):
                return path
        except ValueError:
            pass
    return format_path(steps)
