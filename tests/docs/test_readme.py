"""The README: its commands print the figures that it shows, its example runs, and its links lead
somewhere.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from ballplate.cli import main

PAGES = ("README.md", "CONTRIBUTING.md")
README = Path("README.md").read_text(encoding="utf-8")
COMMANDS = re.findall(
    r"^```console\n\$ \S*ballplate ([^\n]*)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL
)


def figures(text: str) -> list[float]:
    return [float(value) for value in re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])", text)]


def test_there_are_two_commands_one_picture_and_one_example() -> None:
    assert len(COMMANDS) == 2
    assert len(re.findall(r"^!\[.+\]\(.+\)$", README, re.MULTILINE)) == 1
    assert README.count("```python\n") == 1
    assert len(README.splitlines()) <= 130


@pytest.mark.parametrize(("command", "shown"), COMMANDS)
def test_commands_print_the_figures_shown(
    command: str, shown: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(shlex.split(command)) == 0
    lines = [figures(line) for line in capsys.readouterr().out.splitlines()]
    expected = [figures(line) for line in shown.splitlines() if figures(line)]
    assert expected
    for row in expected:
        assert any(
            row == pytest.approx(line, rel=2e-3) for line in lines if len(line) == len(row)
        ), row


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
