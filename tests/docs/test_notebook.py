"""The notebook of the page on Python: its cells are those of the page."""

from __future__ import annotations

import importlib
import json
import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path("docs/_extensions").resolve()))
notebook = importlib.import_module("notebook")


def page() -> str:
    return str(notebook.PAGE.read_text(encoding="utf-8"))


def stored() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(notebook.NOTEBOOK.read_text(encoding="utf-8"))
    return content


def printed(content: dict[str, Any]) -> str:
    """What all programs of a notebook have printed."""
    outputs = [one for cell in content["cells"] for one in cell.get("outputs", [])]
    return "".join(one.get("text", "") for one in outputs)


def test_cells_are_those_of_the_page() -> None:
    cells = notebook.cells(page())
    assert [cell["source"] for cell in stored()["cells"]] == [cell["source"] for cell in cells]
    programs = re.findall(r"^import|^campaign = bp.plan|^readings = bp.simulate", page(), re.M)
    sources = "\n".join(cell["source"] for cell in cells if cell["cell_type"] == "code")
    assert len(programs) == 4 and "```" not in sources and ":continued:" not in sources
    pictures = sum(len(cell.get("pictures", ())) for cell in cells)
    data = [o["data"] for c in stored()["cells"] for o in c.get("outputs", []) if "data" in o]
    assert pictures == len(data) == 2 and sum(len(one["image/png"]) for one in data) < 150e3


def test_a_notebook_has_what_its_programs_print_and_draw() -> None:
    first = (
        "```{python-run}\nfrom pathlib import Path\nx = Path('x.png').write_bytes(b'drawn')\n```\n"
    )
    picture = "```{picture} x.png\n:alt: x\nA letter.\n```\n"
    second = "```{python-run}\n:continued:\n\nprint(7 * x)\n```\n"
    content = notebook.executed(f"# Small\n\n{first}\n{picture}\n{second}")
    drawn, counted = [cell for cell in content["cells"] if cell["cell_type"] == "code"]
    assert [one["data"]["image/png"] for one in drawn["outputs"]] == ["ZHJhd24="]
    assert printed(content) == "35\n" and counted["execution_count"] == 2
