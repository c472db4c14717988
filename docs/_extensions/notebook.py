"""The page on Python as an executed notebook: `python docs/_extensions/notebook.py` writes it anew.

Text and programs are those of the page; pictures that a program writes are outputs of its cell.
"""

from __future__ import annotations

import base64
import contextlib
import io
import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "how-to/from-python.md"
NOTEBOOK = PAGE.with_suffix(".ipynb")
BLOCK = re.compile(r"^```\{(.+?)\} ?(.*)\n((?::.*\n)*)\n*((?:.*\n)*?)```\n", re.MULTILINE)
# What only the pages have: links to them, and to the notebook.
LINK = re.compile(r"\{download\}`(.+?) <.+?>`|\[([^\]]+)\]\([^)]+\)")


def cells(page: str) -> list[dict[str, Any]]:
    """The cells of a notebook without outputs; those of code have the PNG files that follow them
    under `pictures`.
    """
    found: list[dict[str, Any]] = []
    end = 0
    for match in BLOCK.finditer(page):
        found += _words(page[end : match.start()])
        end = match.end()
        kind, name, _, content = match.groups()
        if kind == "python-run":
            found.append({"cell_type": "code", "source": content.rstrip(), "pictures": []})
        elif name.endswith(".png"):
            code = next(cell for cell in reversed(found) if cell["cell_type"] == "code")
            code["pictures"].append(name)
            found += _words(content)
    return found + _words(page[end:])


def _words(text: str) -> list[dict[str, Any]]:
    text = LINK.sub(lambda match: match[1] or match[2], text).strip()
    return [{"cell_type": "markdown", "source": text}] if text else []


def executed(page: str) -> dict[str, Any]:
    """A notebook (nbformat 4) with what its programs print, and their pictures."""
    names: dict[str, Any] = {"__name__": "__main__"}
    content, before = [], Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for number, cell in enumerate(cells(page)):
                content.append({"id": f"cell-{number}", "metadata": {}, **cell})
                if cell["cell_type"] == "code":
                    content[-1] |= _run(cell["source"], content[-1].pop("pictures"), names)
                    content[-1]["execution_count"] = sum("outputs" in one for one in content)
        finally:
            os.chdir(before)
    metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    return {"cells": content, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def _run(source: str, pictures: list[str], names: dict[str, Any]) -> dict[str, Any]:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(source, names)
    outputs: list[dict[str, Any]] = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue()})
    for name in pictures:
        data = {"image/png": base64.b64encode(Path(name).read_bytes()).decode("ascii")}
        outputs.append({"output_type": "display_data", "metadata": {}, "data": data})
    return {"outputs": outputs}


def main() -> None:
    notebook = executed(PAGE.read_text(encoding="utf-8"))
    text = json.dumps(notebook, ensure_ascii=False, indent=1)
    NOTEBOOK.write_text(f"{text}\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
