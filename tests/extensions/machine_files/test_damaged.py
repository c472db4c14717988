"""Map files that are damaged, edited or not maps: told by line, and never used."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.machine_files.fitted_map import FittedMap

from tests.extensions.machine_files import wording
from tests.extensions.machine_files.kinds import experiment_of, fit_of, module_of, write_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("damaged")
    write_files(found)
    for kind, name in (("spatial metric", "map"), ("kinematic", "open")):
        bp.write_map(fit_of(kind, found).to_map("2026-11-22"), found / f"{name}.yaml")
    return found


def line_of(text: str, start: str, number: int = 1) -> int:
    """The number of a line that begins so, or of one below."""
    return (
        next(k for k, one in enumerate(text.split("\n"), 1) if one.startswith(start)) + number - 1
    )


def without_checksum(text: str) -> str:
    return re.sub(r"checksum: .*\n", "", text)


def with_covariance(text: str, change: Callable[[list[list[str]]], None]) -> str:
    head, rows = without_checksum(text).split("covariance:\n")
    cells = [re.findall(r"[^ \"-][^ \"]*|-[^ \"]+", row[2:]) for row in rows.strip().split("\n")]
    change(cells)
    return head + "covariance:\n" + "".join(f'- "{" ".join(row)}"\n' for row in cells)


def _negative(cells: list[list[str]]) -> None:
    cells[3][3] = "-" + cells[3][3]


def _short(cells: list[list[str]]) -> None:
    cells[4].pop()


def _slip(cells: list[list[str]]) -> None:
    cells[2][1] = "4,5e-12"


EDITS: dict[str, tuple[Callable[[str], str], str, int, str]] = {
    "value": (
        lambda text: re.sub(r'("value": -?[0-9])', r"\g<1>7", text, count=1),
        "checksum:",
        1,
        "does not match the content of the file: it was edited or damaged",
    ),
    "variance": (lambda text: with_covariance(text, _negative), "covariance:", 1, "below zero"),
    "short row": (
        lambda text: with_covariance(text, _short),
        "covariance:",
        6,
        "4 numbers instead of 5",
    ),
    "comma": (
        lambda text: with_covariance(text, _slip),
        "covariance:",
        4,
        "has an entry that is no finite number",
    ),
    "row missing": (
        lambda text: with_covariance(text, list.pop),  # type: ignore[arg-type]
        "covariance:",
        1,
        "has 5 rows; 6 parameters and estimated offsets need 6",
    ),
    "parameter missing": (
        lambda text: re.sub(r'- \{"name": "[^"]*".*\n', "", text, count=1),
        "parameters:",
        1,
        "has 5 entries, but the error model 6 parameters",
    ),
    "parameter renamed": (
        lambda text: re.sub(r'- \{"name": "[^"]*"', '- {"name": "EXX"', text, count=1),
        "parameters:",
        2,
        "there: the file was edited; write it again with fit -o",
    ),
    "model": (
        lambda text: text.replace('{"kind": "metric"}', '{"kind": "metrical"}'),
        "error_model:",
        1,
        "metrical",
    ),
    "probe": (
        lambda text: text.replace('probe: "down"', 'probe: "up"'),
        "probe:",
        1,
        "known: down",
    ),
    "date": (lambda text: text.replace('"2026-11-22"', '"2026-02-30"'), "date:", 1, "is no day"),
    "sigma": (
        lambda text: re.sub(r'sigma: \{"value": [^,]*', 'sigma: {"value": -1.0', text),
        "sigma:",
        1,
        "at least 0",
    ),
    "extensions": (
        lambda text: text.replace("error_model:", "extensions: 5\nerror_model:", 1),
        "extensions:",
        1,
        "found the number 5",
    ),
    "version": (lambda text: text.replace("map: 1", "map: 2"), "map:", 1, "found the number 2"),
}


@pytest.mark.parametrize("case", EDITS)
def test_edited_maps_are_refused_by_line(case: str, folder: Path, tmp_path: Path) -> None:
    edit, start, number, told = EDITS[case]
    text = (folder / "map.yaml").read_text()
    changed = edit(text)
    assert changed != text
    path = tmp_path / "edited.yaml"
    path.write_text(changed)
    with pytest.raises(bp.ExperimentError) as refusal:
        bp.load_map(path)
    messages = [str(one) for one in refusal.value.messages]
    assert any(told in one for one in messages), messages
    assert any(one.startswith(f"{path}:{line_of(changed, start, number)}:") for one in messages)


def test_words_may_be_corrected(folder: Path, tmp_path: Path) -> None:
    text = (folder / "map.yaml").read_text()
    changed = text.replace("a plate in space", "my machine").replace("2026-11-22", "2026-11-21")
    (tmp_path / "words.yaml").write_text("# a remark\n" + changed)
    found = bp.load_map(tmp_path / "words.yaml")
    assert (found.title, found.date) == ("my machine", "2026-11-21")


def same(one: FittedMap, other: FittedMap) -> bool:
    return (
        np.array_equal(one.values, other.values)
        and np.array_equal(one.covariance, other.covariance)
        and np.array_equal(one.undetermined, other.undetermined)
        and one.sigma == other.sigma
        and one.volume.corners == other.volume.corners
    )


def test_damage_anywhere_is_found(folder: Path, tmp_path: Path) -> None:
    whole, path = (folder / "open.yaml").read_bytes(), tmp_path / "open.yaml"
    right = bp.load_map(folder / "open.yaml")
    generator = np.random.default_rng(4)
    found = 0
    for k in range(40):
        if k < 20:
            content = whole[: int(generator.integers(0, len(whole)))]
        else:
            place, byte = generator.integers(0, len(whole)), generator.integers(1, 256)
            changed = bytearray(whole)
            changed[place] ^= byte
            content = bytes(changed)
        path.write_bytes(content)
        try:
            again = bp.load_map(path)
        except bp.ExperimentError as error:
            assert all(str(one).startswith(str(path)) for one in error.messages)
            found += 1
        else:
            # Bytes of a title.
            assert same(again, right)
    assert found > 30


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "the file is empty"),
        (b"title: x\n", "is no map file (no key map); write one with: ballplate fit"),
        (b"\xff\xfe", "not UTF-8"),
        (None, "there is no such file"),
    ],
)
def test_what_is_no_map_is_told(
    content: bytes | None, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "map.yaml"
    if content is not None:
        path.write_bytes(content)
    (tmp_path / "points.csv").write_text("x_mm,y_mm,z_mm\n1,2,3\n")
    assert main(["correct", str(path), str(tmp_path / "points.csv")]) == 3
    captured = capsys.readouterr()
    assert told in captured.err and str(path) in captured.err and not captured.out


def test_what_a_model_rests_on_may_not_change(folder: Path, tmp_path: Path) -> None:
    for kind in ("machine file", "python"):
        own = tmp_path / kind
        own.mkdir()
        write_files(own)
        bp.write_map(fit_of(kind, own).to_map(), own / "map.yaml")
        bp.load_map(own / "map.yaml")
        name = "exx.csv" if kind == "machine file" else f"{module_of(own)}.py"
        text = (own / name).read_text()
        (own / name).write_text(text.replace("1.6", "1.7") + "\n# a remark\n")
        with pytest.raises(bp.ExperimentError) as refusal:
            bp.load_map(own / "map.yaml")
        assert f"files[{name}]" in str(refusal.value) or f"files.{name}" in str(refusal.value)
        assert wording.HAS_CHANGED_SINCE_THE_MAP_WAS in str(refusal.value)
        (own / name).unlink()
        with pytest.raises(bp.ExperimentError):
            bp.load_map(own / "map.yaml")


def test_fit_writes_a_map_of_the_full_estimator_only(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    design, readings = "designs/quickstart.yaml", tmp_path / "readings.csv"
    assert main(["simulate", design, "-o", str(readings), "--seed", "1"]) == 0
    out = tmp_path / "map.yaml"
    fit = ["fit", design, str(readings), "-o", str(out)]
    assert main([*fit, "--date", "2026-11-22"]) == 0
    found = bp.load_map(out)
    right = bp.fit(design, readings).to_map()
    assert np.array_equal(found.covariance, right.covariance) and found.date == "2026-11-22"
    assert main(fit) == 3
    assert "exists already" in capsys.readouterr().err
    assert main([*fit, "--force", "--estimator", "distances"]) == 2
    assert wording.MAP_OF_THE_FULL_ESTIMATOR in capsys.readouterr().err
    assert main(["fit", design, str(readings), "--date", "2026-11-22"]) == 2
    for wrong in (["-o", "map.txt"], ["-o", str(out), "--date", "yesterday"]):
        with pytest.raises(SystemExit):
            main(["fit", design, str(readings), *wrong])
    assert experiment_of("metric", folder).title == "a plate in a plane"
