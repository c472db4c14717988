"""Experiment file of the chosen design, without a pool.

Unchanged sections keep text and comments. The composed text is read again and compared with the
intended content; a file of unusual form is then written as a whole instead of wrongly.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from ballplate.simulator.design.observations.kinds import is_of_machine
from ballplate.simulator.experiment.model import Candidate, Experiment, Pool, Position
from ballplate.simulator.experiment.pool_sections import TimesSettings
from ballplate.simulator.experiment.pools import READING, SET_UP
from ballplate.simulator.experiment.sections import ExperimentSettings
from ballplate.simulator.experiment.variants import variant_trees
from ballplate.simulator.inputs.messages import ExperimentError, format_path, in_one_line
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantities import format_duration
from ballplate.simulator.inputs.yaml_writing import PlainDumper, yaml_text
from ballplate.simulator.inputs.yamltree import (
    LOADER,
    Node,
    parse_tree,
    read_text,
    to_list,
    to_python,
)
from ballplate.simulator.inputs.yamltree import Mapping as MappingNode
from ballplate.simulator.machines.custom import module_file

from .short_names import renamed, renamed_of_all

LEFT_OUT = ("pool", "variants", "expected_rank_deficiency")
SCHEMA_LINE = "# yaml-language-server:"


def experiment_text(
    experiment: Experiment,
    chosen: Sequence[Candidate],
    header: str,
    folder: Path,
    title: str | None = None,
    expected_rank_deficiency: int | None = None,
    names: Mapping[str, str] | None = None,
    of_influences: Mapping[int, dict[str, Any]] | None = None,
    with_times: bool = False,
) -> str:
    """Return the text of an experiment file for a folder, with the chosen candidates, positions in
    their order.

    `experiment` is the source, loaded for planning; overrides of a variant are applied. `header`
    becomes comments at the top. File names are relative to `folder`. A stated rank deficiency is
    omitted unless one is given, as are artefacts without a chosen position, their certificates,
    and priors of other positions. `names` are short names by names in the pool. `of_influences`
    are changed keys of influence quantities by index. `with_times` adds a pool with the durations
    of positions.

    An experiment made or changed in Python, or whose file is gone, keeps no comments.

    :raises ExperimentError: the source cannot be read.
    """
    source = experiment.source
    text, root, tree = _source(experiment)
    assert isinstance(root, MappingNode) and isinstance(tree, MappingNode)
    content = _content(tree, experiment, chosen, names or {}, of_influences or {})
    if with_times and experiment.pool is not None:
        content["pool"] = {"times": _times(to_list(to_python(tree)), experiment.pool, chosen)}
    if title is not None:
        content["title"] = title
    if expected_rank_deficiency is not None:
        content["expected_rank_deficiency"] = expected_rank_deficiency
    if folder.resolve() != source.parent.resolve():
        content = _moved(content, source.parent, folder)
    chunks = _chunks(text, root) if text else {}
    is_same = {
        key: (
            tree.items.get(key) is root.items[key]
            and to_list(to_python(root.items[key])) == content.get(key)
        )
        for key in root.items
    }
    unchanged = {key: chunk for key, chunk in chunks.items() if is_same[key]}
    first = text.partition("\n")[0]
    head = (
        [first]
        if first.startswith(SCHEMA_LINE) and folder.resolve() == source.parent.resolve()
        else []
    )
    head += [f"# {in_one_line(line)}".rstrip() for line in header.splitlines()]
    for parts in (unchanged, {}):
        written = "\n".join(
            [
                "\n".join(head),
                "",
                *(parts[key] if key in parts else _section(key, content[key]) for key in content),
            ]
        )
        try:
            if to_list(to_python(parse_tree(written, "written"))) == content:
                break
        except ExperimentError:
            # A text that is no YAML any more; without the parts kept it is.
            if not parts:
                raise
    return written.rstrip("\n") + "\n"


def _source(experiment: Experiment) -> tuple[str, Node, Node]:
    """Return the text an experiment was loaded from, its tree, and the experiment's tree, which
    shares all nodes that no variant overrides; or the experiment's own text if it differs.

    :raises ExperimentError: the source cannot be read again.
    """
    source = experiment.source
    if not source.is_file():
        return "", experiment.tree, experiment.tree
    # What is written has line feeds, whatever its source has.
    text = read_text(source).replace("\r\n", "\n")
    root = parse_tree(text, str(source))
    assert isinstance(root, MappingNode)
    tree = root if experiment.name is None else variant_trees(root, Problems(root))[experiment.name]
    if to_python(tree) != to_python(experiment.tree):
        return "", experiment.tree, experiment.tree
    return text, root, tree


def _content(
    tree: MappingNode,
    experiment: Experiment,
    chosen: Sequence[Candidate],
    short: Mapping[str, str],
    of_influences: Mapping[int, dict[str, Any]],
) -> dict[str, Any]:
    settings: dict[str, Any] = to_list(to_python(tree))
    positions = [candidate for candidate in chosen if isinstance(candidate.item, Position)]
    placed = {position.item.artefact for position in positions}
    names = {position.name for position in positions}
    unused = (
        {candidate.name for candidate in experiment.pool.candidates} - names - set(short)
        if experiment.pool is not None
        else set()
    )
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
    if "priors" in settings:
        gone = {prior.path for prior in experiment.priors if prior.position in unused}
        paths = [format_path(("priors", i, "parameter")) for i in range(len(settings["priors"]))]
        settings["priors"] = [
            entry for entry, path in zip(settings["priors"], paths, strict=True) if path not in gone
        ]
    if "influences" in settings:
        influences_written = [
            _of_chosen(influence, unused, short) for influence in settings["influences"]
        ]
        settings["influences"] = [
            entry | of_influences.get(k, {}) for k, entry in enumerate(influences_written) if entry
        ]
        if not settings["influences"]:
            del settings["influences"]
    if "readings" in settings:
        settings["readings"] = _with(
            settings["readings"],
            "columns",
            lambda columns: _with(columns, "position", lambda entry: renamed_of_all(entry, short)),
        )
    # What a choice adds goes where it belongs.
    keys = [key for key in ExperimentSettings.model_fields if key in settings]
    order = (
        sorted(settings, key=keys.index)
        if {"positions", "calibration"} - set(tree.items)
        else list(settings)
    )
    return {
        key: settings[key]
        for key in order
        if key not in LEFT_OUT and (settings[key] != [] or key == "positions")
    }


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


def _moved(content: Mapping[str, Any], source: Path, folder: Path) -> dict[str, Any]:
    """Return content with file names and modules relative to another folder."""

    def there(name: Any) -> Any:
        if not isinstance(name, str) or Path(name).is_absolute():
            return name
        target = (source / name).resolve()
        try:
            return Path(os.path.relpath(target, folder.resolve())).as_posix()
        except ValueError:
            # On Windows nothing leads from one drive to another.
            return target.as_posix()

    def all_there(names: Any) -> Any:
        return [there(name) for name in names] if isinstance(names, list) else there(names)

    def model(settings: Any) -> Any:
        settings = _with(settings, "file", there)
        if settings.get("kind") != "python":
            return settings
        beside = source / settings.get("folder", ".")
        if module_file(beside.resolve(), str(settings["object"]).partition(":")[0]) is None:
            return settings
        return {**settings, "folder": there(settings.get("folder", "."))}

    moved = dict(content)
    moved["error_model"] = model(moved["error_model"])
    truth = _with(moved.get("true_machine"), "file", there)
    truth = _with(truth, "files", all_there)
    truth = _with(truth, "error_model", model)
    moved |= {"true_machine": truth} if truth is not None else {}
    moved["artefacts"] = {
        name: _with(item, "file", there) for name, item in moved["artefacts"].items()
    }
    for key in {"calibration", "stars", "influences"} & moved.keys():
        items = [model(_with(item, "values", there)) for item in moved[key]]
        moved[key] = [_with(item, "covariance", there) for item in items]
    if "readings" in moved:
        readings = _with(moved["readings"], "files", all_there)
        moved["readings"] = _with(readings, "compensation", lambda on: _with(on, "file", there))
    if "evaluation" in moved:
        moved["evaluation"] = _with(
            moved["evaluation"], "points", lambda points: _with(points, "file", there)
        )
    return moved


def _with(settings: Any, key: str, change: Callable[[Any], Any]) -> Any:
    if not isinstance(settings, dict) or key not in settings:
        return settings
    return {**settings, key: change(settings[key])}


def _chunks(text: str, root: MappingNode) -> dict[str, str]:
    """Return the text of each section with the comments above it, or an empty result unless the
    file consists of plain blocks.
    """
    lines = text.lstrip("\ufeff").splitlines()
    starts = {mark.line - 1: key for key, mark in root.key_marks.items() if mark.column == 1}
    is_marked = any(line.startswith(("---", "...", "%")) for line in lines)
    has_anchors = any(getattr(event, "anchor", None) for event in yaml.parse(text, Loader=LOADER))
    if len(starts) < len(root.items) or is_marked or has_anchors:
        return {}
    first = min(starts)
    chunks = {}
    key, above = "", list[str]()
    for number, line in enumerate(lines[first:], first):
        if number in starts:
            key = starts[number]
            chunks[key] = [*above, line]
            above = []
        elif not line.strip() or line.startswith("#"):
            above.append(line)
        else:
            chunks[key] += [*above, line]
            above = []
    # Empty lines above a section stay; those of sections left out go with them.
    return {key: "\n".join(chunk) for key, chunk in chunks.items()}


class _Flow(dict[str, Any]):
    """A mapping that is written in one line, or as few as there are."""


class _FlowList(list[Any]):
    """A list that is written in one line, or as few as there are."""


class _Dumper(PlainDumper):
    quote = '"'

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        super().increase_indent(flow, False)


_Dumper.add_representer(
    _Flow,
    lambda dumper, data: dumper.represent_mapping(
        "tag:yaml.org,2002:map", data.items(), flow_style=True
    ),
)
_Dumper.add_representer(
    _FlowList,
    lambda dumper, data: dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=True),
)


def _section(key: str, value: Any) -> str:
    """Return a section written afresh, one line per entry if that fits."""
    if isinstance(value, dict):
        value = {name: _in_line(entry) for name, entry in value.items()}
    elif isinstance(value, list):
        value = [_in_line(entry) for entry in value]
    text = yaml_text({key: value}, width=200, dumper=_Dumper)
    return f"\n{text}".rstrip("\n") if isinstance(value, dict | list) else text.rstrip("\n")


def _in_line(value: Any) -> Any:
    return (
        _Flow(value)
        if isinstance(value, dict)
        else _FlowList(value)
        if isinstance(value, list)
        else value
    )


def _of_chosen(
    influence: dict[str, Any], unused: Collection[str], short: Mapping[str, str]
) -> dict[str, Any]:
    """Return the settings of an influence quantity without positions in `unused`; empty if it
    concerns only these.
    """
    position_settings = influence.get("positions", {})
    settings = {key: setting for key, setting in influence.items() if key != "positions"}
    if isinstance(position_settings, Mapping):
        kept_positions = {
            name: effect for name, effect in position_settings.items() if name not in unused
        }
        return settings | ({"positions": renamed(kept_positions, short)} if kept_positions else {})
    names = renamed([name for name in position_settings if name not in unused], short)
    return settings | {"positions": names} if names else {}
