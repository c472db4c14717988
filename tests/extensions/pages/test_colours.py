"""Colours of pages: texts and lines stand out from what they stand on, in light and in dark."""

from __future__ import annotations

import re

import pytest
from ballplate.extensions.pages.document import shipped

STYLE = shipped("marks.css") + shipped("page.css")
SCHEMES = [
    dict(re.findall(r"--([\w-]+): (#\w{6})", block))
    for block in re.findall(r":root \{(.*?)\}", STYLE, re.DOTALL)
]
BANDS = dict(re.findall(r"\.band-(\d) { --band: (#\w{6})", STYLE))


def luminance(colour: str) -> float:
    """Relative luminance as WCAG 2.2 defines it."""
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", SCHEMES, ids=["light", "dark"])
def test_texts_and_lines_stand_out(scheme: dict[str, str]) -> None:
    assert len(scheme) == 13
    for ground in ("paper", "soft"):
        for name in ("ink", "muted", "link", "alert"):
            assert contrast(scheme[name], scheme[ground]) >= 4.5, (name, ground)
        for k in range(6):
            assert contrast(scheme[f"series-{k}"], scheme[ground]) >= 3.0, (k, ground)


def test_figures_can_be_read_on_every_shade() -> None:
    white = set(re.findall(r"on-band-(\d)", STYLE))
    assert len(BANDS) == 7 and 0 < len(white) < 7
    for name, shade in BANDS.items():
        assert contrast("#ffffff" if name in white else "#101010", shade) >= 4.5, shade


def test_steps_become_darker_by_what_can_be_seen() -> None:
    steps = [BANDS[str(k)] for k in range(7)]
    for lighter, darker in zip(steps, steps[1:], strict=False):
        assert luminance(darker) < luminance(lighter) and contrast(lighter, darker) > 1.05
