"""Unsaved changes at the end of a studio, kept in the file's folder until they are saved or
discarded.
"""

from __future__ import annotations

import base64
import json
import secrets
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ballplate.presentation import write_files
from ballplate.simulator.experiment import runs_code, trees_of
from ballplate.simulator.inputs import UNKNOWN, ExperimentError, Mapping, to_python, walk

from .document import DesignDocument, changed


def kept_in(path: Path, owner: str = "") -> Path:
    """Where the unsaved text of a file is kept; of an owner where another has that file already.

    >>> kept_in(Path("designs/plate.yaml")).name
    '.plate.yaml.unsaved'
    """
    return path.with_name(f".{path.name}.unsaved{f'-{owner}' if owner else ''}")


def name_of_kept(path: Path) -> str:
    """Return the name of the file whose unsaved text a path has; empty for another path.

    >>> name_of_kept(Path("designs/.plate.yaml.unsaved"))
    'plate.yaml'
    """
    return path.stem[1:] if path.match(".*.unsaved") else ""


def keep(document: DesignDocument, owner: str) -> Path | None:
    """Keep the text if it is unsaved, with the file's content at its reading; return the path, if
    one was written.

    Text kept by another owner stays.
    """
    if not document.has_changes:
        give_up(document, owner)
        return None
    try:
        own_file = kept_in(document.path, owner)
        is_free = not own_file.exists() and _owner(kept_in(document.path)) in (None, owner)
        path = kept_in(document.path) if is_free else own_file
        _write(path, document, owner)
    except OSError:
        return None
    return path


def give_up(document: DesignDocument, owner: str) -> None:
    """Discard the kept text of an owner."""
    with suppress(OSError):
        kept_in(document.path, owner).unlink(missing_ok=True)
        if _owner(kept_in(document.path)) == owner:
            kept_in(document.path).unlink(missing_ok=True)


def recovered(document: DesignDocument, owner: str) -> tuple[DesignDocument, str]:
    """Return the document with the unsaved text, now the owner's, and a note; the text of the file
    is a step back.

    If the file has changed since, saving is refused as for a change during the session. A text
    with other models in Python than the file's is set aside, since no user has opened it.
    """
    document_found, note = _recovered(document, owner)
    names_set_aside = [file.name for file in _set_aside(document.path) if file.name not in note]
    if names_set_aside:
        listed = ", ".join(names_set_aside)
        more = f"unsaved changes are in {listed}: inspect and delete them"
        note = f"{note}; {more}" if note else more
    return document_found, note


def _recovered(document: DesignDocument, owner: str) -> tuple[DesignDocument, str]:
    path = kept_in(document.path)
    try:
        saved = json.loads(path.read_bytes())
        text, coded = str(saved["text"]), saved["content"]
        content = None if coded is None else base64.b64decode(coded, validate=True)
    except FileNotFoundError:
        return document, ""
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        aside = _put_aside(path)
        return document, f"{path.name} cannot be read: {error}; it is now {aside.name}: delete it"
    if text == document.text:
        with suppress(OSError):
            path.unlink()
        return document, ""
    code_before, code = _code(document.text, document.path) or [], _code(text, document.path)
    if code is None:
        is_known = not code_before and "python" not in text
    else:
        is_known = all(code_object in code_before for code_object in code)
    if not is_known:
        return document, (
            f"unsaved changes are in {_put_aside(path).name} and were not restored: they"
            " have an error model in Python that the file does not have; inspect and delete them"
        )
    # What nobody has read must not come to run by a change of something else, either.
    trust = document.trust if code_before else UNKNOWN
    recovered_document = replace(changed(document, text), content=content, trust=trust)
    with suppress(OSError):
        _write(path, recovered_document, owner)
    since = "" if content == document.content else "; the file has changed since"
    return recovered_document, (
        "changes that were not saved in an earlier session are here again; undo leads to the file"
        f" as it is{since}"
    )


def _write(path: Path, document: DesignDocument, owner: str) -> None:
    """Write the kept text, unless it exists.

    :raises OSError: it cannot be written.
    """
    content = document.content
    saved = {
        "owner": owner,
        "content": None if content is None else base64.b64encode(content).decode(),
        "text": document.text,
    }
    whole = json.dumps(saved).encode()
    if not path.exists() or path.read_bytes() != whole:

        def write(place: Path) -> None:
            # For nobody else, whatever the folder's other files are.
            place.chmod(0o600)
            place.write_bytes(whole)

        write_files({path: write}, force=True)


def _owner(path: Path) -> str | None:
    """Return the owner of a kept text, if there is one; unreadable ones have an unknown owner."""
    try:
        return str(json.loads(path.read_bytes())["owner"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return ""


def _put_aside(path: Path) -> Path:
    """Rename a kept text, so that it is not overwritten; return its name."""
    try:
        return path.rename(f"{path}-{secrets.token_hex(4)}")
    except OSError:
        return path


def _set_aside(path: Path) -> list[Path]:
    """Return texts kept under other names."""
    start = f"{kept_in(path).name}-"
    try:
        return sorted(file for file in path.parent.iterdir() if file.name.startswith(start))
    except OSError:
        return []


def _code(text: str, file: Path) -> list[object] | None:
    """Return the settings by which a text has models in Python, its own or those of maps, in any
    of its variants, if it is YAML.
    """
    try:
        root, variants, _ = trees_of(text, file, [])
    except ExperimentError:
        return None
    objects = []
    for tree in (root, *variants.values()):
        if runs_code(tree, file.parent):
            kinds = (to_python(node) for _, node in walk(tree) if isinstance(node, Mapping))
            objects += [kind for kind in kinds if kind.get("kind") in ("python", "map")]
    return objects
