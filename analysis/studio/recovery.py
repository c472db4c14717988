"""What was not saved when a studio ended, kept beside the file until it is saved or given up."""

from __future__ import annotations

import base64
import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ballplate.simulator.experiment.load import trees_of
from ballplate.simulator.experiment.modules import refused_modules
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import Mapping, to_python, walk

from .document import DesignDocument, changed, replace_file


def kept_in(path: Path) -> Path:
    """Where the unsaved text of a file is kept.

    >>> kept_in(Path("designs/plate.yaml")).name
    '.plate.yaml.unsaved'
    """
    return path.with_name(f".{path.name}.unsaved")


def keep(document: DesignDocument) -> None:
    """Keep the text as far as it is not saved, with what the file held when it was read; where the
    folder cannot be written nothing is kept.
    """
    with suppress(OSError):
        if document.is_saved or not document.back:
            kept_in(document.path).unlink(missing_ok=True)
            return
        content = document.content
        said = {
            "content": None if content is None else base64.b64encode(content).decode(),
            "text": document.text,
        }
        # For nobody else, whatever the folder's other files are.
        replace_file(kept_in(document.path), json.dumps(said).encode(), 0o600, is_lasting=False)


def give_up(document: DesignDocument) -> None:
    """Forget what was kept of a document."""
    with suppress(OSError):
        kept_in(document.path).unlink(missing_ok=True)


def recovered(document: DesignDocument) -> tuple[DesignDocument, str]:
    """The document with the text that was not saved, and what is to be said of it; the text of the
    file is a step back.

    Where the file has changed since, saving is refused as if it had changed under the studio. A
    text with other models in Python than the file's is left alone, since nobody has opened it.
    """
    path = kept_in(document.path)
    try:
        said = json.loads(path.read_bytes())
        text, coded = str(said["text"]), said["content"]
        content = None if coded is None else base64.b64decode(coded, validate=True)
    except FileNotFoundError:
        return document, ""
    except (OSError, ValueError, TypeError, KeyError) as error:
        return document, f"{path.name} cannot be read: {error}; delete it"
    if text == document.text:
        return document, ""
    given, code = _code(document.text, document.path) or [], _code(text, document.path)
    if code is None:
        is_known = not given and "python" not in text
    else:
        is_known = all(one in given for one in code)
    if not is_known:
        return document, (
            f"unsaved changes of an earlier session are in {path.name} and were not taken up: they"
            " have an error model in Python that the file has not; look at them, and delete them"
        )
    # What nobody has read must not come to run by a change of something else, either.
    with_modules = document.with_modules and bool(given)
    found = replace(changed(document, text), content=content, with_modules=with_modules)
    since = "" if content == document.content else "; the file has changed since"
    return found, (
        "changes that were not saved in an earlier session are here again; undo leads to the file"
        f" as it is{since}"
    )


def _code(text: str, file: Path) -> list[object] | None:
    """The settings by which a text has models in Python, its own or those of maps, in any of its
    variants; None where it is no YAML.
    """
    try:
        root, variants, _ = trees_of(text, file, [])
    except ExperimentError:
        return None
    found: list[object] = []
    for tree in (root, *variants.values()):
        if refused_modules(tree, file.parent):
            kinds = (to_python(node) for _, node in walk(tree) if isinstance(node, Mapping))
            found += [one for one in kinds if one.get("kind") in ("python", "map")]
    return found
