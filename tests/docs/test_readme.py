"""The README: its commands print the figures that it shows, its example runs, and its links lead
somewhere.
"""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from pathlib import Path

import pytest
from ballplate.cli import main

PAGES = ("README.md", "CONTRIBUTING.md")
README = Path("README.md").read_text(encoding="utf-8")
COMMANDS = re.findall(
    r"^```console\n\$ \S*ballplate ([^\n]*)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL
)


EXTRAS = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]


def test_one_page_lists_all_extras_and_their_packages() -> None:
    text = Path("docs/reference/platforms.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| .* \| (.*) \|$", text, re.MULTILINE))
    assert rows.keys() == EXTRAS.keys() and "platforms.md#extras" in README
    for name, packages in rows.items():
        own = {re.split("[>[]", one)[0] for one in EXTRAS[name]} - {"ballplate"}
        named = set(packages.removesuffix(" and others").split(", "))
        assert named <= own if " and others" in packages or name == "benchmark" else named == own


@pytest.mark.parametrize(
    ("page", "command"),
    [
        *((Path("README.md"), command) for command, _ in COMMANDS),
        (Path("README.md"), "studio designs/quickstart.yaml --no-browser"),
        (Path("README.md"), "run designs/quickstart.yaml --report {folder}/design.html"),
        (
            Path("docs/how-to/use-the-map.md"),
            "map designs/park/machines/gec-like.yaml --grid 2,2,2 --plot {folder}/map.svg",
        ),
    ],
    ids=str,
)
def test_without_extras_a_command_works_or_its_page_names_the_extra(
    page: Path,
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for package in ("distributed", "matplotlib", "pyarrow", "shtab", "starlette", "uvicorn"):
        monkeypatch.setitem(sys.modules, package, None)
    status = main(shlex.split(command.format(folder=tmp_path)))
    if status:
        extras = re.findall(r"'ballplate\[(\w+)\]'", capsys.readouterr().err)
        assert len(extras) == 1 and EXTRAS[extras[0]]
        assert f"`{extras[0]}`" in page.read_text(encoding="utf-8")


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = re.findall(r"^```python\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    exec(example, {"__name__": "__main__"})
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows] == ["0.1", "0.2", "0.4"]
    # Uncertainty grows with the repeatability, and less than in proportion where a certificate
    # takes part.
    values = [float(row[2]) for row in rows]
    assert values[0] < values[1] < 2 * values[0] and values[1] < values[2] < 2 * values[1]


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    text = Path(page).read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(\s*([^)\s]+)\)", text) if "://" not in link]
    assert links
    for link in links:
        name, _, heading = link.partition("#")
        assert Path(name).is_file(), link
        if heading:
            titles = re.findall(r"^#+ (.*)$", Path(name).read_text(encoding="utf-8"), re.MULTILINE)
            assert heading in {
                re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles
            }, link
