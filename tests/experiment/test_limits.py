"""Files that ask for more than there is room or time for, or that hold what is no text: what is
said, and soon.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from sys import modules

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.elimination import SMALL, eliminate
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.geometry.ball_layouts import BallLayout, coincident_balls
from ballplate.simulator.inputs.decoding import MOST_IN_LINE, refuse_long_lines
from ballplate.simulator.inputs.messages import MOST_MESSAGES, ExperimentError
from ballplate.simulator.inputs.yamltree import parse_tree, read_text
from ballplate.simulator.readings.true_artefacts import true_artefacts

from tests.experiment import wording

GOOD = """\
title: good
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: kinematic}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}
positions:
  - {name: low, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}
calibration:
  - {kind: distances, pairs: corner sides, standard_uncertainty: 0.2 um}
"""


def refusals(folder: Path, text: str) -> list[str]:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        load(path)
    return [line.removeprefix(f"{path}:") for line in str(caught.value).split("\n")]


def replaced(old: str, new: str) -> str:
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "corner: {x: 0 mm, y: 0 mm}}",
            "corner: {x: 0 mm, y: 0 mm}, readings: &r [{repeats: 10000}, {repeats: 10000}]}\n"
            + "\n".join(
                f"  - {{name: p{k}, plane: z, level: 0 mm, corner: {{x: 0 mm, y: 0 mm}}, readings:"
                " *r}"
                for k in range(20)
            ),
            (
                "8:82: positions[11].readings[0]: there are 2070000 readings up to here, repeats"
                " counted; at most 2000000 are possible: read fewer balls, or less often"
            ),
        ),
        (
            "[3, 3]",
            "[200, 200]",
            (
                "10:30: calibration[0].pairs: distances tie 40000 balls together, at most 3000 are"
                " possible; calibrate fewer distances, such as corner sides, or co-ordinates"
            ),
        ),
        (
            "title: good",
            "title: good\nevaluation: {points: {random: 40001}}",
            (
                "2:31: evaluation.points.random: the number 40001 is out of range; give one at most"
                " 40000"
            ),
        ),
        (
            "title: good",
            "title: good\nvariants: {"
            + ", ".join(f"v{k}: {{title: a}}" for k in range(1001))
            + "}",
            "2:11: variants: 1001 variants are too many; at most 1000 are possible",
        ),
        (
            "title: good",
            "title: good\npriors:\n" + "  - {parameter: EXX, standard_uncertainty: 1 um}\n" * 1251,
            (
                "1253:5: priors[1250]: there are 5004 priors up to here, coefficients counted; at"
                " most 5000 are possible"
            ),
        ),
        (
            "  - {name: low,",
            "\n".join(
                f"  - {{name: p{k}, plane: z, level: 0 mm, corner: {{x: 0 mm, y: 0 mm}}}}"
                for k in range(580)
            )
            + "\n  - {name: low,",
            (
                "7:1: positions: 581 poses, 69 machine errors and 0 probe offsets make 3555"
                " parameters in addition to the balls; at most 3500 are possible: leave"
                " positions out, or give the machine fewer coefficients"
            ),
        ),
        (
            "plate: {kind: grid",
            (
                "a: {kind: grid, balls: [200, 200], size: [1 m, 1 m]}\n"
                "  b: {kind: grid, balls: [200, 200], size: [1 m, 1 m]}\n"
                "  c: {kind: grid, balls: [200, 200], size: [1 m, 1 m]}\n  plate: {kind: grid"
            ),
            (
                "8:6: artefacts.c: there are 120000 balls up to here; at most 100000 of all"
                " artefacts are possible"
            ),
        ),
        (
            "error_model: {kind: kinematic}",
            "error_model: {kind: empirical, terms: {centres: [8, 8, 8]}}",
            (
                "3:39: error_model.terms: these functions are too similar to be distinguished; give"
                " fewer centres or a smaller constant"
            ),
        ),
    ],
)
def test_too_much(tmp_path: Path, old: str, new: str, line: str) -> None:
    text = replaced(old, new)
    if "tie 40000" in line:
        text = text.replace("corner sides", "all")
    assert line in refusals(tmp_path, text)


@pytest.mark.parametrize(("count", "repeats"), [(5, 1), (1, 5)])
def test_gauges_of_too_many_lengths(tmp_path: Path, count: int, repeats: int) -> None:
    elevations = ", ".join(f"{k} deg" for k in range(20))
    directions = f"{{azimuths: 250, elevations: [{elevations}]}}"
    gauge = (
        f"  gauge: {{kind: bryan_gauge, radius: 300 mm, directions: {directions}}}\npositions:\n"
    )
    places = (
        f"  - {{name: {k}, artefact: gauge, repeats: {repeats}, pose: {{origin: [500 mm, 500 mm,"
        " 100 mm]}}"
        for k in range(count)
    )
    text = replaced("positions:", gauge + "\n".join(places)).replace(
        "name: low,", "name: low, artefact: plate,"
    )
    text = text.replace("distances, pairs", "distances, artefact: plate, pairs")
    assert refusals(tmp_path, text) == [wording.BRYAN_GAUGES_ARE_READ_TIMES]


def with_standard(balls: str) -> str:
    """The good file with a plate of so many balls, all distances between which are certified."""
    bar = f"  bar: {{kind: grid, balls: {balls}, size: [450 mm, 450 mm], role: length_standard}}\n"
    text = replaced("positions:", f"{bar}positions:")
    text = text.replace("name: low,", "name: low, artefact: plate,")
    text = text.replace("distances, pairs", "distances, artefact: plate, pairs")
    return text.replace(
        "calibration:",
        "  - {name: bar, artefact: bar, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0"
        " mm}}\ncalibration:\n  - {kind: distances, artefact: bar, pairs: all,"
        " standard_uncertainty: 1 um}",
    )


def test_a_length_standard_of_too_many_lengths(tmp_path: Path) -> None:
    """Three thousand with balls in common are possible; others are no difficulty."""
    assert refusals(tmp_path, with_standard("[20, 20]")) == [wording.DISTANCES_OF_READ_TIMES]
    text = with_standard("[10, 8]")
    assert refusals(tmp_path, text) == [wording.DISTANCES_OF_HAVE_BALLS_IN_COMMON]
    (tmp_path / "e.yaml").write_text(text.replace("[10, 8]", "[11, 7]"))
    assert len(load(tmp_path / "e.yaml")[0].calibration[0].values) == 2926


def test_more_points_than_there_is_memory_for_with_so_many_errors(tmp_path: Path) -> None:
    text = replaced(
        "{kind: kinematic}",
        "{kind: kinematic, position_coefficients: 25, rotation_coefficients: 25}",
    )
    (line,) = refusals(tmp_path, text + "evaluation: {points: {random: 40000}}\n")
    (tmp_path / "e.yaml").write_text(text)
    errors = len(lay_out(load(tmp_path / "e.yaml")[0]).model.parameters)
    most = 50_000_000 // (3 * errors)
    assert line == (
        f"11:22: evaluation.points: 40000 points with {errors} machine errors have"
        f" {120_000 * errors} derivatives; at most {most} points are possible with these"
        " errors"
    )
    (tmp_path / "e.yaml").write_text(f"{text}evaluation: {{points: {{random: {most}}}}}\n")
    assert len(load(tmp_path / "e.yaml")[0].evaluation.points) == most


def test_no_more_than_a_thousand_errors(tmp_path: Path) -> None:
    lines = refusals(tmp_path, replaced("balls: [3, 3]", f"balls: [{', '.join(['a'] * 20_000)}]"))
    assert len(lines) <= 2 * MOST_MESSAGES
    balls = f"corner: {{x: 0 mm, y: 0 mm}}, balls: [{', '.join(f'b{k}' for k in range(20_000))}]}}"
    lines = refusals(tmp_path, replaced("corner: {x: 0 mm, y: 0 mm}}", balls))
    assert len(lines) == MOST_MESSAGES + 1 and lines[-1].endswith(wording.MORE_THAN_ERRORS_MEND)
    lines = refusals(tmp_path, "a: [" + "~, " * 20_000 + "]")
    assert len(lines) == MOST_MESSAGES + 1
    first, last = refusals(tmp_path, "a: [" + "*a, " * 20_000 + "]")
    assert f"(and so in {MOST_MESSAGES - 1} more places" in first
    assert last.endswith(wording.MORE_THAN_ERRORS_MEND)


def test_a_table_of_no_more_than_a_thousand_errors(tmp_path: Path) -> None:
    (tmp_path / "balls.csv").write_text("ball,x_mm,y_mm\n" + "a,b,c\n" * 20_000)
    text = replaced(
        "{kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}", "{kind: balls, file: balls.csv}"
    )
    assert refusals(tmp_path, text)[-1].endswith(wording.MORE_THAN_ERRORS)


def test_tables_of_many_columns(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("x_mm," * 10**5 + "\n1,2\n")
    text = replaced(
        "{kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}", "{kind: balls, file: t.csv}"
    )
    text += "true_machine: {kind: curves, files: [t.csv]}\n"
    lines = refusals(tmp_path, text)
    assert lines == [
        f"{tmp_path}/t.csv:1:1: 100001 columns are too many; the first line should be {example}"
        for example in ("ball,x_mm,y_mm", "position_mm")
    ]


def test_names_with_ends_of_lines_and_control_characters(tmp_path: Path) -> None:
    text = replaced("name: low,", r'name: low, artefact: "a\n\e[31m\u2028b",')
    (line,) = refusals(tmp_path, text)
    assert (
        line
        == r'8:27: positions[0].artefact: unknown artefact "a\x0a\x1b[31m\u2028b"; known: plate'
    )
    (line,) = refusals(tmp_path, replaced("name: low,", r'name: low, "a\nb": 1,'))
    assert line.startswith(r"8:17: positions[0][a\x0ab]: unknown key")
    (line,) = refusals(tmp_path, replaced("title: good", r'title: "a\tb"'))
    assert line == '1:8: title: the text "a b" holds a control character; remove it'


def test_aliases_count_for_depth() -> None:
    lines = ["a0: &a0 [1]"] + [f"a{k + 1}: &a{k + 1} {'[' * 40}*a{k}{']' * 40}" for k in range(40)]
    with pytest.raises(ExperimentError) as caught:
        parse_tree("\n".join(lines), "f")
    assert str(caught.value) == wording.NESTED_MORE_THAN_DEEP


def _device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _loop(path: Path) -> None:
    path.symlink_to(path.name)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (_device, "this is a device; name a file"),
        (os.mkfifo, "this is a pipe; name a file"),
        (
            _loop,
            "cannot be read (Too many levels of symbolic links); check its name and permissions",
        ),
    ],
)
def test_what_is_no_file(tmp_path: Path, make: Callable[[Path], None], text: str) -> None:
    path = tmp_path / "odd"
    make(path)
    with pytest.raises(ExperimentError) as caught:
        read_text(path)
    assert str(caught.value) == f"{path}: {text}"


READINGS = "position,ball,probe,x_mm,y_mm,z_mm\nz low,r1c1,down,"


@pytest.mark.parametrize(
    ("read", "before", "filler"),
    [
        (load, GOOD + "# ", "x"),
        (load, "title:\n  ", "x"),
        (lambda path: bp.fit(bp.quickstart(), path), READINGS, "1"),
        (lambda path: bp.fit(bp.quickstart(), path), READINGS.replace(",", ";"), " "),
        (bp.load_map, "map: 1\ntitle: ", "a "),
        (
            bp.read_report,
            Path("tests/extensions/laboratory/samples/dmis_mm.dmo").read_text() + "$$ ",
            "-",
        ),
        (
            bp.read_report,
            Path("tests/extensions/laboratory/samples/pcdmis_mm.txt").read_text() + " ",
            " ",
        ),
    ],
    ids=["experiment", "text", "readings", "table", "map", "dmis", "pcdmis"],
)
def test_long_lines(
    tmp_path: Path, read: Callable[[Path], object], before: str, filler: str
) -> None:
    path, line = tmp_path / "long", before.count("\n") + 1
    path.write_text(before + MOST_IN_LINE // len(filler) * filler + "\n", encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        read(path)
    told = f"has more than {MOST_IN_LINE} characters in a line; break it into several"
    assert str(caught.value) == f"{path}:{line}:1: {told}"


def test_a_report_in_xml_may_be_one_line(tmp_path: Path) -> None:
    text = Path("tests/extensions/laboratory/samples/qif_3_0.qif").read_text(encoding="utf-8")
    path = tmp_path / "long.qif"
    path.write_text(" ".join(text.splitlines()) + MOST_IN_LINE * " ", encoding="utf-8")
    assert len(bp.read_report(path).to_frame())
    with pytest.raises(ExperimentError) as caught:
        bp.fit(bp.quickstart(), path)
    assert "in a line" not in str(caught.value)


def test_the_longest_lines() -> None:
    """Lines that are just short enough, however they end, between short ones."""
    long = MOST_IN_LINE * "x"
    for end in ("\n", "\r", "\r\n"):
        text = end.join(["a", long, "", long, long, "b"])
        refuse_long_lines(text, "f")
        with pytest.raises(ExperimentError, match="f:4:1: "):
            refuse_long_lines(text.replace(f"{end}{end}x", f"{end}{end}xx"), "f")


def test_many_balls_at_one_place() -> None:
    names = tuple(map(str, range(40_000)))
    assert len(coincident_balls(BallLayout(names, np.zeros((40_000, 3))))) >= 3
    flat = np.random.default_rng(1).random((40_000, 3)) * (1, 1, 0)
    assert coincident_balls(BallLayout(names, flat)) == []


def test_certified_coordinates_of_many_balls(tmp_path: Path) -> None:
    """Frame, estimate and synthetic artefact of 10,000 balls need no matrix over all of them."""
    text = replaced("[3, 3]", "[100, 100]").replace(
        "distances, pairs: corner sides", "coordinates, balls: all"
    )
    (tmp_path / "e.yaml").write_text(text)
    design = lay_out(load(tmp_path / "e.yaml")[0])
    off = true_artefacts(design, np.random.default_rng(1)) - design.balls.places
    assert 0.99 < off.std() / 0.2e-6 < 1.01 and abs(off.mean()) < 0.01e-6


def test_many_distances_are_absorbed_some_at_a_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = replaced("[3, 3]", "[14, 14]").replace("corner sides", "neighbours")
    (tmp_path / "e.yaml").write_text(text)
    design = lay_out(load(tmp_path / "e.yaml")[0])
    arguments = design, shared_layout(design)
    from ballplate.simulator.design.measurement import nominal_state

    state = nominal_state(design)
    assert SMALL < 3 * 196
    some = eliminate(*arguments, state)
    monkeypatch.setattr("ballplate.simulator.estimation.elimination.TIED_AT_ONCE", 50)
    few = eliminate(*arguments, state)
    monkeypatch.setattr("ballplate.simulator.estimation.elimination.SMALL", 10_000)
    plain = eliminate(*arguments, state)
    for one in (some, few):
        np.testing.assert_allclose(
            one.root.T @ one.root, plain.root.T @ plain.root, atol=1e-7 * abs(plain.root).max() ** 2
        )
        whole = one.kept_root.T @ one.kept_root
        np.testing.assert_allclose(
            whole, plain.kept_root.T @ plain.kept_root, atol=1e-12 * abs(whole).max()
        )


def test_variants_that_are_too_large_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each has 9 balls, reads them with one probe, and has 4 calibrated distances and 20 points."""
    each, most = 9 + 9 + 4 + 20, 3
    text = f"{GOOD}evaluation: {{points: {{random: 20, seed: 1}}, probe: down}}\nvariants:\n"
    names = [f"  v{k}: {{seed: {k}}}\n" for k in range(most + 5)]
    path = tmp_path / "e.yaml"
    monkeypatch.setattr(
        modules["ballplate.simulator.experiment.loading"], "MOST_OF_ALL", most * each
    )
    path.write_text(text + "".join(names[:most]), encoding="utf-8")
    assert len(load(path)) == most
    (line,) = refusals(tmp_path, text + "".join(names))
    place = f"{text.count(chr(10)) + most + 1}:7: variants.v{most}"
    assert line == (
        f"{place}: the variants up to here have {(most + 1) * each} balls, balls read,"
        f" calibrated values, priors and evaluation points; at most {most * each} are"
        " possible: move some of the variants to a file of their own"
    )
    # A single experiment has the other limits alone.
    monkeypatch.setattr(modules["ballplate.simulator.experiment.loading"], "MOST_OF_ALL", each - 1)
    path.write_text(text + names[0], encoding="utf-8")
    assert len(load(path)) == 1
