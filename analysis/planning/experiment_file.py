"""The chosen design as an experiment file of its own, without a pool.

Sections that stay as they are keep their text and comments. What is composed is read again and
compared with what it should say, so that a file of unusual form is written anew as a whole, rather
than wrongly.
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
from ballplate.simulator.inputs.yamltree import (
    LOADER,
    Node,
    parse_tree,
    read_text,
    resolve_scalar,
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
    """The text of an experiment file, to stand in a folder, with the chosen candidates, positions
    in their order.

    `experiment` is the source, loaded for planning; of one with variants the overrides are applied.
    `header` becomes comments at the top. Names of files lead from `folder` to the same files. A
    stated rank deficiency is left out unless one is given, and so are artefacts that no chosen
    position places, what is known of them, and priors about other positions. `names` are the short
    names of chosen positions by those in the pool. `of_influences` are keys of influence quantities
    that are others, by the places of these in their list. `with_times` a pool says how long the
    positions take.

    Of an experiment that was made or changed in Python nothing of a file is kept.

    :raises ExperimentError: the source cannot be read any more.
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
    kept = {key: chunk for key, chunk in chunks.items() if is_same[key]}
    first = text.partition("\n")[0]
    head = (
        [first]
        if first.startswith(SCHEMA_LINE) and folder.resolve() == source.parent.resolve()
        else []
    )
    head += [f"# {in_one_line(line)}".rstrip() for line in header.splitlines()]
    for parts in (kept, {}):
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
    """The text that an experiment was loaded from, its tree, and that of the experiment, which
    shares with it the nodes that no variant overrides; without a text the experiment's own, where
    it is not what the text says.

    :raises ExperimentError: the source cannot be read any more.
    """
    source = experiment.source
    if source.name == "experiment" and not source.is_file():
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
    said: dict[str, Any] = to_list(to_python(tree))
    positions = [one for one in chosen if isinstance(one.item, Position)]
    placed = {one.item.artefact for one in positions}
    names = {one.name for one in positions}
    others = (
        {one.name for one in experiment.pool.candidates} - names - set(short)
        if experiment.pool is not None
        else set()
    )
    # Where there is one artefact, nothing says which.
    only = next(iter(said["artefacts"]))
    items = [
        one
        for one in said.get("calibration", [])
        if str(one.get("artefact", only)) in placed or is_of_machine(str(one.get("kind")))
    ]
    items += [
        to_list(one.settings)
        for one in chosen
        if not isinstance(one.item, Position) and one.item.artefact in {*placed, ""}
    ]
    said["artefacts"] = {name: one for name, one in said["artefacts"].items() if name in placed}
    said["positions"] = [to_list(one.settings) for one in positions]
    said["calibration"] = items
    if "priors" in said:
        gone = {one.path for one in experiment.priors if one.position in others}
        paths = [format_path(("priors", i, "parameter")) for i in range(len(said["priors"]))]
        said["priors"] = [
            one for one, path in zip(said["priors"], paths, strict=True) if path not in gone
        ]
    if "influences" in said:
        told = [_of_chosen(one, others, short) for one in said["influences"]]
        said["influences"] = [one | of_influences.get(k, {}) for k, one in enumerate(told) if one]
        if not said["influences"]:
            del said["influences"]
    if "readings" in said:
        said["readings"] = _with(
            said["readings"],
            "columns",
            lambda columns: _with(columns, "position", lambda one: renamed_of_all(one, short)),
        )
    # What a choice adds goes where it belongs.
    known = [key for key in ExperimentSettings.model_fields if key in said]
    order = (
        sorted(said, key=known.index)
        if {"positions", "calibration"} - set(tree.items)
        else list(said)
    )
    return {
        key: said[key]
        for key in order
        if key not in LEFT_OUT and (said[key] != [] or key == "positions")
    }


def _times(said: Mapping[str, Any], pool: Pool, chosen: Sequence[Candidate]) -> dict[str, Any]:
    """How long things take, and chosen positions where that is other for them, as a pool has it."""
    times = {
        key: one for key, one in said.get("pool", {}).get("times", {}).items() if key != "positions"
    }
    common = TimesSettings.model_validate(times)
    own: dict[str, dict[str, str]] = {}
    for one in chosen:
        if isinstance(one.item, Position):
            changes = (len(one.item.probes) - 1) * pool.changes.probe
            set_up = one.seconds - one.readings * one.reading_seconds - changes
            stated = {"set_up": (set_up, common.set_up, SET_UP)}
            stated["reading"] = (one.reading_seconds, common.reading, READING)
            differ = {
                key: format_duration(value)
                for key, (value, given, default) in stated.items()
                if abs(value - (default if given is None else given)) > 1e-6
            }
            own |= {one.name: differ} if differ else {}
    return {**times, **({"positions": own} if own else {})}


def _moved(content: Mapping[str, Any], source: Path, folder: Path) -> dict[str, Any]:
    """The same with names of files, and places of modules, that lead there from another folder."""

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

    found = dict(content)
    found["error_model"] = model(found["error_model"])
    truth = _with(found.get("true_machine"), "file", there)
    truth = _with(truth, "files", all_there)
    truth = _with(truth, "error_model", model)
    found |= {"true_machine": truth} if truth is not None else {}
    found["artefacts"] = {
        name: _with(one, "file", there) for name, one in found["artefacts"].items()
    }
    for key in {"calibration", "stars", "influences"} & found.keys():
        items = [model(_with(one, "values", there)) for one in found[key]]
        found[key] = [_with(one, "covariance", there) for one in items]
    if "readings" in found:
        readings = _with(found["readings"], "files", all_there)
        found["readings"] = _with(readings, "compensation", lambda on: _with(on, "file", there))
    if "evaluation" in found:
        found["evaluation"] = _with(
            found["evaluation"], "points", lambda points: _with(points, "file", there)
        )
    return found


def _with(settings: Any, key: str, change: Callable[[Any], Any]) -> Any:
    if not isinstance(settings, dict) or key not in settings:
        return settings
    return {**settings, key: change(settings[key])}


def _chunks(text: str, root: MappingNode) -> dict[str, str]:
    """The text of each section with the comments above it, none where the file is not one of plain
    blocks.
    """
    lines = text.lstrip("\ufeff").splitlines()
    starts = {mark.line - 1: key for key, mark in root.key_marks.items() if mark.column == 1}
    is_marked = any(line.startswith(("---", "...", "%")) for line in lines)
    has_anchors = any(getattr(event, "anchor", None) for event in yaml.parse(text, Loader=LOADER))
    if len(starts) < len(root.items) or is_marked or has_anchors:
        return {}
    first = min(starts)
    chunks: dict[str, list[str]] = {}
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


class _Dumper(yaml.SafeDumper):
    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        super().increase_indent(flow, False)

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _represent_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    try:
        is_text = resolve_scalar(text) is text
    except ValueError:
        is_text = False
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if is_text else '"')


_Dumper.add_representer(str, _represent_text)
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
    """A section written anew, each of its entries in one line where it fits."""
    if isinstance(value, dict):
        value = {name: _in_line(one) for name, one in value.items()}
    elif isinstance(value, list):
        value = [_in_line(one) for one in value]
    text = yaml.dump(
        {key: value},
        Dumper=_Dumper,
        default_flow_style=False,
        sort_keys=False,
        allow_unicode=True,
        width=200,
    )
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
    influence: dict[str, Any], others: Collection[str], short: Mapping[str, str]
) -> dict[str, Any]:
    """What is said of an influence quantity, less `others` among its positions; nothing where it is
    of these alone.
    """
    said = influence.get("positions", {})
    rest = {key: one for key, one in influence.items() if key != "positions"}
    if isinstance(said, Mapping):
        left = {name: at for name, at in said.items() if name not in others}
        return rest | ({"positions": renamed(left, short)} if left else {})
    names = renamed([name for name in said if name not in others], short)
    return rest | {"positions": names} if names else {}
