"""Sweeps of a design at hand, whose file is written for the time of the computation."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ballplate.simulator.experiment import Experiment, named_in, node_of
from ballplate.simulator.inputs import Mark, Node, refused, to_list, to_python, yaml_text

from .bundle import Bundle, names_of, unpack
from .limits import LIMITS

# Name of the file.
TEMPORARY = ".ballplate-sweep.yaml"
MARK = Mark("sweep", 0, 0)


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
        columns = axis.get("together") or dict.fromkeys(axis["paths"], axis["values"])
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
    plan = dict(content.get("plan", {}))
    for key, stated in axes.items():
        values = stated if isinstance(stated, Mapping) else list(stated)
        if key == "hours":
            plan[key] = [
                f"{hours!s} h" if not isinstance(hours, str) else hours for hours in values
            ]
        elif key in LIMITS and not any(
            isinstance(value, list | tuple | Mapping) for value in values
        ):
            plan[key] = values
        elif isinstance(key, tuple) and not isinstance(values, Mapping) and _are_rows(values, key):
            columns = zip(*values, strict=True)
            swept[" ".join(key)] = {"together": dict(zip(key, map(list, columns), strict=True))}
        else:
            paths = [key] if isinstance(key, str) else list(key)
            swept[" ".join(paths)] = {"paths": paths, "values": values}
    content = {"title": experiment.title, **content, "axes": swept}
    content |= {"plan": plan} if plan else {}
    design = yaml_text(to_list(to_python(experiment.tree))).encode()
    try:
        return written_sweep(design, experiment, experiment.source, content, folder)
    except (OSError, ValueError) as error:
        raise refused(experiment.source, str(error)) from None


def _are_rows(values: list[Any], paths: tuple[str, ...]) -> bool:
    """Return whether each value is a row of values, one for each path."""
    return all(isinstance(value, list | tuple) and len(value) == len(paths) for value in values)
