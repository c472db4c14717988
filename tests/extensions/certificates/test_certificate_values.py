"""Certificate values beside simulated readings: sigma is 1 then, and a file of them is read as
strictly as others.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.certificates.certificate_files import certified_values, read_certificate
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.reading_files import read_readings

from tests.extensions.certificates import wording

QUICKSTART = "designs/quickstart.yaml"

EVERYTHING = """
title: all kinds of certificate
machine: {volume: [1 m, 1 m, 1 m], repeatability: 1 um}
error_model: {kind: kinematic, position_coefficients: 3, rotation_coefficients: 2}
true_machine: {kind: random, position: 2 um, rotation: 2 urad, seed: 3}
probes:
  down: [0 mm, 0 mm, -100 mm]
  right: {offset: [100 mm, 0 mm, 0 mm], standard_uncertainty: 1 um}
  back: [0 mm, 100 mm, 0 mm]
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}
  bar: {kind: two_spheres, length: 600 mm, role: length_standard}
  gauge: {kind: bryan_gauge, radius: 300 mm, directions: {azimuths: 6, elevations: [10 deg, 40 deg]}}
positions:
  - {name: a, artefact: plate, plane: z, level: 300 mm, corner: {x: 200 mm, y: 200 mm}, probes: [down, right, back]}
  - {name: b, artefact: plate, plane: z, level: 0.7 m, corner: {x: 200 mm, y: 200 mm}, quarter_turns: 1, probes: [down]}
  - {name: c, artefact: plate, plane: x, level: 500 mm, corner: {y: 200 mm, z: 300 mm}, probes: [down]}
  - {name: d, artefact: plate, plane: y, level: 500 mm, corner: {x: 200 mm, z: 300 mm}, probes: [down, back]}
  - {name: bar x, artefact: bar, pose: {origin: [200 mm, 300 mm, 400 mm]}, probes: [down]}
  - {name: pivot, artefact: gauge, pose: {origin: [500 mm, 500 mm, 500 mm]}, probes: [down]}
calibration:
  - {kind: distances, artefact: plate, pairs: all, standard_uncertainty: 0.3 um}
  - {kind: coordinates, artefact: plate, balls: all, standard_uncertainty: {x: 0.2 um, y: 0.4 um, z: 0.3 um}}
  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.5 um}
  - {kind: radius, artefact: gauge, standard_uncertainty: 0.5 um}
priors:
  - {parameter: EXX, standard_uncertainty: 1 um}
  - {parameter: "b: origin z", standard_uncertainty: 0.5 um}
  - {parameter: "c: rotation x", standard_uncertainty: 2 urad}
evaluation: {points: {random: 5, seed: 1}}
"""


def write(folder: Path, text: str) -> str:
    path = folder / "experiment.yaml"
    path.write_text(text)
    return str(path)


def sum_of_squares(design: Design, readings: Path) -> float:
    observed = read_readings(readings, design)
    solution = estimate(observed.design, observed.x)
    assert solution.status == "converged"
    return solution.factor.sum_of_squares


def test_sigma_is_one_with_the_certificate_that_belongs_to_the_readings(tmp_path: Path) -> None:
    """S^2 is chi-squared then. With the file's own values, from which a real plate cannot differ
    freely, it is less.
    """
    file, readings, certificate = (
        write(tmp_path, EVERYTHING),
        tmp_path / "r.csv",
        tmp_path / "c.csv",
    )
    experiment = load(Path(file))[0]
    design = lay_out(experiment)
    freedom, count = design.observation_count - design.parameter_count, 14
    with_its_own, with_the_files = [], []
    for seed in range(count):
        arguments = [
            "simulate",
            file,
            "-o",
            str(readings),
            "--certificate",
            str(certificate),
            "--force",
        ]
        assert main([*arguments, "--seed", str(seed)]) == 0
        with_its_own.append(
            sum_of_squares(lay_out(read_certificate(certificate, experiment)), readings)
        )
        with_the_files.append(sum_of_squares(design, readings))
    error = np.sqrt(2 * freedom / count)
    assert abs(np.mean(with_its_own) - freedom) < 4 * error
    assert np.mean(with_the_files) < freedom - 4 * error


@pytest.mark.parametrize("place", ["stated", "unknown"])
def test_exact_values_of_a_star_in_a_table_are_read_again(tmp_path: Path, place: str) -> None:
    """Turned into the axes of its table, a tip on an axis is off it by rounding, below 1e-18 m."""
    tree = yaml.safe_load(Path("designs/quickstart.yaml").read_text(encoding="utf-8"))
    star = {"standard_uncertainty": "0.5 um", "place": place, "values": "star.csv"}
    tree["stars"] = [star | {"probes": ["down", "right", "left", "back", "front"]}]
    rows = ["down,0,0,-50", "right,30,40,0", "left,-30,-40,0", "back,-40,30,0", "front,40,-30,0"]
    (tmp_path / "star.csv").write_text("\n".join(["probe,x_mm,y_mm,z_mm", *rows]) + "\n", "utf-8")
    file, readings, certificate = (tmp_path / name for name in ("f.yaml", "r.csv", "c.csv"))
    file.write_text(yaml.safe_dump(tree), encoding="utf-8")
    written = ["-o", str(readings), "--certificate", str(certificate), "--exact"]
    assert main(["simulate", str(file), *written]) == 0
    experiment = load(file)[0]
    stated = [one.value for one in certified_values(experiment)]
    again = [one.value for one in certified_values(read_certificate(certificate, experiment))]
    np.testing.assert_allclose(again, stated, rtol=0, atol=1e-12)


def test_every_kind_of_value_is_drawn_about_what_is_read(tmp_path: Path) -> None:
    """Of each value's deviations from the exact one, the root mean square is its standard
    uncertainty.
    """
    file, certificate = write(tmp_path, EVERYTHING), tmp_path / "c.csv"
    experiment = load(Path(file))[0]
    stated = certified_values(experiment)
    arguments = [
        "simulate",
        file,
        "-o",
        str(tmp_path / "r.csv"),
        "--certificate",
        str(certificate),
        "--force",
    ]
    assert main([*arguments, "--exact"]) == 0
    exact = [one.value for one in certified_values(read_certificate(certificate, experiment))]
    # The artefacts are as drawn, and the machine is not.
    others = [k for k, one in enumerate(stated) if one.item != "priors[0]"]
    assert np.array(exact)[others] == pytest.approx(
        np.array([one.value for one in stated])[others], abs=1e-15
    )
    deviations = []
    for seed in range(40):
        assert main([*arguments, "--seed", str(seed)]) == 0
        values = [one.value for one in certified_values(read_certificate(certificate, experiment))]
        deviations.append((np.array(values) - exact) / [one.standard_uncertainty for one in stated])
    mean_square = (np.array(deviations) ** 2).mean(axis=0)
    error = np.sqrt(2 / len(deviations))
    for k, one in enumerate(stated):
        if one.item.startswith(("probes", "priors")):
            assert abs(mean_square[k] - 1.0) < 4 * error, one
        elif one.item in ("calibration[2]", "calibration[3]"):
            # The standard itself is off from its drawing by its uncertainty, and its new
            # certificate once more.
            assert abs(mean_square[k] - 2.0) < 8 * error, one


def test_readings_are_the_same_with_and_without_a_certificate(tmp_path: Path) -> None:
    alone, beside = tmp_path / "alone.csv", tmp_path / "beside.csv"
    assert main(["simulate", QUICKSTART, "-o", str(alone)]) == 0
    certificate = tmp_path / "certificate.csv"
    assert main(["simulate", QUICKSTART, "-o", str(beside), "--certificate", str(certificate)]) == 0
    assert alone.read_bytes() == beside.read_bytes()


def test_fit_takes_the_certificate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    readings, certificate = tmp_path / "readings.csv", tmp_path / "certificate.csv"
    assert (
        main(
            [
                "simulate",
                QUICKSTART,
                "-o",
                str(readings),
                "--exact",
                "--certificate",
                str(certificate),
            ]
        )
        == 0
    )
    lines = certificate.read_text().splitlines()
    assert lines[0].startswith("# ") and lines[1] == "item,first,second,value"
    # Balls may stand in either order, and a longer distance makes the plate larger.
    item, first, second, value = lines[2].split(",")
    assert value == "750 mm"
    certificate.write_text("\n".join([*lines[:2], f"{item},{second},{first},750.1 mm", *lines[3:]]))
    capsys.readouterr()
    lengths = []
    for options in ([], ["--certificate", str(certificate)]):
        main(["fit", QUICKSTART, str(readings), "--json", *options])
        found = json.loads(capsys.readouterr().out)["estimates"]
        ends = [[found[f"plate/{ball}: {axis}" if f"plate/{ball}: {axis}" in found else f"{ball}: {axis}"]["value"]
                 for axis in "xyz"] for ball in (first, second)]  # fmt: skip
        lengths.append(float(np.linalg.norm(np.subtract(*ends))))
    assert lengths[0] == pytest.approx(0.75, abs=1e-9)
    assert lengths[1] > 0.75 + 1e-5


def test_both_files_are_written_or_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    readings, certificate = tmp_path / "readings.csv", tmp_path / "certificate.csv"
    certificate.write_text("mine")
    arguments = ["simulate", QUICKSTART, "-o", str(readings), "--certificate"]
    assert main([*arguments, str(certificate)]) == 3
    assert "exists already" in capsys.readouterr().err
    assert not readings.exists() and certificate.read_text() == "mine"
    assert main([*arguments, str(tmp_path / "nowhere" / "certificate.csv"), "--force"]) == 3
    assert not readings.exists()
    readings.write_text("old")
    assert main([*arguments, str(tmp_path / "nowhere" / "certificate.csv"), "--force"]) == 3
    assert readings.read_text() == "old"
    assert main([*arguments, str(readings), "--force"]) == 2
    assert wording.ARE_THE_SAME_FILE in capsys.readouterr().err and readings.read_text() == "old"
    assert main([*arguments, str(certificate), "--force"]) == 0
    assert certificate.read_text().startswith(wording.CERTIFICATE_VALUES_OF_QUICKSTART)
    bare = tmp_path / "bare.yaml"
    text = Path(QUICKSTART).read_text()
    start, end = text.index("calibration:"), text.index("evaluation:")
    bare.write_text(text[:start] + text[end:])
    assert (
        main(
            [
                "simulate",
                str(bare),
                "-o",
                str(tmp_path / "b.csv"),
                "--certificate",
                str(tmp_path / "c.csv"),
            ]
        )
        == 3
    )
    assert (
        "leave --certificate out" in capsys.readouterr().err and not (tmp_path / "b.csv").exists()
    )


def lines_of_simulated(certificate: Path) -> list[str]:
    """The lines of a certificate of the first example, which is written."""
    readings = certificate.with_name("r.csv")
    command = ["simulate", QUICKSTART, "-o", str(readings), "--certificate", str(certificate)]
    assert main(command) == 0
    return certificate.read_text().splitlines()


@pytest.mark.parametrize(
    ("number", "old", "new", "told"),
    [
        (2, "calibration[0]", "calibration[9]", 'the experiment has no certified "calibration[9]"'),
        (2, "r1c1", "r1c9", 'calibration[0] has no "r1c9, '),
        (2, " mm", "", "has no unit"),
        (2, " mm", " urad", "is an angle; a length is expected"),
        (2, ",7", ",2", "is far from the 750 mm of the artefact's drawing"),
        (1, "value", "value_mm", "unknown column"),
    ],
)
def test_a_wrong_certificate_is_told_by_line(
    tmp_path: Path, number: int, old: str, new: str, told: str
) -> None:
    certificate = tmp_path / "c.csv"
    lines = lines_of_simulated(certificate)
    assert old in lines[number]
    lines[number] = lines[number].replace(old, new)
    certificate.write_text("\n".join(lines))
    with pytest.raises(ExperimentError) as caught:
        read_certificate(certificate, load(Path(QUICKSTART))[0])
    (message,) = caught.value.messages
    assert message.line == number + 1 and told in message.text


def test_values_missing_or_given_twice_are_told(tmp_path: Path) -> None:
    certificate, experiment = tmp_path / "c.csv", load(Path(QUICKSTART))[0]
    lines = lines_of_simulated(certificate)
    certificate.write_text("\n".join(lines[:-1]))
    with pytest.raises(ExperimentError, match=wording.NO_VALUE_OF_ADD):
        read_certificate(certificate, experiment)
    certificate.write_text("\n".join([*lines, lines[-1]]))
    with pytest.raises(ExperimentError, match="in line 6 already"):
        read_certificate(certificate, experiment)


def test_coordinates_in_another_unit_are_far_from_the_drawing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    start, end = text.index("calibration:"), text.index("# Where U4")
    path, readings, table = tmp_path / "e.yaml", tmp_path / "r.csv", tmp_path / "c.csv"
    known = "calibration: [{kind: coordinates, standard_uncertainty: 0.2 um}]\n"
    path.write_text(text[:start] + known + text[end:], encoding="utf-8")
    assert main(["simulate", str(path), "-o", str(readings), "--certificate", str(table)]) == 0
    assert main(["fit", str(path), str(readings), "--certificate", str(table)]) == 0
    capsys.readouterr()
    told = (
        "the balls of these co-ordinates are 0.001 times as far apart as in the artefact's drawing"
    )
    table.write_text(re.sub(" mm| nm", " um", table.read_text(encoding="utf-8")), encoding="utf-8")
    assert main(["fit", str(path), str(readings), "--certificate", str(table)]) == 3
    assert told in capsys.readouterr().err
    # The same of a table of the experiment itself.
    rows = [
        f"r{i}c{j},{0.1875 * (j - 1)},{0.1875 * (i - 1)},0"
        for i in range(1, 6)
        for j in range(1, 6)
    ]
    table.write_text("\n".join(["ball,x_mm,y_mm,z_mm", *rows]), encoding="utf-8")
    path.write_text(
        path.read_text(encoding="utf-8").replace("0.2 um}]", "0.2 um, values: c.csv}]"),
        encoding="utf-8",
    )
    assert main(["check", str(path)]) == 3
    assert told in capsys.readouterr().err
