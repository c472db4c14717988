"""The table of a sweep as text, Markdown and LaTeX, from stores whose figures are made up."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps.cases import MOST_ROWS, columns_of

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import axis, done, failed, made_up, made_up_result

NAN = float("nan")


def figures(size: float, is_open: bool = False) -> dict[str, float]:
    return {
        "rank_deficiency": 2.0 * is_open,
        "observations": 100.0,
        "U2_maximum_m_or_rad": 3e-6 * size,
        "U2_average_m_or_rad": 1.23456e-6 * size,
        "U2_angles_average_rad": 1e-6 * size,
        "U4_maximum_m": NAN if is_open else 4.5e-7 * size,
        "U4_average_m": NAN if is_open else 1.005e-7 * size,
        "U4_undetermined": 600.0 * is_open,
        "U4_within_target": 0.756789,
        "U4_actual_average_m": NAN if is_open else 1.01e-7 * size,
        "U4_spread_ratio": 0.987,
        "U4_spread_ratio_standard_error": 0.012,
        "U4_coverage_sigma_given": 0.951,
    }


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A store with two axes whose names mean something to every format; a case is open, one has
    failed, one is left.
    """
    axes = [
        axis("size", ["450 mm", "550 mm"], [0.45, 0.55], "m"),
        axis("a_b|c & 5 %", ["x*", "y$", "[z]"]),
    ]
    rows = [
        done(k, figures(k + 1.0, is_open=k == 2), given=["rigid plates"] * (k == 3))
        for k in range(4)
    ]
    rows.append(failed(4, "made_up.yaml:1:1: too <large>"))
    path = tmp_path / "small.sqlite"
    made_up(path, "sizes # & <kinds>", axes, rows, trials=100).close()
    return path


def output(store: Path, form: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["sweep", "--report", str(store), "--format", form]) == 0
    return capsys.readouterr().out


def test_a_text_has_answer_averages_and_failures(
    small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = output(small, "text", capsys).splitlines()
    assert lines[:2] == ["small: sizes # & <kinds>", "6 cases, 4 done, 1 failed, 1 left"]
    assert "Given rigid plates: 1 case." in lines
    table = lines[lines.index("") + 1 :]
    assert table[0].split("  ")[0] == "size" and "U2 average, µm or µrad" in table[0]
    assert "maximum" not in table[0] and "angles" not in table[0]
    assert table[1].split() == ["450", "mm", "x*", "done", "100", "0", "1.235", "0.1005", "75.67"]
    assert table[3].split()[3:] == ["done", "100", "2", "3.704", "-", "75.67"]
    assert table[4].split()[-2:] == ["rigid", "plates"]
    assert table[5].split()[3:] == ["failed"]
    assert table[6] == "case 4 failed: made_up.yaml:1:1: too <large>"


@pytest.mark.parametrize(
    ("form", "heads", "row"),
    [
        (
            "markdown",
            r"| size | a\_b\|c & 5 % | status | observations | rank deficiency |",
            r"| 450 mm | y\$ | done | 100 | 0 | 6 | 2.469 | 0.9 | 0.201 | 75.67 | 0.987 | 95.1 |",
        ),
        (
            "latex",
            r"size & a\_b|c \& 5 \% & status & observations & rank deficiency &",
            r"450 mm & y\$ & done & 100 & 0 & 6 & 2.469 & 0.9 & 0.201 & 75.67 & 0.987 & 95.1 &",
        ),
    ],
)
def test_tables_for_papers_have_maxima_and_monte_carlo(
    form: str, heads: str, row: str, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [" ".join(line.split()) for line in output(small, form, capsys).splitlines()]
    (head,) = [line for line in lines if line.startswith(heads)]
    assert "U4 maximum" in head and "U4 spread / U" in head and "U4 covered" in head
    assert any(line.startswith(row) for line in lines), lines


def test_a_file_s_ending_chooses_the_form(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for suffix, form in ((".md", "markdown"), (".tex", "latex"), (".txt", "text")):
        file = tmp_path / f"table{suffix}"
        assert main(["sweep", "--report", str(small), "-o", str(file)]) == 0
        assert file.read_text(encoding="utf-8") == output(small, form, capsys)


def test_shares_are_never_rounded_up(tmp_path: Path) -> None:
    axes = [axis("k", ["1"], [1.0], "1")]
    almost = {"U6_average_m": 1e-6, "U6_within_target": 1.0 - 1e-7}
    result = made_up_result(tmp_path / "s.sqlite", "s", axes, [done(0, almost)])
    assert dict(columns_of(result, [0]))["U6 within target, %"] == [99.99]


def test_a_text_of_many_cases_has_the_best(tmp_path: Path) -> None:
    values = [0.001 * (MOST_ROWS + 50 - k) for k in range(MOST_ROWS + 50)]
    axes = [axis("level", [f"{1000 * value:g} mm" for value in values], values, "m")]
    rows = [done(k, figures(value)) for k, value in enumerate(values)]
    result = made_up_result(tmp_path / "many.sqlite", "levels", axes, rows)
    lines = result.lines()
    assert wording.THE_BEST_CASES in lines
    table = lines[lines.index("") + 2 :]
    assert [line.split()[0] for line in table] == [str(k + 1) for k in range(8)]
    assert len(result.to_frame()) == len(values)


def test_wrong_usage_is_told(
    small: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def told(*options: str) -> tuple[int, str]:
        return main(["sweep", "--report", *options]), capsys.readouterr().err

    status, err = told(str(small), "-o", str(small))
    assert status == 2 and "would overwrite" in err
    status, err = told(str(small), "-o", str(tmp_path / "table.csv"))
    assert status == 2 and "should end in one of .html" in err
    status, err = told(str(small), "--sweep", "7", "--format", "text")
    assert status == 3 and wording.THERE_IS_NO_SUCH_SWEEP in err
    status, err = told(str(tmp_path / "none.sqlite"), "--format", "text")
    assert status == 3 and wording.THERE_IS_NO_SUCH_STORE in err
    status, err = told(str(small), "-o", str(tmp_path / "no folder" / "a.html"))
    assert status == 3 and "cannot be written" in err


def test_notes_state_what_monte_carlo_says(tmp_path: Path) -> None:
    axes = [axis("k", ["1", "2", "3"], [1.0, 2.0, 3.0], "1")]
    rows = [done(k, figures(1.0), flags={"U4": ["spread", "bias"]}) for k in range(2)]
    rows.append(done(2, figures(1.0), monte_carlo="something is undetermined"))
    notes = made_up_result(tmp_path / "m.sqlite", "m", axes, rows, trials=100).notes
    assert notes == (
        "case 0 and 1 more: Monte Carlo differs from linear theory: U4 spread, bias",
        "case 2: no Monte Carlo: something is undetermined",
    )
