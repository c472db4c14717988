"""No block of output in the pages can go stale: each is made when the pages are built, or compared
here with what the program prints.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from .blocks import (
    INPUT,
    MADE,
    NEAR,
    PAGES,
    TOP,
    Block,
    blocks,
    examples,
    fences,
    is_compared,
    made,
    parts,
)

QUICK = [block for page in PAGES if len(page.parts) == 1 for block in blocks(page)]
# What the build of the pages could make in seconds, it makes; the rest takes minutes.
LENGTHY = [block for page in PAGES if len(page.parts) > 1 for block in blocks(page)]


def title(picture: Path) -> str:
    """What a picture says of itself for those who do not see it."""
    match = re.search(r"<title>(.*?)</title>", picture.read_text(encoding="utf-8"))
    assert match is not None
    return match[1]


def assert_same(lines: list[str], expected: list[str]) -> None:
    assert len(lines) == len(expected), lines
    for line, other in zip(lines, expected, strict=True):
        (words, values), (others, figures) = parts(line), parts(other)
        assert words == others and values == pytest.approx(figures, rel=NEAR)


def assert_is_current(block: Block, folder: Path) -> None:
    assert_same(made(block, folder), list(block.shown))
    for picture in block.pictures:
        assert_same([title(folder / picture.name)], [title(TOP / picture)])


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_every_block_is_made_or_compared_or_typed_by_a_person(page: Path) -> None:
    text = (TOP / page).read_text(encoding="utf-8")
    found = list(fences(page))
    assert 2 * len(found) == len(re.findall(r"^ *(?:`{3,}|~{3,})", text, re.MULTILINE))
    for kind, block in found:
        assert MADE.match(kind) or kind in INPUT or is_compared(kind, block), (kind, block)
        # What a person types is no output, and comes without any.
        assert kind not in INPUT or not re.search(r"^(\$|>>>) ", block, re.MULTILINE), block


@pytest.mark.parametrize("block", QUICK, ids=lambda block: block.command)
def test_blocks_are_what_the_program_prints(block: Block, tmp_path: Path) -> None:
    assert_is_current(block, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("block", LENGTHY, ids=lambda block: block.command)
def test_blocks_that_take_minutes_are_what_the_program_prints(block: Block, tmp_path: Path) -> None:
    assert_is_current(block, tmp_path)


@pytest.mark.parametrize(("old", "new"), [("174", "175"), ("full", "whole"), ("754", "754 new")])
def test_a_stale_block_is_noticed(old: str, new: str, tmp_path: Path) -> None:
    check, _ = QUICK
    stale = tuple(line.replace(old, new) for line in check.shown)
    assert stale != check.shown
    with pytest.raises((AssertionError, ValueError)):
        assert_is_current(replace(check, shown=stale), tmp_path)


def test_no_alarm_is_left_out() -> None:
    """Whatever lines are asked for; and what is left out leaves dots."""
    lines = [
        "converged in 4 iterations",
        "x",
        "  y",
        "contradicted: ball r3c5 read too high",
        "  (statistic 14.8)",
        "    1  2",
        "warning: the scale",
        "plate: rank deficiency 5, expected full rank",
        "U6  distances",
    ]
    for kept in ({0}, {8}, set[int]()):
        shown = examples.with_gaps(lines, kept)
        assert all(line in shown for line in (*lines[3:5], *lines[6:8])) and lines[5] not in shown
    assert examples.with_gaps(lines, {0}) == [lines[0], "…", *lines[3:5], "…", *lines[6:8], "…"]
