"""Options of data sheets: what is refused by name, and questions at a terminal."""

from __future__ import annotations

import os
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.extensions.drafting.sheet_values import expanded, growing_length, plate
from ballplate.simulator.inputs.quantities import LengthFunction

from tests.extensions.drafting import wording
from tests.extensions.drafting.sheets import BRIDGE, FLAT, options

EXAMPLE = Path("designs/quickstart.yaml")


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"machine_type": "bridge"}, wording.UNKNOWN_MACHINE),
        ({"tips": "two"}, wording.UNKNOWN_TIPS),
        ({"volume": "900 1200 700 500 mm"}, wording.FOUR_LENGTHS),
        ({"volume": "900 1200 mm", "tips": "star"}, wording.TIPS_IN_TWO_DIMENSIONS),
        ({"volume": "900 1200 0 mm"}, wording.NOTHING_HIGH),
        ({"mpe": "0.9 + L/400"}, wording.NO_UNIT_OF_MPE),
        ({"mpe": "0 um + L/400"}, wording.NO_CONSTANT_PART),
        ({"volume": "900 1200 1 mm"}, wording.SMALL_EDGE),
        ({"mpe": "0.9 um + L/0"}, wording.DIVIDES_BY_ZERO),
        ({"certificate": "0.4 um + 0.5 um/m"}, wording.NO_COVERAGE_FACTOR),
        ({"plate": "1 x 6, 420 mm"}, wording.SINGLE_LINE),
        ({"plate": "6 x 4, 420 mm"}, wording.ONE_SIZE),
        ({"hours": "0"}, wording.NO_TIME),
        ({"hours": "1"}, wording.TOO_SHORT),
        ({"temperature": "20 degC"}, wording.NO_UNCERTAINTY_OF_TEMPERATURE),
        ({"repeatability": "2 um"}, wording.COARSE_REPEATABILITY),
        ({"tips": "star, 2 um, 3 um"}, wording.TWO_UNCERTAINTIES),
        ({"plate": "6 x 6, 1300 mm"}, wording.LARGER_THAN_THE_VOLUME),
        ({"plate": "6 x 6, 650 mm"}, wording.OUT_OF_REACH),
    ],
)
def test_refusals(
    changed: dict[str, str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command with status 2, and the same by the function."""
    path = tmp_path / "m.yaml"
    command = ["init", str(path), *options(BRIDGE | changed)]
    try:
        status = main(command)
    except SystemExit as ended:
        status = int(str(ended.code))
    assert status == 2 and told in capsys.readouterr().err
    assert not path.exists()
    if "hours" not in changed:
        with pytest.raises(ValueError) as error:
            bp.design(**BRIDGE | changed)
        assert told in str(error.value)


def test_without_the_extension_the_example_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ballplate.cli.init.optional_service", lambda name: None)
    assert main(["init", str(tmp_path / "m.yaml")]) == 0
    assert (tmp_path / "m.yaml").read_bytes() == EXAMPLE.read_bytes()
    with pytest.raises(SystemExit):
        main(["init", str(tmp_path / "n.yaml"), *options(BRIDGE)])


def test_arguments_of_another_type() -> None:
    with pytest.raises(TypeError, match="volume=700"):
        bp.design(**BRIDGE | {"volume": 700})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "constant", "slope"),
    [
        ("0.9 um + L/400", 0.9e-6, 2.5e-6),
        ("(0.9 + L/400) um", 0.9e-6, 2.5e-6),
        ("E0,MPE = ±(1.7 + 3 L/1000) um", 1.7e-6, 3e-6),
        ("1.7 + 3L/1000 µm", 1.7e-6, 3e-6),
        ("0.5 um + L/1000000", 0.5e-6, 1e-6),
        ("0.4 um + 0.5 ppm", 0.4e-6, 0.5e-6),
        ("3 um", 3e-6, 0.0),
    ],
)
def test_forms_of_data_sheets(text: str, constant: float, slope: float) -> None:
    found = growing_length(text)
    assert found.constant == pytest.approx(constant, rel=1e-12)
    assert found.slope == pytest.approx(slope, rel=1e-9)


def test_forms_of_certificates_and_plates() -> None:
    for text in ("U = 0.4 um + 0.5 L, k = 2", "0.4 um + 0.5 um/m (k=2)", "0.4 um + L/2000; k=2.0"):
        assert expanded(text).standard == LengthFunction(0.2e-6, 0.25e-6), text
    for text in ("6x4 420 x 252 mm", "6 x 4 balls, pitch 84 mm", "6 × 4, pitch 8.4 cm"):
        assert plate(text).size == (0.42, 0.252), text


pty = pytest.importorskip("pty", reason="there is no pseudo-terminal")


def at_terminal(monkeypatch: pytest.MonkeyPatch, *words: str, typed: str) -> int:
    """The status of `init` at a pseudo-terminal where all this is typed."""
    ours, theirs = pty.openpty()
    os.write(ours, typed.encode())
    with os.fdopen(theirs) as read, os.fdopen(os.dup(theirs), "w") as write:
        monkeypatch.setattr("sys.stdin", read)
        monkeypatch.setattr("sys.stdout", write)
        status = main(["init", *words])
    os.close(ours)
    return status


def test_questions_at_a_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nonsense is answered at once and asked again; nothing typed is the default."""
    monkeypatch.chdir(tmp_path)
    answers = ["bridge", "gantry", "", "", "6 x 6, 1300 mm", "5 x 5, 400 mm", "0.4 um", ""]
    typed = "\n".join([*answers, "star", "", "", "", "1", "4", ""])
    status = at_terminal(monkeypatch, "m.yaml", typed=typed)
    told = capsys.readouterr().err
    assert status == 0, told
    assert wording.TOO_SHORT.replace("2 h", "1.9 h") in told
    assert wording.UNKNOWN_MACHINE in told and wording.LARGER_THAN_THE_VOLUME in told
    assert "measuring volume, x y z [900 1200 700 mm]: " in told
    assert (
        told.count("columns x rows of balls") == 2
        and wording.NO_COVERAGE_FACTOR_OF_AN_ANSWER in told
    )
    assert "next: ballplate plan m.yaml --hours 4 -o m-chosen.yaml" in told
    assert bp.load("m.yaml").layouts["plate"].names[-1] == "r5c5"


def test_in_two_dimensions_tips_are_no_question(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    typed = "\n".join(["", FLAT["volume"], "", FLAT["plate"], *[""] * 6, "\x04"])
    assert at_terminal(monkeypatch, "m.yaml", typed=typed) == 0
    assert "tips" not in capsys.readouterr().err
    assert bp.load("m.yaml").dimension == 2


def test_the_end_of_the_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert at_terminal(monkeypatch, str(tmp_path / "m.yaml"), typed="\x04") == 2
    assert wording.NO_ANSWER in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
