"""Tables of a sweep as text, Markdown, CSV and LaTeX."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps.report.answer import LISTED
from ballplate.extensions.sweeps.report.heatmaps import DEFICIENT, SHADES, heat_maps
from ballplate.extensions.sweeps.report.results import best_and_worst, read_results
from ballplate.extensions.sweeps.report.series import plots
from ballplate.extensions.sweeps.report.tables import MOST_ROWS, report_tables, text_tables
from ballplate.extensions.sweeps.store import Store
from ballplate.presentation.formats import FORMATS

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import axis, done, failed, made_up

GOLDEN = Path(__file__).parent / "golden"
NAN = float("nan")


def figures(size: float, is_open: bool = False) -> dict[str, float]:
    return {
        "rank_deficiency": 2.0 * is_open,
        "as_expected": 1.0,
        "U2_maximum_m_or_rad": 3e-6 * size,
        "U2_average_m_or_rad": 1.23456e-6 * size,
        "U2_undetermined": 0.0,
        "U2_angles_maximum_rad": 3e-6 * size,
        "U2_angles_average_rad": 1e-6 * size,
        "U2_angles_undetermined": 0.0,
        "U4_maximum_m": NAN if is_open else 4.5e-7 * size,
        "U4_average_m": NAN if is_open else 1.005e-7 * size,
        "U4_undetermined": 600.0 * is_open,
        "U4_within_target": 0.756,
        "U4_actual_average_m": NAN if is_open else 1.01e-7 * size,
        "U4_spread_ratio": 0.987,
        "U4_spread_ratio_standard_error": 0.012,
        "U4_actual_ratio": 0.99,
        "U4_actual_ratio_standard_error": 0.012,
        "U4_bias_ratio": 0.0,
        "U4_bias_ratio_standard_error": 0.04,
        "U4_coverage_sigma_given": 0.951,
        "U4_coverage_sigma_given_standard_error": 0.004,
    }


@pytest.fixture
def small(tmp_path: Path) -> Store:
    """Two axes with names that mean something to every format; a cell is open, one has failed, one
    is left.
    """
    axes = [
        axis("size", ["450 mm", "550 mm"], [0.45, 0.55], "m"),
        axis("a_b|c & 5 %", ["x*", "y$", "[z]"]),
    ]
    rows = [done(k, figures(k + 1.0, is_open=k == 2)) for k in range(4)] + [
        failed(4, "made_up.yaml:1:1: too <large>")
    ]
    return made_up(tmp_path / "small.sqlite", "sizes # & <kinds>", axes, rows, trials=100)


@pytest.mark.parametrize("form", FORMATS)
def test_tables_are_the_golden_ones(small: Store, form: str) -> None:
    results = read_results(small, 1)
    text = FORMATS[form](results.title, report_tables(results))
    assert text == (GOLDEN / f"{form}.txt").read_text(encoding="utf-8")


def test_csv_is_read_back(small: Store) -> None:
    results = read_results(small, 1)
    first, second = as_rows(FORMATS["csv"]("", report_tables(results)))
    assert first[0] == [
        "size",
        "figure",
        "unit",
        "a_b|c & 5 % x*",
        "a_b|c & 5 % y$",
        "a_b|c & 5 % [z]",
    ]
    assert {len(row) for row in first + second} == {6}
    assert ["550 mm", "U4 average", "um", "0.402", "failed", "left"] in first


def as_rows(text: str) -> list[list[list[str]]]:
    return [list(csv.reader(io.StringIO(part))) for part in text.split("\n\n")]


def test_the_best_cell_leaves_nothing_open(small: Store) -> None:
    assert best_and_worst(read_results(small, 1)) == (0, 2)


def test_many_cells_are_rows_and_end_with_a_sentence(tmp_path: Path) -> None:
    values = [0.001 * (k + 1) for k in range(MOST_ROWS + 50)]
    axes = [axis("level", [f"{1000 * value:g} mm" for value in values], values, "m")]
    store = made_up(
        tmp_path / "many.sqlite",
        "levels",
        axes,
        (done(k, figures(1.0 + k)) for k in range(len(values))),
    )
    best, table, *_ = text_tables(read_results(store, 1))
    assert (best.name, best.size) == ("answer", LISTED)
    labels = [f"{1000 * value:g} mm" for value in values[:LISTED]]
    assert [row.headings[0] for row in best.blocks[0].rows] == labels
    assert table.size == MOST_ROWS and table.headings == ("cell", "level")
    assert table.notes[0] == wording.CELLS_MORE_ARE_NOT_SHOWN_HERE_BALLPLATE


def test_what_one_distance_stands_for_is_no_ordinary_value(tmp_path: Path) -> None:
    """Of the cell in the middle 600 values are but one undetermined: its average is none, and
    neither shown, shaded nor drawn.
    """
    axes = [
        axis("size", ["1 mm", "2 mm", "3 mm"], [1e-3, 2e-3, 3e-3], "m"),
        axis("way", ["a", "b"]),
    ]
    rows = []
    for cell in range(6):
        is_partial = cell == 2
        some = figures(1.0 + cell, is_partial)
        some |= {"rank_deficiency": 3.0, "U4_undetermined": 599.0} if is_partial else {}
        rows.append(done(cell, some))
    results = read_results(made_up(tmp_path / "partial.sqlite", "partial", axes, rows), 1)
    unknown = {
        (entry.cell, entry.figure)
        for table in report_tables(results)
        for block in table.blocks
        for row in block.rows
        for entry in row.entries
        if entry.text == "-"
    }
    assert unknown == {
        (2, name) for name in ("U4_maximum_m", "U4_average_m", "U4_actual_average_m")
    }
    (heat,) = heat_maps(results)
    assert [[entry.text.endswith("*") for entry in row] for row in heat.entries] == [
        [False, False], [True, False], [False, False]
    ]  # fmt: skip
    assert (
        heat.shades[1][0] == DEFICIENT
        and heat.shades[0][0] == 0
        and heat.shades[2][1] == SHADES - 1
    )
    assert "*" in heat.note
    lines = [line for plot in plots(results) if plot.measure.symbol == "U4" for line in plot.lines]
    assert [np.isnan(line.y).tolist() for line in lines] == [
        [False, True, False],
        [False, False, False],
    ]


def test_the_command_writes_tables(
    small: Store, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["sweep", "--report", str(small.path), "--format", "text"]) == 0
    assert capsys.readouterr().out == (GOLDEN / "text.txt").read_text(encoding="utf-8")
    for suffix, form in ((".md", "markdown"), (".tex", "latex"), (".csv", "csv"), (".txt", "text")):
        file = tmp_path / f"tables{suffix}"
        assert main(["sweep", "--report", str(small.path), "-o", str(file)]) == 0
        assert file.read_text(encoding="utf-8") == (GOLDEN / f"{form}.txt").read_text(
            encoding="utf-8"
        )


def test_wrong_usage_is_told(
    small: Store, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["sweep", "--report", str(small.path), "-o", str(small.path)]) == 2
    assert "would overwrite" in capsys.readouterr().err
    assert main(["sweep", "--report", str(small.path), "--sweep", "7", "--format", "text"]) == 3
    assert wording.THERE_IS_NO_SUCH_SWEEP in capsys.readouterr().err
    assert main(["sweep", "--report", str(tmp_path / "none.sqlite"), "--format", "text"]) == 3
    assert wording.THERE_IS_NO_SUCH_STORE in capsys.readouterr().err
    assert (
        main(
            [
                "sweep",
                "--report",
                str(small.path),
                "-o",
                str(tmp_path / "no folder" / "a.html"),
                "--format",
                "csv",
            ]
        )
        == 3
    )
    assert "cannot be written" in capsys.readouterr().err
