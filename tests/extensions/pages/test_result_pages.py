"""Pages of fits and designs: every figure is that of the commands' JSON, whatever a person wrote is
escaped, and a page needs nothing else.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.maps.length_map import length_map
from ballplate.extensions.pages.design_contents import page_of_design

from tests.extensions.certificates.campaigns import IN_SPACE
from tests.extensions.pages import wording
from tests.extensions.pages.pages_read import ResultPage, assert_quoted, chart_marks

# Names that mean something in HTML.
NAMES = ("z <low> & \"a\" 'b'", "</script><img src=x>", "--> <svg onload=x>", "right")
FOUR: list[dict[str, Any]] = [
    {"name": "low", "plane": "z", "level": "250 mm", "corner": {"x": "0 mm", "y": "0 mm"}},
    {"name": "front", "plane": "y", "level": "0 mm", "corner": {"z": "0 mm", "x": "0 mm"}},
    {"name": "left", "plane": "x", "level": "0 mm", "corner": {"y": "0 mm", "z": "0 mm"}},
    {
        "name": "right",
        "plane": "x",
        "level": "900 mm",
        "corner": {"y": "300 mm", "z": "300 mm"},
        "quarter_turns": 1,
    },
]
CHANGED: dict[str, dict[str, Any]] = {
    # Nothing tells how long the plate is, since all offsets are the same.
    "deficient": {
        "calibration": None,
        "probes": {"down": ["0 mm", "0 mm", "0 mm"]},
        "positions": FOUR,
    },
    "no target": {"target_uncertainty": None},
    "k = 2": {"target_uncertainty": "1.8 um + L/200000", "coverage_factor": 2},
}


def small(**changes: Any) -> bp.Experiment:
    """The experiment of a small plate in six positions."""
    sections: dict[str, Any] = {
        "artefacts": {"plate": {"kind": "grid", "balls": [3, 3], "size": ["500 mm", "500 mm"]}}
    }
    sections["error_model"] = {
        "kind": "kinematic",
        "arrangement": "MB2",
        "position_coefficients": 3,
        "rotation_coefficients": 2,
    }
    sections["evaluation"] = {"points": {"random": 12, "seed": 1}, "probe": "down"}
    return bp.quickstart().with_(**{**sections, **changes})


@pytest.fixture(scope="module")
def fitted() -> bp.Fit:
    return bp.fit(small(), bp.simulate(small(), seed=5))


@pytest.fixture(scope="module")
def reliability() -> dict[str, Any]:
    return bp.reliability(small()).to_dict()


@pytest.fixture(scope="module")
def page(fitted: bp.Fit) -> str:
    return fitted.page()


def test_every_figure_of_a_fits_page_is_that_of_the_json(
    fitted: bp.Fit, page: str, reliability: dict[str, Any]
) -> None:
    found = {"fit": fitted.to_dict(), "reliability": reliability}
    assert assert_quoted(page, found) > 400
    words = ResultPage(page)
    quoted = {one.attributes["data-path"] for one in words.shown}
    for path in ("sigma", "quantities/U6/within_target"):
        assert f"/fit/{path}" in quoted
    for name in fitted.to_dict()["estimates"]:
        assert f"/fit/estimates/{name}/value" in quoted
    curves = fitted.to_dict()["error_functions"]
    for k, curve in enumerate(curves):
        largest = int(np.abs(np.array(curve["values"], float)).argmax())
        assert f"/fit/error_functions/{k}/values/{largest}" in quoted
    drawn = re.findall(r'<svg class="chart".*?</svg>', page)[: len(curves)]
    for curve, picture in zip(curves, drawn, strict=True):
        values, u = 1e6 * np.array([curve["values"], curve["standard_uncertainties"]])
        x, marks = 1e3 * np.array(curve["positions"]), chart_marks(picture)
        band = np.array([[*x, *x[::-1]], [*values - 2 * u, *(values + 2 * u)[::-1]]]).T
        span = 3e-3 * np.abs(np.diff(marks["frame"], axis=0))
        assert (np.abs(marks["line"] - np.array([x, values]).T) < span).all()
        assert (np.abs(marks["band"] - band) < span).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_pages_have_plates_in_a_plane_and_adjustments_in_space(dimension: int) -> None:
    """In two dimensions without curves; angles in seconds of arc, scales in parts per million."""
    experiment = bp.load("designs/certified/two-dimensions.yaml")
    if dimension == 3:
        experiment = bp.experiment({**IN_SPACE, "error_model": {"kind": "metric"}})
    fit = bp.fit(experiment, bp.simulate(experiment, seed=1))
    data = {"fit": fit.to_dict(), "reliability": bp.reliability(experiment).to_dict()}
    assert_quoted(fit.page(), data)
    assert 'id="plate"' in fit.page() and 'id="curves"' not in fit.page()
    assert fit.page().count(">arcsec<") == (3 if dimension == 3 else 0)


@pytest.mark.parametrize("variant", ["deficient", "no target", "k = 2", "plane"])
def test_every_figure_of_a_designs_page_is_that_of_the_json(variant: str) -> None:
    experiment = small(**CHANGED.get(variant, {}))
    if variant == "plane":
        experiment = bp.load("designs/certified/two-dimensions.yaml")
    prediction = bp.run(experiment)
    is_deficient = variant == "deficient"
    assert bool(prediction.verdict.deficiency) == is_deficient
    page = page_of_design(experiment, prediction)
    data = {"run": prediction.to_dict(), "reliability": bp.reliability(experiment).to_dict()}
    data["check"] = bp.check(experiment, suggest=is_deficient).to_dict()
    grid = (7, 7) if variant == "plane" else (5, 5, 5)
    data["lengths"] = length_map(experiment, grid).to_dict()
    data["sheet"] = bp.sheet(experiment).to_dict()
    assert assert_quoted(page, data) > 100
    assert ('class="verdict bad"' in page) == is_deficient
    shown = {one.text for one in ResultPage(page).shown}
    assert shown.issuperset(data["run"]["undetermined"])


@pytest.mark.parametrize("met", ["some", "all", "none", "no target"])
def test_the_map_has_bands_of_the_share_of_lengths_that_miss_the_target(met: str) -> None:
    """Colours and legend are those of the same bounds, whatever is missed; the first band holds
    the points whose lengths all meet the target. Without a target, bands of equal width have the
    largest uncertainties. Each value stands in its cell, at the co-ordinates of its point.
    """
    experiment = small()
    of_one = experiment.with_(target_uncertainty="1 um", coverage_factor=1)
    largest = length_map(of_one, (5, 5, 5)).maximum_ratio
    limit = {"some": np.quantile(largest, 0.3), "all": 2 * largest.max(), "none": largest.min() / 5}
    changed = experiment.with_(target_uncertainty=None)
    if met != "no target":
        changed = experiment.with_(target_uncertainty=f"{limit[met]:.6g} um", coverage_factor=1)
    page = page_of_design(changed, bp.run(changed))
    number = r'"([-\d.]+)"'
    places = (
        rf'<rect class="band-(\d)" x={number} y={number} width={number} height={number}/><text'
        rf' class="place on-band-\1" x={number} y={number} [^>]*by_point/(\d+)/[^>]*'
        r'data-value="([^"]+)"'
    )
    found, by_point = [], length_map(changed, (5, 5, 5)).to_dict()["by_point"]
    for part in re.findall(r'<svg class="map".*?</svg>', page):
        labels = re.findall(rf'<text x={number} y={number} text-anchor="(\w+)">([^<]*)<', part)
        across = {text: float(x) for x, _, anchor, text in labels if anchor == "middle"}
        up = {text: float(y) for _, y, anchor, text in labels if anchor == "end"}
        for band, *of_cell, k, value in re.findall(places, part):
            left, top, width, height, x, y = map(float, of_cell)
            assert left + width / 2 == x
            x_told, y_told = (f"{1e3 * one:.5g}" for one in by_point[int(k)]["point"][:2])
            assert (x, y) == (across[x_told], up[y_told]) and y == top + height / 2 + 3.5
            found.append((int(band), float(value)))
    bands, values = (np.array(one) for one in zip(*found, strict=True))
    assert len(found) == len(largest)
    limits = np.array([-1.0, 0.0, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0])
    if met == "no target":
        limits = np.linspace(values.min(), values.max(), 8)
        limits[0] = 0.0
    assert (limits[bands] * (1 - 1e-6) < values).all()
    assert (values <= limits[bands + 1] * (1 + 1e-6)).all()
    assert {"all": set(bands) == {0}, "none": set(bands) == {6}}.get(met, len(set(bands)) > 2)
    (legend,) = re.findall(r'<ul class="legend bands">(.*?)</ul>', page)
    entries = re.findall(r'<span class="swatch band-(\d)"[^>]*></span>([^<]*)', legend)
    texts = ["0 %", *(f"up to {k} %" for k in (5, 10, 25, 50, 75)), "more than 75 %"]
    if met == "no target":
        # Twice the standard uncertainties.
        told = [f"{2e6 * limit:.3g} µm" for limit in limits[1:-1]]
        texts = [*(f"up to {one}" for one in told), f"more than {told[-1]}"]
    assert entries == [(str(k), text) for k, text in enumerate(texts)]


def test_what_a_person_wrote_is_escaped(tmp_path: Path) -> None:
    grid = {"kind": "grid", "balls": [3, 3], "size": ["500 mm", "500 mm"]}
    positions = [
        {**one, "name": name, "probes": ["down", "<s>"]}
        for one, name in zip(FOUR, NAMES, strict=True)
    ]
    experiment = small(
        title="a <i>title</i> & \"more\" 'of it'",
        description="<u>one</u>\n& two",
        artefacts={"<b>&amp;": grid},
        positions=positions,
        probes={"down": {"offset": ["0 mm"] * 3}, "<s>": {"offset": ["-50 mm", "0 mm", "0 mm"]}},
    )
    table = tmp_path / "<em>.csv"
    readings = bp.simulate(experiment, seed=1)
    readings.loc[3, "x_mm"] += 0.01
    readings.to_csv(table, index=False)
    pages = bp.fit(experiment, table).page(), page_of_design(experiment, bp.run(experiment))
    for page in pages:
        found = ResultPage(page)
        assert not {tag for tag, _ in found.tags} & {"b", "i", "u", "s", "em", "img", "iframe"}
        assert "script" not in {tag for tag, _ in found.tags}
        assert not any(name.startswith("on") for _, one in found.tags for name in one)
        assert "a &lt;i&gt;title&lt;/i&gt; &amp; &quot;more&quot; &#x27;of it&#x27;" in page
        assert "z &lt;low&gt; &amp;" in page and "&lt;u&gt;one&lt;/u&gt; &amp; two" in page
    assert "&lt;em&gt;.csv" in pages[0]


def test_a_page_runs_no_script_and_asks_for_nothing(page: str) -> None:
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)
    assert policy is not None and policy[1].startswith("default-src 'none'")
    assert "script-src" not in policy[1] and "<script" not in page
    asked = [one.get("src") or one.get("href", "") for _, one in ResultPage(page).tags]
    assert all(one.startswith(("#", "data:,")) for one in asked if one)
    assert "url(" not in page and "@import" not in page


def test_a_fit_that_fails_has_a_page_that_says_so(fitted: bp.Fit) -> None:
    status = replace(fitted.solution, status="diverged")
    failed = replace(fitted, solution=status, quantities={}, estimates=(), largest=(), plates=())
    page = failed.page()
    assert_quoted(page, {"fit": failed.to_dict()})
    assert 'class="verdict bad"' in page and wording.THERE_ARE_NO_RESULTS in page
    with pytest.raises(ValueError, match="fit it again"):
        replace(fitted, experiment=None).page()


def test_a_page_does_not_call_good_what_was_not_tested(fitted: bp.Fit) -> None:
    assert (
        'class="verdict"' in fitted.page()
        and wording.THE_READINGS_CONTRADICT_NOTHING in fitted.page()
    )
    untested = replace(fitted, untested="too many entries").page()
    assert wording.NOT_TESTED_TOO_MANY_ENTRIES in untested
    exact = replace(fitted, degrees_of_freedom=0, sigma_is_estimated=False, sigma=1.0)
    page = exact.page()
    assert (
        wording.THE_READINGS_CONTRADICT_NOTHING not in page
        and wording.NO_LARGER_THAN_STATED not in page
    )
    assert 'class="verdict bad"' in page and wording.THERE_IS_NO_REDUNDANCY in page


def test_commands_write_pages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, readings = "designs/certified/two-dimensions.yaml", tmp_path / "readings.csv"
    bp.simulate(path, seed=1).to_csv(readings, index=False)
    assert main(["fit", path, str(readings), "--report", str(tmp_path / "fit.html")]) == 0
    assert main(["run", path, "--report", str(tmp_path / "design.html")]) == 0
    results = [("fit", bp.fit(path, readings))]
    results += [("design", one) for one in (path, bp.run(path), bp.check(path))]
    moment = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC")
    for name, result in results:
        page = (tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert page.startswith("<!DOCTYPE html>") and "two-dimensions.yaml" in page
        own = bp.page(result, tmp_path / "own.html")
        assert moment.sub("", own) == moment.sub("", page)
        assert (tmp_path / "own.html").read_text(encoding="utf-8") == own
    assert main(["run", path, "--report", str(tmp_path / "design.html")]) == 3
    assert "exists already" in capsys.readouterr().err
    other = ["fit", path, str(readings), "--estimator", "distances", "--report"]
    other += [str(tmp_path / "a.html")]
    assert main(other) == 2
    assert main(["run", "designs/npl/6.1.1.yaml", "--report", str(tmp_path / "a.html")]) == 2
    assert "--variant" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["run", path, "--report", "a.pdf"])


def test_what_has_no_page_is_refused(tmp_path: Path) -> None:
    prediction = bp.run(small())
    with pytest.raises(ValueError, match="predict it again"):
        bp.page(replace(prediction, experiment=None))
    with pytest.raises(TypeError, match=wording.NEITHER_AN_EXPERIMENT_NOR_THE_PATH):
        bp.page(3)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError, match=wording.THERE_IS_NO_FOLDER):
        bp.page(bp.fit(small(), bp.simulate(small())), tmp_path / "none" / "a.html")
