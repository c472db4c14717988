"""The documentation: it builds without a warning, and what it tells about files outside of it is
so.
"""

from __future__ import annotations

import argparse
import base64
import html
import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
import yaml
from ballplate.cli._parsers import parser
from ballplate.extensions.machine_files.machine_sections import schema as machine_schema
from ballplate.simulator.experiment.json_schema import schema

from tests.reference.schemas import description

DOCS = Path("docs")
GUARD = (DOCS / "how-to/guard-designs.md").read_text(encoding="utf-8")


class Page(HTMLParser):
    """What a page says, where it links to, and what a browser would load for it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text, self.links, self.loaded = "", [], []
        self.names: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_data(self, data: str) -> None:
        self.text += data

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        known = dict(attributes)
        self.names |= {value for key, value in attributes if key == "id" and value}
        address = known.get("src") or known.get("href")
        if address and tag == "a":
            self.links.append(address)
        elif address:
            self.loaded.append(address)


@pytest.mark.long
def test_the_pages_need_nothing_from_elsewhere(built: Path) -> None:
    pages = {path: Page(path) for path in built.rglob("*.html")}
    assert len(pages) >= 15
    for path, page in pages.items():
        for address in (a for a in page.loaded if not a.startswith("data:")):
            assert (
                "//" not in address
                and (path.parent / address.partition("?")[0].partition("#")[0]).exists()
            ), address
        for address in page.links:
            target, _, name = address.partition("#")
            if "//" not in address and name:
                other = (path.parent / target).resolve() if target else path
                assert other in pages and name in pages[other].names, (path.name, address)


@pytest.mark.long
def test_reference_pages_have_everything(built: Path) -> None:
    for page, whole in (("file-format", schema()), ("machine-files", machine_schema())):
        format_page = Page(built / f"reference/{page}.html").text
        for section in (whole, *whole["$defs"].values()):
            for key, value in section["properties"].items():
                assert key in format_page
                # Typography aside.
                described = description(whole, value)
                assert described and re.sub(r"\W+", " ", described) in re.sub(
                    r"\W+", " ", format_page
                ), (key, value)
    command_page = Page(built / "reference/commands.html").text
    (commands,) = (
        action for action in parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    for command in commands.choices.values():
        assert command.prog in command_page
        assert set(command._option_string_actions) - {"--help"} <= set(
            re.findall(r"--?[\w-]+", command_page)
        )


@pytest.mark.long
def test_examples_have_run(built: Path) -> None:
    tutorial = Page(built / "tutorial.html").text
    assert (
        "rank deficiency 5, expected full rank" in tutorial
        and "full rank, as expected; 168" in tutorial
    )
    # The text quotes these from the tables.
    for figure in ("0.2623", "1.525"):
        assert figure in tutorial
    text = Page(built / "tutorial-fit.html").text
    for figure in ("3.13 ± 0.23 µm", "0.9594", "12.238", "0.377"):
        assert figure in text
    assert "<mtable" in (built / "explanation/mathematics.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_outputs_of_the_notebook_are_those_of_its_page(built: Path) -> None:
    """Whose programs the build has run."""
    notebook = json.loads((DOCS / "how-to/from-python.ipynb").read_text(encoding="utf-8"))
    outputs = [one for cell in notebook["cells"] for one in cell.get("outputs", [])]
    stored = "".join(one.get("text", "") for one in outputs)
    text = (built / "how-to/from-python.html").read_text(encoding="utf-8")
    blocks = re.findall(r'class="highlight-text .*?<pre>(.*?)</pre>', text, re.DOTALL)
    of_page = "\n".join(html.unescape(re.sub("<.*?>", "", block)) for block in blocks)
    words = [re.sub(r"\s*\n\s*", "\n", one.strip()) for one in (stored, of_page)]
    number = r"-?\d+(?:\.\d+)?"
    assert words[0]
    assert re.sub(number, "#", words[0]) == re.sub(number, "#", words[1])
    values = [[float(value) for value in re.findall(number, one)] for one in words]
    assert values[0] == pytest.approx(values[1], rel=1e-3, abs=2e-3)


@pytest.mark.long
def test_an_example_that_fails_ends_the_build(tmp_path: Path) -> None:
    example = "```{console}\n:status: 1\n$ ballplate check designs/quickstart.yaml\n```"
    (tmp_path / "index.md").write_text(f"# Wrong\n\n{example}\n", encoding="utf-8")
    command = [sys.executable, "-m", "sphinx", "-q", "-c", DOCS, "-b", "html"]
    found = subprocess.run([*command, tmp_path, tmp_path / "built"], capture_output=True, text=True)
    assert found.returncode != 0 and "exit status 0 instead of 1" in found.stderr


PROGRAMS = (
    ("", "import math\nlost = open('a.txt', 'w')\nx = 6"),
    (":continued:\n\n", "y = int(math.pow(x, 2)) + 1\nprint(f'y is {y}')"),
    (":continued:\n\n", "print(f'x and y are {x + y}', 'lost' in dir())"),
    ("", "print('kept:', [name for name in ('x', 'y', 'math') if name in dir()])"),
)
DRAWING = "<svg xmlns='http://www.w3.org/2000/svg'/>"


@pytest.fixture(scope="module")
def example_pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with pictures and a page with programs."""
    folder = tmp_path_factory.mktemp("examples")
    blocks = "\n\n".join(
        f"```{{python-run}}\n{option}{program}\n```" for option, program in PROGRAMS
    )
    (folder / "programs.md").write_text(f"# Right\n\n{blocks}\n", encoding="utf-8")
    page = (
        "# Right\n\n```{toctree}\nprograms\n```\n\n"
        f"```{{file}} one.svg\n{DRAWING}\n```\n\n```{{picture}} one.svg\n:alt: a < b\nA"
        ' *caption*.\n```\n\n```{file} one.html\n<p title="x">&amp;</p>\n```\n\n'
        "```{picture} one.html\n:alt: a < b\n```\n"
    )
    (folder / "index.md").write_text(page, encoding="utf-8")
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-c", DOCS, "-b", "html"]
    subprocess.run([*command, folder, folder / "built"], check=True, capture_output=True)
    return folder / "built"


@pytest.mark.long
def test_a_picture_that_an_example_has_written_is_in_the_page(example_pages: Path) -> None:
    built = (example_pages / "index.html").read_text(encoding="utf-8")
    data = base64.b64encode(f"{DRAWING}\n".encode()).decode()
    assert (
        f'src="data:image/svg+xml;base64,{data}" alt="a &lt; b"' in built
        and "A <em>caption</em>." in built
    )
    framed = "&lt;p title=&quot;x&quot;&gt;&amp;amp;&lt;/p&gt;\n"
    assert f'srcdoc="{framed}" title="a &lt; b"></iframe>' in built


@pytest.mark.long
def test_a_program_goes_on_with_the_names_of_the_last_one(example_pages: Path) -> None:
    """Values, modules and classes of modules, but nothing of programs before one that does not go
    on.
    """
    text = Page(example_pages / "programs.html").text
    assert "y is 37" in text and "x and y are 43 False" in text and "kept: []" in text


def shown(name: str) -> Any:
    """A YAML file that the page on guarding designs shows."""
    match = re.search(rf"```{{file}} {re.escape(name)}\n(.*?)```", GUARD, re.DOTALL)
    assert match is not None
    return yaml.safe_load(match[1])


def test_the_workflow_uses_inputs_that_there_are() -> None:
    action = yaml.safe_load(Path("action.yml").read_text(encoding="utf-8"))
    _, step = shown("machines/.github/workflows/designs.yml")["jobs"]["check"]["steps"]
    assert step["uses"].endswith("/ballplate@v0.1.0") and set(step["with"]) <= set(action["inputs"])
    rows = dict(re.findall(r"^\| `(.*?)` \|.*\| (.*?) \|$", GUARD, re.MULTILINE))
    assert set(rows) == set(action["inputs"])
    for name in ("files", "python-version"):
        assert rows[name] == f"`{action['inputs'][name]['default']}`"


def test_the_hook_is_one_that_there_is() -> None:
    (repository,) = shown("machines/.pre-commit-config.yaml")["repos"]
    (hook,) = yaml.safe_load(Path(".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    assert [one["id"] for one in repository["hooks"]] == [hook["id"]]
