"""Sweeps of a design at hand, whose file is written for the time of the computation."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ballplate.simulator.experiment import Experiment, named_in, node_of
from ballplate.simulator.inputs import Mark, Node, refused, to_list, to_python, yaml_text

from .bundle import Bundle, names_of, unpack
from .limits import LIMITS
from .store_columns import is_reserved

# Name of the file.
TEMPORARY = ".ballplate-sweep.yaml"
MARK = Mark("sweep", 0, 0)
# Keys of an axis as a file has it.
OF_FILES = {"path", "paths", "together", "variants"}


def written_sweep(
    design: bytes, experiment: Experiment, source: Path, content: Mapping[str, Any], folder: Path
) -> Path:
    """Write the file of a sweep into a folder, with the content of its `design` and copies of the
    files that it and the axes name relative to `source`; return its path.

    :raises OSError: a file cannot be copied.
    :raises ValueError: files are on several drives, or a value cannot be written.
    """
    source = Path(os.path.abspath(source))
    nodes = [("", experiment.tree), *_values(content["axes"])]
    names = names_of(sorted({source, *named_in(nodes, source.parent)}))
    others = (path for path in names if path != source)
    files = [(names[path], Path(path).read_bytes()) for path in others]
    files.append((names[source], design))
    path = unpack(Bundle(names[source], names[source], tuple(files)), folder)
    file = path.with_name(TEMPORARY)
    text = yaml_text(to_list(to_python(node_of({"base": path.name, **content}, MARK))))
    file.write_text(text, encoding="utf-8")
    return file


def _values(axes: Mapping[str, Any]) -> Iterator[tuple[str, Node]]:
    """Yield the paths of axes with each of their values."""
    for axis in axes.values():
        paths = axis.get("paths") or filter(None, [axis.get("path")])
        columns = axis.get("together") or dict.fromkeys(paths, axis.get("values", ()))
        for path, values in columns.items():
            for value in values.values() if isinstance(values, Mapping) else values:
                yield path, node_of(value, MARK)


def sweep_of(
    experiment: Experiment,
    axes: Mapping[str | tuple[str, ...], Any],
    content: Mapping[str, Any],
    folder: Path,
) -> Path:
    """Write the file of a sweep over `axes`, see `ballplate.sweep`, with further `content`.

    :raises ExperimentError: a value cannot be written, or a file cannot be copied.
    """
    swept: dict[str, Any] = {}
    content = {"title": experiment.title, **content, "axes": swept}
    plan = dict(content.pop("plan", {}))
    for key, stated in axes.items():
        paths = [key] if isinstance(key, str) else list(key)
        values = stated.tolist() if hasattr(stated, "tolist") else stated
        if isinstance(values, Mapping) and not OF_FILES.isdisjoint(values):
            swept[" ".join(paths)] = dict(values)
            continue
        is_limit = key in LIMITS
        if isinstance(values, str) and not is_limit or not isinstance(values, Iterable):
            raise refused(experiment.source, f"{key}: {values!r} is no list of values; give one")
        values = values if isinstance(values, str | Mapping) else list(values)
        rows = list(values.values()) if isinstance(values, Mapping) else values
        is_row = [isinstance(row, list | tuple) for row in rows]
        if key == "hours":
            plan[key] = [hours if isinstance(hours, str) else f"{hours} h" for hours in rows]
        elif key == "estimator":
            content[key] = values
        elif is_limit and not any(is_row):
            plan[key] = values if isinstance(values, str) else rows
        elif len(paths) > 1 and all(is_row):
            if {*map(len, rows)} != {len(paths)}:
                text = f"{key}: not every row has {len(paths)} values, one for each path"
                raise refused(experiment.source, text)
            columns = map(list, zip(*rows, strict=True))
            swept[" ".join(paths)] = {"together": dict(zip(paths, columns, strict=True))}
            if isinstance(values, Mapping):
                swept[" ".join(paths)]["names"] = list(values)
        else:
            name = " ".join(paths)
            name = f"{name} stated" if is_reserved(name) else name
            swept[name] = {"paths": paths, "values": values}
    content |= {"plan": plan} if plan else {}
    design = yaml_text(to_list(to_python(experiment.tree))).encode()
    try:
        return written_sweep(design, experiment, experiment.source, content, folder)
    except (OSError, ValueError) as error:
        raise refused(experiment.source, str(error)) from None
