"""What goes to the laboratory with a design: every reading once and in order on the sheet, in the
table to fill in, and in the points of a program.
"""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.campaign.reading_lists import planned_readings
from ballplate.extensions.campaign.sheet import Sheet, sheet_of
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.campaign import wording
from tests.extensions.pages.pages_read import ResultPage

# Positions of all kinds; poses and layouts that can be computed by hand.
DESIGN = """
title: "two plates | <b>& a bar"
machine: {volume: [600 mm, 500 mm, 450 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -40 mm], right: [30 mm, 0 mm, -40 mm]}
artefacts:
  plate: {kind: grid, balls: [3, 2], size: [200 mm, 100 mm]}
  bar: {kind: two_spheres, length: 300 mm, role: length_standard}
positions:
  - {name: flat low, artefact: plate, plane: z, level: 50 mm, corner: {x: 40 mm, y: 20 mm}, probes: [down, right]}
  - {name: P2, description: "standing, turned", artefact: plate, plane: y, level: 250 mm, corner: {z: 40 mm, x: 60 mm}, quarter_turns: 1, probes: [right]}
  - name: turned low
    artefact: plate
    pose: {origin: [300 mm, 250 mm, 100 mm], rotation: [0 deg, 0 deg, 90 deg]}
    readings: [{probes: [right], balls: [r1c1, r2c3]}, {probes: [down, right], balls: [r2c1], repeats: 2}]
  - {name: short bar, artefact: bar, pose: {origin: [100 mm, 400 mm, 300 mm]}, probes: [down], repeats: 3}
calibration:
  - {kind: distances, artefact: plate, pairs: corner sides, standard_uncertainty: 1 um}
  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 1 um}
evaluation: {points: {random: 12, seed: 1}, probe: down}
"""


def expected() -> list[tuple[str, str, str, tuple[float, float, float]]]:
    """The readings in order with the balls' centres in millimetres, written down from the file: in
    each position one probe after the other, each ball as often as it is read.
    """
    plate = {f"r{r}c{c}": (100.0 * (c - 1), 100.0 * (r - 1)) for r in (1, 2) for c in (1, 2, 3)}
    found = [
        ("flat low", ball, probe, (40 + u, 20 + v, 50.0))
        for probe in ("down", "right")
        for ball, (u, v) in plate.items()
    ]
    # Across y the plate's axes run along z and x; a quarter turn takes (u, v) to (-v, u), and the
    # lower corner of that is at (z, x) = (40, 60).
    found += [
        ("P2", ball, "right", (60 + u, 250.0, 40 + (100 - v))) for ball, (u, v) in plate.items()
    ]

    def turned(ball: str) -> tuple[float, float, float]:
        u, v = plate[ball]
        return 300 - v, 250 + u, 100.0

    # The sheet takes one probe after the other, whatever the groups of the file.
    found += [
        ("turned low", ball, "right", turned(ball)) for ball in ("r1c1", "r2c3", "r2c1", "r2c1")
    ]
    found += [("turned low", "r2c1", "down", turned("r2c1"))] * 2
    ends = {"1": 100.0, "2": 400.0}
    found += [
        ("short bar", ball, "down", (x, 400.0, 300.0)) for ball, x in ends.items() for _ in "123"
    ]
    return found


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sheet") / "design.yaml"
    path.write_text(DESIGN)
    return path


@pytest.fixture(scope="module")
def sheet(design: Path) -> Sheet:
    return sheet_of(load(design)[0])


def of_page(text: str) -> list[tuple[str, str, str]]:
    """Readings of a page: position, probe and ball of every box."""
    found = []
    for section in text.split("<section")[1:]:
        position = re.findall(r"<h2>\d+\. (.*?)(?: <small>.*)?</h2>", section)[0]
        for probe, items in re.findall("with <b>(.*?)</b>.*?<ol[^>]*>(.*?)</ol>", section):
            for boxes, ball in re.findall("<li>((?:<i></i>)*)(.*?)</li>", items):
                found += [(position, probe, ball)] * boxes.count("<i>")
    return found


def test_every_reading_is_on_the_sheet_once_and_in_order(sheet: Sheet) -> None:
    assert of_page(sheet.page()) == [
        (position, probe, ball) for position, ball, probe, _ in expected()
    ]


def test_the_page_asks_for_nothing_and_lets_no_text_out(sheet: Sheet) -> None:
    page = sheet.page()
    tags = ResultPage(page).tags
    assert not {"script", "link", "img", "iframe", "object", "b>"} & {tag for tag, _ in tags}
    assert not [a for _, own in tags for a in own if a in ("src", "href", "srcset")]
    assert "url(" not in page and "@import" not in page and "http" not in page
    assert "&lt;b&gt;" in page
    style = page[page.index("<style>") : page.index("</style>")]
    # The title stands in the margins of the pages as well, where a quotation mark would end it.
    (margin,) = re.findall(r'@bottom-left \{ content: "([^"]*)"', style)
    assert re.sub(r"\\([0-9a-f]+) ", lambda m: chr(int(m[1], 16)), margin) == sheet.title
    for part in ("@media print", "size: A4", "counter(pages)", "break-inside: avoid"):
        assert part in style


def test_the_head_has_what_is_filled_in_by_hand(sheet: Sheet) -> None:
    text = sheet.page()
    for name in ("machine", "operator", "date", "temperature", "design.yaml", "ballplate ", "page"):
        assert name in text
    flat = re.sub(r"<[^>]*>|\|", " ", text)
    assert re.search(r"right\s+30\s+0\s+-40", flat)
    assert re.search(r"volume\s+600 x 500 x 450 mm\s+repeatability\s+1 µm", flat)


def test_angles_of_a_head_are_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "design.yaml"
    # A tip straight down by 30 mm, tilted by 90 deg towards -y and then turned by 90 deg, is at +x.
    probes = "{down: [0 mm, 0 mm, -40 mm], right: {A: 90 deg, B: 90 deg}}"
    path.write_text(
        DESIGN.replace(
            "probes: {down: [0 mm, 0 mm, -40 mm], right: [30 mm, 0 mm, -40 mm]}",
            f"head: {{tip: [0 mm, 0 mm, -30 mm]}}\nprobes: {probes}",
        )
    )
    flat = re.sub(r"<[^>]*>|\|", " ", sheet_of(load(path)[0]).page())
    assert re.search(r"down\s+0\s+0\s+-40\s", flat)
    assert re.search(r"right\s+30\s+\S+\s+\S+\s+90°, 90°", flat)


def test_each_position_tells_where_its_first_and_last_balls_are(sheet: Sheet) -> None:
    """And its boxes have room for all that is beside them."""
    page = sheet.page()
    places = {(position, ball): place for position, ball, _, place in expected()}
    steps = re.findall(r"<h2>\d+\. (.*?) ?<.*?so that</dt><dd>(.*?) mm</dd>", page)
    for name, text in steps:
        for ball, numbers in re.findall(r"ball (\S+) is at \((.*?)\)", text):
            assert tuple(map(float, numbers.split(","))) == places.get((name, ball), ()), ball
    assert len(steps) == 4 and page.count("<dt>artefact</dt>") == 4
    for width, items in re.findall(r'--width: ([\d.]+)em">(.*?)</ol>', page):
        most = max(map(len, re.findall("<li>(.*?)</li>", items.replace("<i></i>", "##"))))
        assert 0.6 * most < float(width) < 0.6 * most + 2.0


def test_points_are_the_centres_that_the_file_says(sheet: Sheet) -> None:
    rows = list(csv.DictReader(io.StringIO(sheet.points())))
    want = expected()
    assert [(row["position"], row["ball"], row["probe"]) for row in rows] == [
        one[:3] for one in want
    ]
    found = np.array([[float(row[f"nominal_{axis}_mm"]) for axis in "xyz"] for row in rows])
    assert found == pytest.approx(np.array([one[3] for one in want]), abs=1e-4)
    # Names are position_ball_probe, of which nothing is lost but what a name may not have.
    assert [row["feature"].split("_") for row in rows] == [
        [one[0].replace(" ", "-"), one[1], one[2]] for one in want
    ]


def test_a_program_measures_every_ball_with_its_stylus(sheet: Sheet) -> None:
    lines = sheet.points(0.022).splitlines()
    centres: dict[str, np.ndarray] = {}
    measured: list[tuple[str, str]] = []
    probe, at, points = "", "", 0
    for line in lines:
        if match := re.fullmatch(r"SNSLCT/SA\((.*)\)", line):
            assert match[1] != probe, "selected twice"
            probe = match[1]
        elif match := re.fullmatch(r"F\((.*)\)=FEAT/SPHERE,OUTER,CART,(.*)", line):
            *centre, diameter = map(float, match[2].split(","))
            assert match[1] not in centres and diameter == 22.0
            centres[match[1]] = np.array(centre)
        elif match := re.fullmatch(r"MEAS/SPHERE,F\((.*)\),(\d+)", line):
            at, points = match[1], int(match[2])
            measured.append((at, probe))
        elif match := re.fullmatch(r"PTMEAS/CART,(.*)", line):
            numbers = np.array(match[1].split(","), float)
            place, normal = numbers[:3], numbers[3:]
            # On the surface, along the normal that points out of the ball, on the head's side.
            assert place - centres[at] == pytest.approx(11.0 * normal, abs=2e-4)
            tip = {"down": (0, 0, -40), "right": (30, 0, -40)}[probe]
            assert normal @ tip < 0.0 and np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-6)
            points -= 1
        elif line == "ENDMES":
            assert points == 0
    want = expected()
    assert measured == [(f"{p.replace(' ', '-')}_{b}_{q}", q) for p, b, q, _ in want]
    for (name, _), (*_, centre) in zip(measured, want, strict=True):
        assert centres[name] == pytest.approx(np.array(centre), abs=1e-4)
    # A program, not a report: no actual feature in it, and it says so.
    assert "MODE/PROG,MAN" in lines and "DATSET/MCS" in lines[2] and lines[-1] == "ENDFIL"
    assert not any("FA(" in line for line in lines)


def test_five_points_determine_the_sphere(sheet: Sheet) -> None:
    """The normals of each ball span enough for a centre and a radius."""
    normals = re.findall(r"PTMEAS/CART,(?:[^,]*,){3}(.*)", sheet.points(0.022))
    some = np.array([one.split(",") for one in normals], float).reshape(-1, 5, 3)
    columns = np.concatenate([some, np.ones((*some.shape[:2], 1))], axis=2)
    assert np.linalg.svd(columns, compute_uv=False).min() > 0.2


def test_features_that_would_be_the_same_are_refused(tmp_path: Path) -> None:
    text = DESIGN.replace("name: P2", "name: flat-low")
    (tmp_path / "e.yaml").write_text(text)
    (experiment,) = load(tmp_path / "e.yaml")
    with pytest.raises(ExperimentError, match="flat-low_r1c1_right; rename"):
        sheet_of(experiment).points()


def filled(template: str, readings: str) -> str:
    """The template with the numbers of readings in its cells, by the names in its rows."""
    given: dict[tuple[str, ...], list[list[str]]] = {}
    for row in list(csv.reader(io.StringIO(readings)))[1:]:
        given.setdefault(tuple(row[:3]), []).append(row[3:])
    rows = list(csv.reader(io.StringIO(template)))
    for row in rows[1:]:
        row[3:] = given[tuple(row[:3])].pop(0)
    assert not any(given.values()), "more readings than rows"
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


@pytest.mark.parametrize("name", ["design", "designs/quickstart.yaml"])
def test_a_template_that_is_filled_in_fits_as_the_readings_do(
    name: str, design: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(design) if name == "design" else name
    readings, table = tmp_path / "readings.csv", tmp_path / "table.csv"
    assert main(["simulate", file, "-o", str(readings), "--seed", "3"]) == 0
    assert main(["sheet", file, "--readings", str(table)]) == 0
    capsys.readouterr()
    # As it was printed it has no readings, which fit says once.
    assert main(["fit", file, str(table)]) == 3
    (said_once,) = capsys.readouterr().err.splitlines()
    count = len(table.read_text().splitlines()) - 1
    assert re.search(rf"table\.csv:2:1: .* x, y, z are empty in all {count} rows", said_once)
    table.write_text(filled(table.read_text(), readings.read_text()))
    # With one row left empty it says which, and what lacks.
    lines = table.read_text().splitlines()
    gap = [*lines[:4], re.sub(r"(,[-0-9.e]+)+$", ",,,", lines[4]), *lines[5:], ""]
    (tmp_path / "gap.csv").write_text("\n".join(gap))
    assert main(["fit", file, str(tmp_path / "gap.csv")]) in (0, 1)
    position, ball, probe = lines[4].split(",")[:3]
    said = capsys.readouterr().err
    assert "without co-ordinates, left out: line 5\n" in said
    named = rf"{position}: ball (plate/)?{ball} with {probe}"
    assert re.search(rf"planned but not read \(1\): {named}\n", said)
    fits = []
    for path in (readings, table):
        assert main(["fit", file, str(path), "--json"]) in (0, 1)
        fits.append(json.loads(capsys.readouterr().out))
    assert fits[0].keys() == fits[1].keys() and "degrees_of_freedom" in fits[0]
    for name, estimate in fits[0]["estimates"].items():
        for key in ("value", "standard_uncertainty"):
            wanted = pytest.approx(estimate[key] or 0.0, rel=1e-6, abs=1e-13)
            assert (fits[1]["estimates"][name][key] or 0.0) == wanted, name
    assert fits[1]["sum_of_squares"] == pytest.approx(fits[0]["sum_of_squares"], rel=1e-6)


def test_the_list_of_centres_is_not_taken_for_readings(
    design: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = tmp_path / "points.csv"
    assert main(["sheet", str(design), "--points", str(points)]) == 0
    assert main(["fit", str(design), str(points)]) == 3
    assert wording.AS_BALLPLATE_SHEET_POINTS_WRITES in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--points", "p.dmi"], "--ball-diameter"),
        (["--points", "p.csv", "--ball-diameter", "20 mm"], ".dmi"),
        (["--points", "p.txt"], "ends in"),
        (["-o", "sheet.pdf"], "ends in"),
        (["--points", "p.dmi", "--ball-diameter", "20"], "unit"),
        (["--points", "p.dmi", "--ball-diameter", "-2 mm"], "above zero"),
    ],
)
def test_wrong_usage(
    options: list[str],
    text: str,
    design: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["sheet", str(design.resolve()), *options])
    except SystemExit as left:
        status = int(left.code or 0)
    assert status == 2
    assert text in capsys.readouterr().err


def test_spheres_in_two_dimensions_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flat = "designs/certified/two-dimensions.yaml"
    points = tmp_path / "p.dmi"
    assert main(["sheet", flat, "--points", str(points), "--ball-diameter", "20 mm"]) == 3
    assert "three dimensions" in capsys.readouterr().err and not points.exists()
    assert main(["sheet", flat, "--points", str(points.with_suffix(".csv"))]) == 0


def test_json_has_no_times_where_none_are_known(
    design: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sheet", str(design), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["seconds"] is None and [one["start"] for one in said["steps"]] == [None] * 4
    assert [one["name"] for one in said["steps"]] == ["flat low", "P2", "turned low", "short bar"]


def test_every_shipped_design_has_a_sheet() -> None:
    """Their readings are all in it, also those with gauges and in two dimensions."""
    paths = ["quickstart.yaml", "npl/6.1.1.yaml", "hurt_foss/bryan-gauge.yaml"]
    paths += ["hurt_foss/bar-bell.yaml", "certified/two-dimensions.yaml"]
    for path in paths:
        experiment = load(Path("designs", path))[0]
        sheet = sheet_of(experiment)
        count = sum(position.count for position in experiment.positions)
        assert len(planned_readings(sheet.sheet, experiment)) == count
        page = sheet.page()
        assert len(of_page(page)) == count and "<dt>set up</dt>" in page and "-0.0000" not in page
        assert ("<dt>artefact</dt>" in page) == (len(experiment.artefacts) > 1)
