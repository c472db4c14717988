"""The functions of the face do what the commands do, refuse in words, and give results that show
themselves.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
from ballplate.cli import main
from ballplate.results.fits import Fit
from ballplate.simulator.computing.steps import ProgressStep

from tests.extensions.sweeps.support import small_sweep

QUICKSTART = "designs/quickstart.yaml"
MACHINE = "designs/park/machines/npl-like.yaml"
PART = "designs/parts/block.yaml"
TABLE = "designs/gilsinn/table-1.csv"
REAL = "designs/hocken_borchardt/real.yaml", "designs/hocken_borchardt/real-readings.csv"
GAUGE = "designs/hurt_foss/bryan-gauge.yaml", "designs/hurt_foss/bryan-gauge-readings.csv"


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """What a command prints as JSON."""
    assert main([*arguments, "--json"]) in (0, 1)
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("call", "command"),
    [
        (
            lambda: bp.compare(QUICKSTART, trials=2, points=10),
            ("compare", QUICKSTART, "--trials=2", "--points=10"),
        ),
        (lambda: bp.map(MACHINE, grid=(3, 2, 2)), ("map", MACHINE, "--grid=3,2,2")),
        (
            lambda: bp.map(MACHINE, line={"y": 0.3, "z": 0.2}, points=4),
            ("map", MACHINE, "--line=y = 300 mm, z = 200 mm", "--points=4"),
        ),
        (
            lambda: bp.spline(TABLE, y="finish_error", points="12-32", start_slope="0"),
            ("spline", TABLE, "--y=finish_error", "--points=12-32", "--start-slope=0"),
        ),
        (
            lambda: bp.acceptance(design=QUICKSTART, mpe="1 um", point_repeatability="0.2 um"),
            ("acceptance", f"--design={QUICKSTART}", "--mpe=1 um", "--point-repeatability=0.2 um"),
        ),
        (
            lambda: bp.part(PART, QUICKSTART, draws=2, seed=4),
            ("part", PART, f"--design={QUICKSTART}", "--draw=2", "--seed=4"),
        ),
        (lambda: bp.reproduce("npl", "6.1.2"), ("reproduce", "npl", "--experiment=6.1.2")),
        (
            lambda: bp.reach(QUICKSTART, unknowns="repeatability", target="1 um", share=0.9),
            ("reach", QUICKSTART, "--by=repeatability", "--target=1 um", "--share=90%"),
        ),
        (
            lambda: bp.check("designs/certified/deficient.yaml", "U6 average 1 um", suggest=True),
            (*("check", "designs/certified/deficient.yaml", "--goal=U6 average 1 um"), "--suggest"),
        ),
        (
            lambda: bp.fit(bp.load(REAL[0], "with scale"), REAL[1], estimator="reversal"),
            ("fit", *REAL, "--variant=with scale", "--estimator=reversal"),
        ),
        (
            lambda: bp.fit(
                bp.load(GAUGE[0], "radius known"),
                GAUGE[1],
                estimator="length-equations",
                sigma="given",
            ),
            (
                *("fit", *GAUGE, "--variant=radius known", "--estimator=length-equations"),
                "--sigma=given",
            ),
        ),
    ],
    ids=lambda one: one[0] if isinstance(one, tuple) else "",
)
def test_results_are_those_of_the_commands(
    call: Callable[[], Any], command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    found = call()
    assert found.to_dict() == printed(capsys, *command)
    assert main([*command]) in (0, 1)
    assert capsys.readouterr().out == "\n".join([*found.lines(), ""])
    assert len(repr(found)) < 200 and repr(found).startswith(f"<{type(found).__name__} of ")
    frame = found.to_frame()
    assert len(frame) == len(found.rows()) > 0
    html = found.to_html()
    assert html.count("<tr") == len(frame) + 1 and html.count("<table") == html.count("</table>")


def deficient() -> tuple[bp.Experiment, int]:
    """A design that leaves something open and does not say so, and how much its file says."""
    given = bp.load("designs/certified/deficient.yaml")
    assert given.expected_rank_deficiency
    return given.with_(expected_rank_deficiency=None), given.expected_rank_deficiency


def test_a_certificate_goes_with_its_readings(tmp_path: Path) -> None:
    """The same values as the file that `simulate --certificate` writes, as a frame or a file."""
    files = str(tmp_path / "readings.csv"), str(tmp_path / "certificate.csv")
    command = ("simulate", QUICKSTART, "-o", files[0], "--certificate", files[1], "--seed", "5")
    assert main([*command]) == 0
    frame = bp.certificate(QUICKSTART, seed=5)
    written = pd.read_csv(files[1], comment="#", dtype=str)
    assert frame.to_dict("list") == written.to_dict("list")
    own = bp.fit(QUICKSTART, bp.simulate(QUICKSTART, seed=5))
    found = bp.fit(QUICKSTART, bp.simulate(QUICKSTART, seed=5), certificate=frame)
    assert found.to_dict() == bp.fit(QUICKSTART, files[0], certificate=files[1]).to_dict()
    assert found.to_dict()["estimates"] != own.to_dict()["estimates"]


def test_a_fit_says_what_its_command_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = bp.simulate(QUICKSTART)
    readings.loc[3, "z_mm"] += 0.004
    file = tmp_path / "readings.csv"
    readings.iloc[1:].to_csv(file, index=False)
    found = bp.fit(QUICKSTART, file)
    assert main(["fit", QUICKSTART, str(file)]) == 0
    err = capsys.readouterr().err.splitlines()
    assert err == [
        *(f"{file}: {remark}" for remark in found.remarks),
        *(f"warning: {warning}" for warning in found.warnings),
    ]
    assert found.remarks == ("planned but not read (1): z low: ball r1c1 with down",)
    assert len(found.warnings) == 1 and found.warnings[0].startswith("S^2 is ")
    assert repr(found).endswith("; 1 warning>") and not found.complaint
    for text in (str(found), found.to_html(), found.to_markdown().replace("\\", "")):
        assert found.remarks[0] in text and "warning: S^2 is " in text
    told = found.to_dict()
    assert told["planned_but_not_read"] == ["z low: ball r1c1 with down"]
    assert told["warnings"] == list(found.warnings) and told["complaint"] is None


def test_a_fit_that_is_of_no_use_says_why() -> None:
    open_, deficiency = deficient()
    found = bp.fit(open_, bp.simulate(open_))
    assert f"rank deficiency {deficiency}" in found.complaint and found.complaint in str(found)
    assert found.complaint in found.to_html() and found.to_dict()["complaint"] == found.complaint


def fitted() -> Fit:
    return bp.fit(QUICKSTART, bp.simulate(QUICKSTART))


def test_a_measured_part_is_that_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From a fit and a frame, as from files; of scale readings as of centres of tips."""
    fit, (plan, readings, tips) = fitted(), (tmp_path / name for name in ("m.yaml", "r", "t"))
    bp.write_map(fit.to_map(), plan)
    laid = bp.part(PART, fitted=str(plan)).laid
    assert laid is not None
    names = [
        (*key, str(k - rows.start + 1))
        for key, rows in laid.points.rows.items()
        for k in range(rows.start, rows.stop)
    ]
    frame = pd.DataFrame(names, columns=["place", "feature", "point"])
    columns, x = ["x_mm", "y_mm", "z_mm"], 1e3 * laid.points.readings
    # Rounded to a tenth of a micrometre, so that files and frames have the same numbers.
    frame[columns] = (x + np.random.default_rng(1).normal(scale=1e-3, size=x.shape)).round(4)
    frame.to_csv(readings, index=False)
    found = bp.part(PART, fitted=fit, readings=frame)
    told = printed(capsys, "part", PART, f"--map={plan}", f"--readings={readings}")
    assert found.to_dict()["dimensions"] == told["dimensions"]
    frame[columns] = (frame[columns] + 1e3 * laid.machine.offsets[laid.points.probes]).round(4)
    frame.to_csv(tips, index=False)
    arguments = f"--map={plan}", f"--readings={tips}", "--coordinates=tip centres"
    again = printed(capsys, "part", PART, *arguments)
    measured, others = ([one["measured"] for one in of["dimensions"]] for of in (told, again))
    np.testing.assert_allclose(measured, others, rtol=0, atol=1e-12)
    assert max(map(abs, measured)) > 1e-6


WRONG: list[tuple[Callable[[], object], type[Exception], str]] = [
    (lambda: bp.run(5), TypeError, "int is neither an experiment nor the path of a file"),
    (lambda: bp.run({}), TypeError, r"dict is neither .* convert it with experiment()"),
    (lambda: bp.load(None), TypeError, "path=None; give the path of a file"),
    (lambda: bp.load(QUICKSTART, variant=3), TypeError, "variant=3; give the name of a variant"),
    (lambda: bp.experiment([]), TypeError, r"sections=\[\]; give a mapping"),
    (lambda: bp.run(QUICKSTART, trials=2_000_000), ValueError, "give 1000000 at most"),
    (lambda: bp.run(QUICKSTART, trials="ten"), TypeError, "trials='ten'; give a whole number"),
    (lambda: bp.run(QUICKSTART, trials=10.5), TypeError, "trials=10.5; give a whole number"),
    (lambda: bp.run(QUICKSTART, trials=True), TypeError, "trials=True; give a whole number"),
    (lambda: bp.run(QUICKSTART, trials=5, seed=-1), ValueError, "seed=-1; give 0 at least"),
    (lambda: bp.simulate(QUICKSTART, seed=-1), ValueError, "seed=-1; give 0 at least"),
    (lambda: bp.simulate(QUICKSTART, exact="no"), TypeError, "exact='no'; give True or False"),
    (lambda: bp.run(QUICKSTART, until="1%"), TypeError, "until='1%'; give a ratio above 0"),
    (lambda: bp.run(QUICKSTART, report=5), TypeError, "report=5; give a function"),
    (lambda: bp.fit(QUICKSTART, 3), TypeError, "readings=3; give the path of a CSV file, or a"),
    (lambda: bp.fit(QUICKSTART, "a.csv", certificate=3), TypeError, "certificate=3; give the"),
    (lambda: bp.fit(QUICKSTART, "a.csv", estimator="fll"), ValueError, 'did you mean "full"'),
    (
        lambda: bp.fit(QUICKSTART, "a.csv", pairs="corners"),
        ValueError,
        "pairs applies to the estimator distances, cresto or kruth only",
    ),
    (
        lambda: bp.fit(QUICKSTART, "a.csv", offsets=False),
        ValueError,
        "offsets applies to the estimator reversal only",
    ),
    (lambda: bp.compare(QUICKSTART, "full"), ValueError, 'estimator: "full" is unknown'),
    (lambda: bp.compare(QUICKSTART, trials=0), ValueError, "trials=0; give 1 at least"),
    (lambda: bp.map(3), TypeError, r"machine=3; give a fit, what its to_map\(\) gives, or a path"),
    (lambda: bp.map(MACHINE, grid=(2, 2)), ValueError, "give three numbers of points"),
    (lambda: bp.map(MACHINE, points=3), ValueError, "points need a line"),
    (lambda: bp.map(MACHINE, line="y = 3"), ValueError, "y"),
    (lambda: bp.spline(TABLE, knot="none"), TypeError, '"knot" is unknown; did you mean "knots"'),
    (
        lambda: bp.spline(TABLE, y="finish_error", start_slope="flat"),
        ValueError,
        'start_slope: "flat" is not a slope',
    ),
    (lambda: bp.reproduce("np"), ValueError, 'document: "np" is unknown; give npl'),
    (lambda: bp.reproduce("npl", "6.9"), ValueError, 'no experiment "6.9"'),
    (lambda: bp.reach(QUICKSTART, share=2), ValueError, "share=2; give a ratio above 0"),
    (lambda: bp.reach(QUICKSTART, target=3), TypeError, "target=3; give a text with a unit"),
    (lambda: bp.check(QUICKSTART, goals=[3]), TypeError, "goals=3; give texts such as"),
    (lambda: bp.check(QUICKSTART, "U9"), ValueError, '"U9" is not a goal'),
    (lambda: bp.check(QUICKSTART, share=0.9), ValueError, "share applies to the goal lengths"),
    (lambda: bp.plan(QUICKSTART, hours="7 h"), TypeError, "hours='7 h'; give hours above 0"),
    (lambda: bp.plan(QUICKSTART, done=3), TypeError, "done=3; give the path of a CSV file"),
    (lambda: bp.plan(QUICKSTART, hours=-1.0), ValueError, "hours=-1.0; give hours above 0"),
    (lambda: bp.plan(QUICKSTART, "u6"), ValueError, '"u6" is unknown; did you mean "U6"'),
    (lambda: bp.run(QUICKSTART, trials=1), ValueError, "trials=1; give 2 at least"),
    (lambda: bp.run(QUICKSTART, until=float("nan")), ValueError, "until=nan; give a ratio above 0"),
    (lambda: bp.reach(QUICKSTART, unknowns="rows"), ValueError, "known: repeatability"),
    (lambda: bp.budget(QUICKSTART, by=None), ValueError, 'by: "None" is unknown; known: axis'),
    (lambda: bp.sweep(3), TypeError, "experiment=3; give the path of a file"),
    (lambda: bp.part(3, QUICKSTART), TypeError, "file=3; give the path"),
    (lambda: bp.part(PART), ValueError, "give one of a design and a map"),
    (lambda: bp.part(PART, QUICKSTART, "map.yaml"), ValueError, "give one of a design and a map"),
    (lambda: bp.part(PART, QUICKSTART, readings="a.csv"), ValueError, "readings need a map"),
    (lambda: bp.part(PART, 5), TypeError, "int is neither an experiment nor the path of a file"),
    (lambda: bp.part(PART, fitted=5), TypeError, "fitted=5; give a fit"),
    (lambda: bp.part(PART, fitted="a.yaml", readings=5), TypeError, "readings=5; give the path of"),
    (lambda: bp.part(PART, QUICKSTART, draws=-1), ValueError, "draws=-1; give 0 at least"),
    (lambda: bp.part(PART, QUICKSTART, seed=0.5), TypeError, "seed=0.5; give a whole number"),
    (
        lambda: bp.part(PART, QUICKSTART, coordinates="tips"),
        ValueError,
        'coordinates: "tips" is unknown',
    ),
    (lambda: bp.part(PART, REAL[0]), bp.ExperimentError, "variant"),
    (lambda: bp.run(QUICKSTART, seed=5), ValueError, "apply to trials or until only"),
    (lambda: bp.run(QUICKSTART, workers=3), ValueError, "apply to trials or until only"),
    (lambda: bp.check(QUICKSTART, goals=5), TypeError, "goals=5; give texts such as"),
    (lambda: bp.map(MACHINE, grid=(2, 2, 2)).plot(5), TypeError, "path=5; give the path"),
    (lambda: bp.run(QUICKSTART).to_csv(5), TypeError, "path=5; give the path"),
    (
        lambda: bp.reliability(QUICKSTART, power=0),
        ValueError,
        "power=0; give a ratio between 1e-12 and 0.999999",
    ),
    (
        lambda: bp.reliability(QUICKSTART, false_alarm=2),
        ValueError,
        "false_alarm=2; give a ratio between 1e-12 and 0.999999",
    ),
    (lambda: bp.fit(QUICKSTART, "a.csv", estimator="distances", pairs=3), TypeError, "pairs=3"),
    (
        lambda: fitted().correlation(3),
        TypeError,
        r"chosen\[0\]=3; give the name or the kind of an estimate",
    ),
    (lambda: fitted().correct([["a", 0.3, 9]], "down"), ValueError, "give numbers in metres, 3"),
    (lambda: fitted().correct([[0.1, 0.3, 0.2]], 5), TypeError, "probe=5; give the name"),
]


@pytest.mark.parametrize(("call", "kind", "told"), WRONG)
def test_wrong_arguments_are_refused_in_words(
    call: Callable[[], object], kind: type[Exception], told: str
) -> None:
    with pytest.raises(kind, match=told) as caught:
        call()
    assert type(caught.value) in (kind, *kind.__subclasses__())


def test_numbers_of_numpy_are_numbers() -> None:
    one = bp.run(QUICKSTART, trials=np.int64(3), seed=np.int32(2))
    assert one.to_dict() == bp.run(QUICKSTART, trials=3, seed=2).to_dict()


def test_every_function_reports_steps_alike(tmp_path: Path) -> None:
    for call in (
        lambda report: bp.run(QUICKSTART, trials=600, report=report),
        lambda report: bp.reliability(QUICKSTART, report=report),
        lambda report: bp.reach(QUICKSTART, "U6 average 0.2 um", "repeatability", report=report),
        lambda report: bp.compare(QUICKSTART, trials=2, points=5, report=report),
        lambda report: bp.sweep(
            small_sweep(tmp_path, 2), store=tmp_path / "a.sqlite", report=report
        ),
    ):
        told: list[ProgressStep] = []
        call(told.append)
        assert told and all(type(step) is ProgressStep for step in told)
        assert told[-1].done == told[-1].wanted and str(told[-1]).startswith(f"{told[-1].done} of ")


def test_tables_are_written_as_well(tmp_path: Path) -> None:
    found = bp.run(QUICKSTART)
    text = found.to_csv(tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text("utf-8") == text == found.to_csv()
    drawn = bp.map(MACHINE, grid=(2, 2, 2))
    for write in (found.to_csv, drawn.plot):
        ending = "csv" if write == found.to_csv else "svg"
        with pytest.raises(FileNotFoundError, match="there is no folder .*none; make it, or name"):
            write(tmp_path / "none" / f"a.{ending}")


def test_residuals_in_space_are_drawn_as_seen() -> None:
    """The picture shows what an eye to the right of the front and above it sees of each vector."""
    experiment = bp.quickstart()
    readings = bp.simulate(experiment)
    readings.loc[10, "x_mm"] += 0.002
    found = bp.fit(experiment, readings)
    name = found.largest[0].position
    (own,) = (one for one in found.residual_vectors() if one.label == name)
    turn, rise = np.radians([-35.0, 24.0])
    seen = np.array([np.cos(turn), np.sin(turn) * np.sin(rise)])
    k = int(np.hypot(*own.residuals.T).argmax())
    assert own.names[k] == found.largest[0].ball == readings.ball[10]
    away = own.residuals[k] / np.hypot(*own.residuals[k])
    assert abs(away @ seen) / np.hypot(*seen) > 0.9
    (axes, *_) = found.plot().axes
    inside = [line for line in axes.lines if line.get_transform() == axes.transData]
    edges = [line for line in inside if len(line.get_xdata()) == 2]
    assert len(edges) == 12 and not axes.axison


def test_other_results_draw_themselves(tmp_path: Path) -> None:
    for k, plot in enumerate(
        (
            bp.map(MACHINE, grid=(2, 2, 2)).plot,
            bp.map(MACHINE, line="y = 300 mm, z = 200 mm").plot,
        )
    ):
        figure = plot(tmp_path / f"{k}.svg")
        assert figure.get_label() in (tmp_path / f"{k}.svg").read_text("utf-8")


def test_a_choice_from_a_changed_experiment_is_a_file_of_its_own(tmp_path: Path) -> None:
    corners = {"x": ["50 mm"], "y": ["50 mm"]}
    places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": corners}
    pool = {"candidates": [places | {"probes": ["down"]}]}
    changed = bp.quickstart().with_({"machine.repeatability": "0.4 um"}, pool=pool)
    found = bp.plan(changed, positions=7)
    file = tmp_path / "chosen.yaml"
    file.write_text(found.to_yaml(tmp_path), "utf-8")
    assert bp.run(file).quantities == found.prediction.quantities
    assert found.sheet_page().count("<section") == 7


def test_a_notebook_shows_the_first_rows_of_a_long_table() -> None:
    found = bp.reliability(QUICKSTART)
    rows, whole, shown = len(found.rows()), found.to_html(), found._repr_html_()
    assert rows > 60
    # One row of headings.
    assert whole.count("<tr") == rows + 1 and shown.count("<tr") == 61
    assert f"and {rows - 60} more rows" in shown and "more rows" not in whole


def test_the_directory_is_the_face() -> None:
    assert set(dir(bp)) == {*bp.__all__, "__version__"}
