"""Figures and pictures on the page about campaigns that take too long for every build of the
pages.
"""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest
from ballplate.cli import main

PAGE = Path("docs/how-to/plan-a-campaign.md")

# The last digit of figures may differ between processors.
NEAR = 2e-3


def examples() -> dict[str, list[str]]:
    """Commands on the page that its build does not run, with the lines of their output that it
    shows.
    """
    page = PAGE.read_text(encoding="utf-8")
    blocks = re.findall(
        r"^```console\n\$ ballplate ([^\n]*)\n(.*?)^```$", page, re.MULTILINE | re.DOTALL
    )
    return {command: shown.splitlines() for command, shown in blocks}


def parts(line: str) -> tuple[list[str], list[float]]:
    """What a line says besides its numbers, and these."""
    number = r"\d+(?:\.\d+)?"
    return re.sub(number, "#", line).split(), [float(value) for value in re.findall(number, line)]


def assert_same(one: str, other: str) -> None:
    (words, values), (others, expected) = parts(one), parts(other)
    assert words == others and values == pytest.approx(expected, rel=NEAR)


def title(picture: Path) -> str:
    """What a picture says of itself for those who do not see it."""
    match = re.search(r"<title>(.*?)</title>", picture.read_text(encoding="utf-8"))
    assert match is not None
    return match[1]


def picture_of(command: str) -> str:
    words = shlex.split(command)
    return words[words.index("--plot") + 1]


def test_there_are_two_of_them() -> None:
    assert len(examples()) == 2


@pytest.mark.parametrize("command", examples())
def test_the_picture_is_of_the_figures_beside_it(command: str) -> None:
    rows = {line.split("  ")[0]: line for line in examples()[command]}
    told = title(PAGE.with_name(picture_of(command)))
    for name in ("chosen", "bound of any choice", "as drawn"):
        if name in rows:
            match = re.search(rf"{name} ([\d.]+) µm", told)
            assert match is not None
            assert float(match[1]) == float(f"{parts(rows[name])[1][0]:.3g}")


def test_the_text_quotes_what_the_command_says() -> None:
    page = PAGE.read_text(encoding="utf-8")
    (lines,) = (shown for command, shown in examples().items() if "plate-pool" in command)
    chosen, bound, drawn = (parts(line)[1][0] for line in lines[1:4])
    text = " ".join(page[page.index("## Six positions") :].split())
    for figure in (chosen, bound, drawn):
        assert f"{figure:.4f} µm" in text.partition("```console")[0] + text.rpartition("```")[2]
    for share in (1 - chosen / drawn, 1 - bound / chosen, 1 - bound / drawn):
        assert f"{100 * share:.0f} %" in text


@pytest.mark.long
@pytest.mark.parametrize("command", examples())
def test_what_is_shown_comes_out_again(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copytree("designs", tmp_path / "designs")
    picture = PAGE.with_name(picture_of(command)).resolve()
    shown = examples()[command]
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)) == 0
    lines = iter(capsys.readouterr().out.splitlines())
    for line in shown:
        found = next(
            (other for other in lines if parts(other)[0] == parts(line)[0]), "nothing of that kind"
        )
        assert_same(found, line)
    assert_same(title(tmp_path / picture_of(command)), title(picture))
