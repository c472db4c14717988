"""Error models that are stated apart from an experiment: in a few words, or by a file's section."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.simulator.design import Volume
from ballplate.simulator.experiment import absolute, load_machine, node_of
from ballplate.simulator.inputs import (
    OPENED,
    ExperimentError,
    Mark,
    Node,
    Problems,
    parse_tree,
    read_tree,
    refused,
    to_python,
    validated,
)
from ballplate.simulator.inputs import Mapping as MappingNode
from ballplate.simulator.machines import (
    CustomModelError,
    ErrorModel,
    ErrorModelSettings,
    MachineFileSettings,
    PythonSettings,
    build_error_model,
    kind_of,
    with_defaults,
)


@dataclass(frozen=True, eq=False)
class StatedModel:
    """An error model with its `settings` as in a file, paths absolute."""

    settings: dict[str, Any]
    model: ErrorModel

    @property
    def kind(self) -> str:
        return str(self.settings["kind"])


def stated_model(text: str, volume: Volume, source: str) -> StatedModel:
    """Return the error model of a text for a volume: a kind such as "kinematic", settings such as
    "{kind: kinematic, position_coefficients: 3}", or the path of a file with a section
    `error_model`.

    :raises ExperimentError: it is none, named by its file or as the `source`.

    >>> import numpy as np
    >>> volume = Volume(np.zeros(3), np.ones(3))
    >>> len(stated_model("kinematic", volume, "--to").model.parameters)
    69
    """
    is_file = Path(text).suffix.lower() in (".yaml", ".yml")
    name, folder = (text, Path(text).parent) if is_file else (source, Path())
    root = _section(read_tree(Path(text)), text) if is_file else parse_tree(text, source)
    if not isinstance(root, MappingNode):
        root = node_of({"kind": to_python(root)}, Mark(name, 0, 0))
    problems = Problems(root)
    kinds: Any = ErrorModelSettings
    settings = validated(kinds, root, problems)
    model = None if settings is None else _built(settings, volume, folder, problems)
    if model is None:
        raise ExperimentError(problems.messages)
    return StatedModel(absolute(to_python(root), folder), model)


def _section(root: Node, source: str) -> Node:
    section = root.items.get("error_model") if isinstance(root, MappingNode) else None
    if section is None:
        raise refused(source, "has no error_model; name a file that has, or state a kind")
    return section


def _built(settings: Any, volume: Volume, folder: Path, problems: Problems) -> ErrorModel | None:
    """Return the model, or None after a message."""
    kind, d = kind_of(settings), len(volume.lower)
    if d not in kind.dimensions:
        problems.add(("kind",), f"{settings.kind} models have {kind.dimensions[0]} axes, not {d}")
        return None
    try:
        if isinstance(settings, MachineFileSettings):
            settings.set_machine(load_machine(folder / settings.file))
        elif isinstance(settings, PythonSettings):
            settings.beside(folder, OPENED)
        for steps, text in kind.wrong(settings, d):
            problems.add(steps, text)
        if not problems.messages:
            return build_error_model(with_defaults(settings, d), *volume.corners)
    except CustomModelError as error:
        problems.add((error.key,), str(error))
    except ExperimentError as error:
        problems.take(error, ("file",))
    return None
