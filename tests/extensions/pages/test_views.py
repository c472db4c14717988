"""Views in notebooks: the pictures of the pages, in a frame of their own, with a still one behind it;
whatever a person wrote is escaped, and nothing is asked for.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import sys
import time
from dataclasses import replace
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.pages import embedded

from tests.extensions.pages import wording
from tests.extensions.pages.browser import Browser, browser, program
from tests.extensions.pages.pages_read import ResultPage
from tests.extensions.pages.test_result_pages import CHANGED, FOUR, NAMES, small

CHROMIUM = program()
PLATE = "</script><b>"


def hostile() -> bp.Experiment:
    """A design that leaves something open, whose names mean something in HTML."""
    grid = {"kind": "grid", "balls": [3, 3], "size": ["500 mm", "500 mm"]}
    names = ("</script><b>", *NAMES[1:])
    positions = [{**one, "name": name} for one, name in zip(FOUR, names, strict=True)]
    changes = CHANGED["deficient"] | {"positions": positions, "artefacts": {PLATE: grid}}
    return small(title="a <i>title</i> & \"more\" 'of it'", **changes)


class Output:
    """The HTML of a view: what stands outside of its frame, the page in it, and the picture behind."""

    def __init__(self, text: str) -> None:
        self.outer = ResultPage(text)
        (frame,) = (one for tag, one in self.outer.tags if tag == "iframe")
        (picture,) = (one for tag, one in self.outer.tags if tag == "img")
        self.page = frame["srcdoc"]
        start, data = picture["src"].split(",")
        assert start == "data:image/svg+xml;base64" and picture["alt"] and frame["title"]
        self.still = base64.b64decode(data).decode()

    @property
    def figures(self) -> list[str]:
        return re.findall(r"<figure.*?</figure>", self.page, re.DOTALL)


@pytest.fixture(scope="module")
def prediction() -> Any:
    return bp.run(hostile())


@pytest.fixture(scope="module")
def shown(prediction: Any) -> Output:
    return Output(bp.view(prediction)._repr_html_())


def test_a_view_is_a_frame_before_a_picture_and_leaves_no_trace_outside(shown: Output) -> None:
    assert [tag for tag, _ in shown.outer.tags] == ["div", "img", "iframe"]
    # Several views on one page share no names, and no style or script of one meets another.
    assert not any(
        name == "id" or name.startswith("on") for _, one in shown.outer.tags for name in one
    )


def test_the_page_in_a_frame_runs_its_own_script_and_asks_for_nothing(shown: Output) -> None:
    (script,) = re.findall(r"<script>(.*?)</script>", shown.page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]+)"', shown.page)
    assert policy.startswith("default-src 'none'") and policy.endswith(
        f"script-src 'sha256-{digest}'"
    )
    tags = ResultPage(shown.page).tags
    asked = [one.get("src") or one.get("href", "") for _, one in tags]
    assert [one for one in asked if one] == ["data:,"]
    for text in (shown.page, shown.still):
        assert "url(" not in text and "@import" not in text


def test_names_that_a_person_wrote_are_escaped_inside_and_outside(shown: Output) -> None:
    page = ResultPage(shown.page)
    assert not {tag for tag, _ in page.tags} & {"b", "i", "img", "iframe"}
    assert not any(name.startswith("on") for _, one in page.tags for name in one)
    assert sum(tag == "script" and "type" not in one for tag, one in page.tags) == 1
    for stored in re.findall(r'<script type="application/json">(.*?)</script>', shown.page):
        assert "<" not in stored and json.loads(stored)["layers"]
    texts = {one.text for one in ElementTree.fromstring(shown.still).iter() if one.text}
    assert not any("{" not in one and "<b>" in one for one in texts)
    words = re.findall(r"<text[^>]*>([^<]*)<", shown.page)
    assert "&lt;/script&gt;&lt;b&gt;" in words
    assert f"balls of {PLATE}".replace("<", "&lt;").replace(">", "&gt;") in shown.page


def test_the_still_picture_is_the_first_one(shown: Output) -> None:
    """It is well-formed, and draws the same paths."""
    space = "{http://www.w3.org/2000/svg}"
    root = ElementTree.fromstring(shown.still)
    assert {one.tag.removeprefix(space) for one in root.iter()} <= {
        "svg",
        "style",
        "rect",
        "path",
        "g",
        "text",
    }
    drawn = [one.get("d") for one in root.iter(f"{space}path")]
    assert drawn == re.findall(r' d="([^"]*)"', shown.figures[0])
    # Colours are in it, since no style of the page reaches it.
    assert "--series-0:" in shown.still and "path.lines" in shown.still


def test_an_undetermined_direction_moves_and_comes_first(prediction: Any, shown: Output) -> None:
    moving = [k for k, one in enumerate(shown.figures) if 'class="view moving"' in one]
    assert moving[0] == 0 and 'id="undetermined-' in shown.figures[0]
    told = {str(one) for one in prediction.verdict.null}
    captions = [
        re.sub("<.*?>", "", one) for one in re.findall("<figcaption>(.*?)</figcaption>", shown.page)
    ]
    assert any(f": {words}. Enlarged" in unescape(captions[0]) for words in told)
    labels = re.findall(r'<button type="button" aria-pressed="false">([^<]*)<', shown.page)
    assert len(labels) >= len(shown.figures) and labels[1] == "positions"
    determined = Output(bp.view(bp.run(small()))._repr_html_())
    assert 'id="volume-view"' in determined.figures[0] and "moving" not in determined.figures[0]


def test_an_experiment_is_shown_as_its_prediction_is() -> None:
    own = Output(bp.view(small())._repr_html_())
    judged = Output(bp.run(small())._repr_html_())
    (picture,) = own.figures
    assert picture == judged.figures[0]
    assert "controls choice" not in own.page and 'class="controls choice" hidden' in judged.page


def test_ellipsoids_of_a_fit_are_its_expanded_uncertainties() -> None:
    experiment = small(**CHANGED["k = 2"])
    fit = bp.fit(experiment, bp.simulate(experiment, seed=5))
    pictures = {one.name: one for one in bp.view(fit).pictures}
    points = pictures["point-view"]
    (layer,) = (one for one in points.layers if one.kind == "ellipsoids")
    (times,) = re.findall(r"enlarged ([\d,]+) times", str(points.caption))
    roots = layer.shapes / float(times.replace(",", ""))
    found = fit.correct(experiment.evaluation.points, "down")
    np.testing.assert_allclose(roots @ roots.transpose(0, 2, 1), 4.0 * found.blocks, rtol=1e-6)
    assert fit.sigma != 1.0 and "k = 2," in str(points.caption)
    assert "residual-vectors" in pictures


def test_a_fit_that_has_failed_shows_its_positions() -> None:
    experiment = small()
    fit = bp.fit(experiment, bp.simulate(experiment, seed=5))
    status = replace(fit.solution, status="diverged")
    failed = replace(fit, solution=status, quantities={}, estimates=(), largest=())
    assert [one.label for one in bp.view(failed).pictures] == ["positions"]


def test_a_view_stays_below_three_hundred_kilobytes(monkeypatch: pytest.MonkeyPatch) -> None:
    positions = [
        {
            "name": f"P{k}",
            "plane": "zxy"[k % 3],
            "level": f"{100 + 37 * k % 800} mm",
            "corner": {axis: f"{53 * k % 250} mm" for axis in ("xy", "yz", "zx")[k % 3]},
            "probes": [("down", "right", "back")[k % 3]],
        }
        for k in range(10)
    ]
    plate = {"plate": {"kind": "grid", "balls": [7, 7], "size": ["600 mm", "600 mm"]}}
    experiment = bp.quickstart().with_(positions=positions, artefacts=plate)
    prediction = bp.run(experiment)
    assert prediction.verdict.deficiency
    whole = prediction._repr_html_()
    assert len(whole.encode()) < 300_000
    every = [one.label for one in bp.view(prediction).pictures]
    sizes = [len(one) for one in Output(whole).figures]
    # Small ones find room where larger ones do not.
    monkeypatch.setattr(embedded, "MOST_BYTES", sizes[0] + sizes[2] + sizes[3])
    less = Output(prediction._repr_html_())
    assert less.figures == [Output(whole).figures[k] for k in (0, 2, 3)]
    assert every[1:4] == ["positions", "points", "balls of plate"]
    (words,) = re.findall(r"since there is too much of it: ([^<]*)\.<", less.page)
    assert words.split(", ") == [every[1], *every[4:]]


def test_views_are_written(tmp_path: Path) -> None:
    view = bp.view("designs/certified/two-dimensions.yaml")
    view.save(tmp_path / "a.svg")
    view.save(tmp_path / "a.html")
    shown = Output(view._repr_html_())
    assert (tmp_path / "a.svg").read_text(encoding="utf-8") == shown.still
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == shown.page
    assert shown.page.startswith("<!DOCTYPE html>") and "data-view" not in shown.page
    with pytest.raises(ValueError, match=r"as \.html or \.svg, unlike .*a\.png"):
        view.save(tmp_path / "a.png")
    with pytest.raises(FileNotFoundError, match=wording.THERE_IS_NO_FOLDER):
        view.save(tmp_path / "none" / "a.svg")
    with pytest.raises(TypeError, match=wording.NEITHER_AN_EXPERIMENT_NOR_THE_PATH):
        bp.view(3)  # type: ignore[arg-type]


def test_a_session_of_ipython_shows_experiments_in_space(monkeypatch: pytest.MonkeyPatch) -> None:
    from ballplate import api

    known: dict[type, Any] = {}
    formatter = SimpleNamespace(for_type=known.__setitem__)
    session = SimpleNamespace(
        display_formatter=SimpleNamespace(formatters={"text/html": formatter})
    )
    for there in (None, session):
        given = SimpleNamespace(get_ipython=lambda there=there: there)
        monkeypatch.setitem(sys.modules, "IPython", given)
        api._teach_notebook()
        assert (bp.Experiment in known) == (there is not None)
    shown = known[bp.Experiment](small())
    assert bp.quickstart().title in shown and Output(shown).figures


def _frames(tab: Browser, expression: str) -> Any:
    """An expression of `page`, the document in each frame."""
    frames = "[...document.querySelectorAll('iframe')].map(one => one.contentDocument)"
    return tab.value(f"{frames}.map(page => {expression})")


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_views_in_one_page_do_not_disturb_each_other(tmp_path: Path, prediction: Any) -> None:
    assert CHROMIUM is not None
    outputs = [prediction._repr_html_(), bp.view(small())._repr_html_(), prediction._repr_html_()]
    notebook = tmp_path / "notebook.html"
    head = "<!DOCTYPE html><meta charset=utf-8><link rel=icon href='data:,'>"
    notebook.write_text(
        f"{head}<body style='background: #111'>{''.join(outputs)}", encoding="utf-8"
    )
    path = "page.querySelector('figure:not([hidden]) [data-layer]').getAttribute('d')"
    with browser(CHROMIUM, tmp_path) as tab:
        features = [{"name": "prefers-reduced-motion", "value": "reduce"}]
        tab.ask("Emulation.setEmulatedMedia", media="", features=features)
        for width in (400, 900, 1400):
            tab.resize(width)
            tab.open(notebook)
            wide = "page.documentElement.scrollWidth <= page.documentElement.clientWidth"
            high = "page.documentElement.scrollHeight <= page.defaultView.innerHeight + 1"
            fits = f"{wide} && {high}"
            # Frames are as high as their pages after these have been laid out.
            for _ in range(200):
                if all(_frames(tab, fits)):
                    break
                time.sleep(0.05)
            assert _frames(tab, fits) == [True] * 3
        before = _frames(tab, path)
        first = "document.querySelector('iframe').contentDocument"
        tab.value(f"{first}.querySelector('.choice').children[1].click()")
        changed = _frames(tab, path)
        assert changed[0] != before[0] and changed[1:] == before[1:]
        tab.value(f"{first}.querySelector('figure:not([hidden]) [data-view=above]').click()")
        turned = _frames(tab, path)
        assert turned[0] != changed[0] and turned[1:] == before[1:]
        # As dark as the page around them, although the browser is not.
        ink = "getComputedStyle(page.body).color"
        assert set(_frames(tab, ink)) == {"rgb(232, 234, 237)"}
        assert (
            tab.value("[...document.querySelectorAll('img')].map(one => one.offsetWidth)")
            == [0] * 3
        )
        asked = [
            one["params"]["request"]["url"]
            for one in tab.events
            if one["method"] == "Network.requestWillBeSent"
        ]
        assert asked and all(url.startswith(("file:", "data:", "about:")) for url in asked)
        wrong = ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")
        assert [one for one in tab.events if one["method"] in wrong] == []
        # Where no script runs, the same picture stands there, and nothing to press.
        tab.ask("Emulation.setScriptExecutionDisabled", value=True)
        tab.open(notebook)
        assert (
            _frames(tab, "page.querySelector('svg').getBoundingClientRect().top < 10") == [True] * 3
        )
        assert _frames(tab, "page.querySelector('.controls').offsetHeight") == [0] * 3
        assert (
            tab.value("[...document.querySelectorAll('img')].map(one => one.naturalWidth)")
            == [480] * 3
        )
