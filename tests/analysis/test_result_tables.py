"""The main table of a result in every form, read back and compared with its rows."""

from __future__ import annotations

import io
import re
from html.parser import HTMLParser
from typing import Any

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
from ballplate.presentation.result import Result
from ballplate.results.fits import Fit
from ballplate.results.prediction import Prediction

from tests.reference.small_quickstart import small_quickstart
from tests.reference.tables import read_table

PLACES = {
    "planes": ["z"],
    "levels": ["100 mm"],
    "corners": {"x": ["50 mm"], "y": ["50 mm"]},
    "probes": ["down"],
}


class Cells(HTMLParser):
    """Rows of cells of a table, and the tags that are open."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        if tag != "img":
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def from_markdown(text: str) -> list[list[str]]:
    rows = [line for line in text.splitlines() if line.startswith("|")]
    cells = [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        for line in rows
        if "---" not in line
    ]
    return [[re.sub(r"\\(.)", r"\1", cell) for cell in row] for row in cells]


@pytest.fixture(scope="module")
def results() -> list[Result]:
    experiment = small_quickstart()
    deficient = experiment.with_(
        {f"positions[{name}]": None for name in ("x low", "x high", "y low")}
    )
    return [
        bp.run(experiment),
        bp.run(deficient),
        bp.fit(experiment, bp.simulate(experiment)),
        bp.reliability(experiment),
        bp.reach(experiment, "U6 average 0.2 um", ["repeatability"]),
        bp.plan(experiment.with_(pool={"candidates": [PLACES]}), positions=7),
    ]


def assert_shows(cells: list[list[str]], rows: list[dict[str, Any]]) -> None:
    """Headings, every text as it is, and every number to four digits."""
    assert cells[0] == list(rows[0]) and len(cells) == len(rows) + 1
    for shown, row in zip(cells[1:], rows, strict=True):
        for text, value in zip(shown, row.values(), strict=True):
            if isinstance(value, float) and np.isnan(value):
                assert text == "undetermined"
            elif isinstance(value, float) and np.isfinite(value):
                assert float(text) == pytest.approx(value, rel=5.1e-4)
            elif isinstance(value, str):
                assert text == value


def test_every_form_has_every_row(results: list[Result]) -> None:
    for result in results:
        rows = result._shown_rows()
        page = Cells(result.to_html())
        shown = Cells(result._repr_html_())
        assert not page.open and not shown.open and shown.rows == page.rows[:61]
        assert_shows(page.rows, rows)
        assert_shows(from_markdown(result.to_markdown()), rows)
        latex = result.to_latex()
        assert latex.count(r"\begin{tabular}") == latex.count(r"\end{tabular}") == 1
        assert len(re.findall(r"\\\\$", latex, re.MULTILINE)) == len(rows) + 1


def test_csv_has_all_digits(results: list[Result]) -> None:
    for result in results:
        frame, found = pd.DataFrame(result.rows()), read_table(io.StringIO(result.to_csv()))
        for name in frame.select_dtypes("number"):
            np.testing.assert_array_equal(found[name].to_numpy(float), frame[name].to_numpy(float))


def test_frames_are_in_the_units_that_people_read(results: list[Result]) -> None:
    """In that of a column, or in that of the column "unit"; those of CSV in metres and radians."""
    prediction, fit = results[0], results[2]
    for result, name in ((prediction, "average"), (fit, "standard uncertainty")):
        frame, rows = result.to_frame(), pd.DataFrame(result.rows())
        np.testing.assert_allclose(frame[name], 1e6 * rows[name], rtol=1e-12)
        assert set(frame["unit"]) <= {"µm", "µrad", "µm, µrad"} and set(rows["unit"]) & {"m", "rad"}
    (row,) = bp.check(bp.quickstart()).to_frame().to_dict("records")
    assert row["U6 average, µm"] == 1e6 * bp.run(bp.quickstart())["U6"].average


def test_what_is_undetermined_says_so(results: list[Result]) -> None:
    deficient = results[1]
    shown = from_markdown(deficient.to_markdown())
    assert isinstance(deficient, Prediction) and deficient.verdict.deficiency > 0
    unknown = [symbol for symbol, one in deficient.quantities.items() if np.isnan(one.average)]
    assert unknown and unknown == [row[0] for row in shown[1:] if "undetermined" in row]
    assert "rank deficiency" in deficient.to_latex()


def test_without_rows_the_result_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    found = bp.check(bp.quickstart())
    monkeypatch.setattr(type(found), "columns", lambda _: ({}, ()))
    for text in (found.to_markdown(), found.to_latex(), found.to_html()):
        assert (
            "full rank" in text
            and "|" not in text
            and "tabular" not in text
            and "<table" not in text
        )


def test_names_mean_nothing_but_themselves() -> None:
    named = bp.quickstart().with_(title="a < b & c | d")
    assert (
        "a &lt; b &amp; c" in bp.run(named).to_html()
        and r"a \< b & c \| d" in bp.run(named).to_markdown()
    )


def test_quantities_and_parameters_are_found_by_their_names(results: list[Result]) -> None:
    prediction, fit = results[0], results[2]
    assert isinstance(prediction, Prediction) and isinstance(fit, Fit)
    assert prediction["U6"] is prediction.quantities["U6"]
    data = fit.to_dict()["estimates"]
    for name in ("EXX[1]", "x low: origin x", "r1c2: x"):
        found = fit[name]
        assert data[name] == {
            "value": found.value,
            "standard_uncertainty": found.standard_uncertainty,
            "unit": found.unit,
        }
    for result, name, hint in ((prediction, "U7", "U1"), (fit, "EXX[11]", "EXX[1]")):
        with pytest.raises(KeyError, match=re.escape(hint)):
            result[name]
