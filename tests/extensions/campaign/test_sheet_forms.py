"""Run sheets as text and as a page."""

from __future__ import annotations

from html.parser import HTMLParser
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from ballplate.extensions.campaign.drawings import MARGIN, SIZE, place_drawing
from ballplate.extensions.campaign.sheet_page import sheet_page
from ballplate.planning.run_sheet_tables import sheet_data, sheet_lines, summary
from ballplate.planning.schedule import RunSheet, run_sheet
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.positions import ball_coordinates

from tests.extensions.campaign import wording


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return load("designs/planning/campaign.yaml", planning=True)[0]


@pytest.fixture(scope="module")
def sheet(experiment: Experiment) -> RunSheet:
    assert experiment.pool is not None
    wanted = (
        "upright",
        "flat low",
        "bar along y",
        "flat z 300 mm at 300, 400 mm turn 1",
        "better sides",
    )
    by_name = {one.name: one for one in experiment.pool.candidates}
    return run_sheet(
        [by_name[name] for name in wanted],
        experiment.pool.changes,
        done=[by_name["flat low"]],
    )


def test_lines(sheet: RunSheet) -> None:
    lines = sheet_lines(sheet)
    assert lines[0].split() == ["start", "min", "position", "probes", "balls", "readings"]
    assert lines[1].split() == ["1", "done", "flat", "low", "down", "all", "25", "25"]
    assert wording.TURNED_DEG_COUNTER_CLOCKWISE_SEEN in "\n".join(lines)
    assert "3 times each" in "\n".join(lines)
    assert lines[-2] == wording.CALIBRATION_BETTER_SIDES
    assert lines[-1] == summary(sheet)
    assert wording.POSITION_DONE_BEFORE in lines[-1]


def test_data(sheet: RunSheet) -> None:
    data = sheet_data(sheet)
    assert data["seconds"] == sheet.seconds
    assert data["calibration"] == [{"name": "better sides", "seconds": 3600.0}]
    assert [step["done"] for step in data["steps"]] == [True, False, False, False]


class Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.seen: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))


def test_page_stands_alone_and_has_a_box_for_each_position(
    sheet: RunSheet, experiment: Experiment
) -> None:
    page = sheet_page(sheet, experiment, "<b>day</b>")
    assert "<b>day" not in page and "&lt;b&gt;day" in page
    tags = Tags()
    tags.feed(page)
    names = [tag for tag, _ in tags.seen]
    assert names.count("section") == 4
    # Of each position still to be read, of each artefact and of the volume.
    assert names.count("svg") == 3 + 2 + 1
    assert "script" not in names and "link" not in names and "img" not in names
    boxes = [found for tag, found in tags.seen if tag == "input"]
    # One for each position, and one for each probe of those that are still to be read.
    assert len(boxes) == 4 + sum(len(step.probes) for step in sheet.steps if not step.done)
    assert "@media print" in page


@pytest.mark.parametrize(
    "name", ["flat low", "upright", "standing x 500 mm at 50, 100 mm turn 2", "bar along x"]
)
def test_drawing_is_to_scale_and_right_handed(name: str, experiment: Experiment) -> None:
    assert experiment.pool is not None
    candidate = next(one for one in experiment.pool.candidates if one.name == name)
    root = ElementTree.fromstring(place_drawing(candidate, experiment))
    circles = np.array(
        [[float(one.attrib[key]) for key in ("cx", "cy")] for one in root.iter("circle")]
    )
    balls = ball_coordinates(candidate.item.pose, experiment.layouts[candidate.item.artefact])
    across, up = {"flat low": (0, 1), "upright": (0, 2), "bar along x": (0, 2)}.get(name, (1, 2))
    # Seen from +y with z upwards, x runs to the left.
    sign = -1 if across == 0 and up == 2 else 1
    scale = (SIZE - 2 * MARGIN) / np.ptp(
        [
            experiment.machine.volume.lower[[across, up]],
            experiment.machine.volume.upper[[across, up]],
        ],
        axis=0,
    ).max()
    moved = (circles - circles[0]) / scale
    assert moved[:, 0] == pytest.approx(sign * (balls[:, across] - balls[0, across]), abs=1e-3)
    assert moved[:, 1] == pytest.approx(-(balls[:, up] - balls[0, up]), abs=1e-3)


# A plate in every corner of its plane, turned so that each of its own corners is the first ball's.
CORNERS = """
title: corners
machine: {volume: [600 mm, 500 mm, 450 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {p: [0 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 2], size: [200 mm, 150 mm]}}
evaluation: {points: {random: 4, seed: 1}}
positions: []
pool:
  candidates:
    - {name: z, planes: [z], levels: [0 mm], corners: {x: [2 mm, 398 mm], y: [2 mm, 348 mm]}, quarter_turns: [0, 2], probes: [p]}
    - {name: zt, planes: [z], levels: [0 mm], corners: {x: [2 mm, 448 mm], y: [2 mm, 298 mm]}, quarter_turns: [1, 3], probes: [p]}
    - {name: x, planes: [x], levels: [0 mm], corners: {y: [2 mm, 298 mm], z: [2 mm, 298 mm]}, quarter_turns: [0, 2], probes: [p]}
    - {name: y, planes: [y], levels: [0 mm], corners: {z: [2 mm, 248 mm], x: [2 mm, 448 mm]}, quarter_turns: [0, 2], probes: [p]}
"""


def test_words_across_a_drawing_keep_clear_of_each_other(tmp_path: Path) -> None:
    """By the room that letters of ten points take: six across, eight above their line, two below."""
    (tmp_path / "e.yaml").write_text(CORNERS, "utf-8")
    (found,) = load(tmp_path / "e.yaml", planning=True)
    assert found.pool is not None
    outside = 0
    for candidate in found.pool.candidates:
        root = ElementTree.fromstring(place_drawing(candidate, found))
        left, top, width, height = map(float, root.attrib["viewBox"].split())
        (volume,) = root.iter("rect")
        above = float(volume.attrib["y"])
        below = above + float(volume.attrib["height"])
        boxes = {}
        for one in root.iter("text"):
            x, y = float(one.attrib["x"]), float(one.attrib["y"])
            half = 3.0 * len(one.text or "")
            box = np.array([x - half, y - 8.0, x + half, y + 2.0])
            if "transform" not in one.attrib:
                boxes[one.text] = box
            else:
                box = np.array([x - 8.0, y - half, x + 2.0, y + half])
            assert left <= box[0] and top <= box[1]
            assert box[2] <= left + width and box[3] <= top + height
        (seen,) = (box for text, box in boxes.items() if text and text.startswith("seen from"))
        assert seen[3] < above
        outside += not above < boxes["r1c1"][1] < boxes["r1c1"][3] < below
        for one, other in combinations(boxes.values(), 2):
            assert (one[2:] <= other[:2]).any() or (other[2:] <= one[:2]).any()
    assert outside > 4


def test_names_cannot_break_out_of_the_page(tmp_path: Path) -> None:
    text = (
        Path("designs/planning/campaign.yaml")
        .read_text("utf-8")
        .replace("flat low", "'<script>alert(1)</script>'")
    )
    (tmp_path / "e.yaml").write_text(text, "utf-8")
    (found,) = load(tmp_path / "e.yaml", planning=True)
    assert found.pool is not None
    page = sheet_page(run_sheet(found.pool.candidates[:1], found.pool.changes), found, found.title)
    assert "<script" not in page and "&lt;script&gt;" in page
