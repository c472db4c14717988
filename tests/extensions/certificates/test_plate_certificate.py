"""Certificates of plates, against dense computations of what they state, and read back."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from html import unescape
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.certificates.certificate_page import certificate_page
from ballplate.extensions.certificates.datum import chosen_datum
from ballplate.presentation.formatting import number
from ballplate.simulator.design.observations.coordinates import CoordinateCalibration
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.inputs.messages import ExperimentError
from numpy.typing import NDArray

from tests.extensions.certificates import wording
from tests.extensions.certificates.campaigns import IN_PLANE, IN_SPACE, PLACES
from tests.observations.test_joint_values import BALLS, constrained, distances, problem, written
from tests.reference import dense

Real = NDArray[np.float64]
NO_ERRORS = {"kind": "zero"}
ABOUT = {"date": "2026-11-02/2026-11-03", "country": "DE", "serial number": "17"}


def uncertain(folder: Path, **more: Any) -> bp.Experiment:
    """A machine that measures a plate whose distances are known to a fraction of a micrometre."""
    item = distances(standard_uncertainty="0.2 um", **more)
    return written(folder, item, true_machine=NO_ERRORS)


def certified(folder: Path, **chosen: Any) -> Any:
    """The certificate of exact readings, with the uncertainties as stated."""
    experiment = uncertain(folder)
    fit = bp.fit(experiment, bp.simulate(experiment, exact=True), "given")
    return fit.certificate(**chosen)


def own_axes(balls: dense.Values, origin: int, on_x: int, in_plane: int) -> dense.Values:
    """Co-ordinates in the axes through three balls, as they are defined; complex ones too."""
    moved = balls - balls[origin]
    x = moved[on_x] / dense.length(moved[on_x])
    y = moved[in_plane] - (moved[in_plane] @ x) * x
    y = y / dense.length(y)
    z = np.cross(x, y)
    return np.stack([moved @ x, moved @ y, moved @ z], axis=1).ravel()


def dense_own_axes(experiment: bp.Experiment, names: tuple[str, str, str]) -> Real:
    """Covariance of the co-ordinates in the axes through three balls, by complex steps."""
    of, three = problem(experiment), [BALLS.index(name) for name in names]
    rows = dense.jacobian(lambda step: own_axes(dense.unpack(of, step)[0], *three), of.parameters)
    spread = dense.linearised(of)
    return np.asarray(rows @ spread.covariance @ rows.T)


@pytest.mark.parametrize("names", [("r1c1", "r1c3", "r3c1"), ("r2c1", "r2c2", "r3c3")])
def test_covariance_is_that_of_the_definition(tmp_path: Path, names: tuple[str, str, str]) -> None:
    found = certified(tmp_path, datum=names)
    expected = dense_own_axes(uncertain(tmp_path), names)
    assert np.abs(found.covariance - expected).max() < 1e-7 * np.abs(expected).max()
    k = [found.names.index(name) for name in names]
    u = found.standard_uncertainties
    assert not u[k[0]].any() and not u[k[1], 1:].any() and u[k[2], 2] == 0.0
    assert (np.delete(u, k, axis=0) > 0.0).all()


def test_axes_of_all_balls_say_the_same_of_every_distance(tmp_path: Path) -> None:
    found, other = (certified(tmp_path, datum=datum) for datum in ("all", ()))
    n, (layout,) = len(found.names), uncertain(tmp_path).layouts.values()
    rows = np.zeros((n * (n - 1) // 2, n, 3))
    for k, (i, j) in enumerate(combinations(range(n), 2)):
        apart = layout.coordinates[i] - layout.coordinates[j]
        rows[k, i], rows[k, j] = apart / np.linalg.norm(apart), -apart / np.linalg.norm(apart)
    flat = rows.reshape(len(rows), -1)
    expected = dense.standard_uncertainties(problem(uncertain(tmp_path)), symbols=["U5"])["U5"]
    for one in (found, other):
        u = np.sqrt(np.einsum("ki,ij,kj->k", flat, one.covariance, flat))
        assert np.abs(u / expected - 1.0).max() < 1e-6
    # No motion of the whole is in it, and no other axes have a smaller sum of variances.
    shift = np.tile(np.eye(3), (n, 1))
    assert np.abs(found.covariance @ shift).max() < 1e-9 * np.abs(found.covariance).max()
    assert np.trace(found.covariance) < np.trace(other.covariance)
    stated = [one.standard_uncertainty for one in other.distances]
    assert np.abs(stated / expected - 1.0).max() < 1e-6


def joint(measured: bp.Experiment, other: bp.Experiment) -> dict[str, Real]:
    """Uncertainties in another experiment that reads the same plate, of both in one computation."""
    parts = [problem(measured), problem(other)]
    counts = [one.parameters for one in parts]
    rows = [
        dense.jacobian(lambda step, of=of: dense.residuals(of, step), of.parameters) for of in parts
    ]
    whole = np.zeros((sum(len(one) for one in rows), sum(counts)))
    whole[: len(rows[0]), : counts[0]], whole[len(rows[0]) :, counts[0] :] = rows
    same = [
        dense.jacobian(lambda step, of=of: own_axes(dense.unpack(of, step)[0], 0, 2, 6), count)
        for of, count in zip(parts, counts, strict=True)
    ]
    tied = np.concatenate([same[0], -same[1]], axis=1)
    tied = tied[np.abs(tied).max(axis=1) > 1e-9]
    spread = constrained(whole, tied)
    found = {}
    for symbol in ("U4", "U6"):
        own = dense.jacobian(dense.quantities(parts[1])[symbol], counts[1])
        found[symbol] = spread.of(np.concatenate([np.zeros((len(own), counts[0])), own], axis=1))
    return found


@pytest.mark.parametrize("ending", [".csv", ".xml"])
@pytest.mark.parametrize("datum", [(), "all"], ids=["corners", "all"])
def test_as_calibration_it_is_worth_both_experiments_together(
    tmp_path: Path, ending: str, datum: Any
) -> None:
    found = certified(tmp_path, datum=datum, about=ABOUT)
    found.save(tmp_path / f"plate{ending}")
    item = {"kind": "coordinates", "values": f"plate{ending}"}
    if ending == ".csv":
        item["covariance"] = "plate-covariance.csv"
    changes = {"machine": {"volume": ["1 m", "1 m", "1 m"], "repeatability": "0.3 um"}}
    other = written(tmp_path, item, **changes)
    expected = joint(uncertain(tmp_path), written(tmp_path, **changes))
    prediction = bp.run(written(tmp_path, item, **changes)).to_dict()["quantities"]
    # U6 does not depend on the machine's frame.
    assert prediction["U6"]["maximum"] == pytest.approx(expected["U6"].max(), rel=1e-6)
    assert prediction["U6"]["average"] == pytest.approx(expected["U6"].mean(), rel=1e-6)
    (calibration,) = other.calibration
    assert isinstance(calibration, CoordinateCalibration)
    assert np.abs(calibration.values - found.coordinates).max() < 1e-15


def test_both_files_hold_all_digits(tmp_path: Path) -> None:
    found = certified(tmp_path, about=ABOUT)
    roots = []
    for ending in (".csv", ".xml"):
        found.save(tmp_path / f"plate{ending}")
        item = {"kind": "coordinates", "values": f"plate{ending}"}
        item |= {"covariance": "plate-covariance.csv"} if ending == ".csv" else {}
        (calibration,) = written(tmp_path, item).calibration
        assert isinstance(calibration, CoordinateCalibration) and calibration.root is not None
        half = calibration.root.drawn(np.eye(len(calibration.root.own)))
        roots.append(half.T @ half)
    for one in roots:
        assert np.abs(one - found.covariance).max() < 1e-9 * np.abs(found.covariance).max()


def test_in_two_dimensions_it_says_what_fit_says() -> None:
    experiment = bp.experiment({**IN_PLANE, "error_model": {"kind": "metric", "scale": "split"}})
    fit = bp.fit(experiment, bp.simulate(experiment, 3))
    (plate,) = fit.plates
    found = fit.certificate()
    assert found.datum == plate.words
    assert np.allclose(found.coordinates, plate.coordinates, rtol=0, atol=1e-15)
    expected = plate.standard_uncertainties
    assert np.allclose(found.standard_uncertainties, expected, rtol=1e-9, atol=1e-18)
    largest = 1e6 * found.coverage_factor * expected.max()
    assert f"U at most {number(largest, 3)} µm" in found.headline()


@cache
def of_simulated(seed: int = 1) -> Any:
    experiment = bp.experiment({**IN_SPACE, "error_model": {"kind": "metric"}})
    return bp.fit(experiment, bp.simulate(experiment, seed))


def test_page_has_every_figure_and_nothing_from_elsewhere(tmp_path: Path) -> None:
    found = of_simulated().certificate(coverage_factor=3.0, about={"laboratory": "A & <B>"})
    found.save(tmp_path / "plate.html")
    page = (tmp_path / "plate.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|src=|<script|@import|url\(", page)
    cells = [unescape(one) for one in re.findall("<t[dh](?: [^>]*)?>(.*?)</t[dh]>", page)]
    rows = [*found.coordinate_table(), *found.distance_table()]
    assert cells == [cell for row in rows for cell in row]
    assert wording.NOT_A_CALIBRATION_CERTIFICATE in page
    assert "reference temperature unknown" in page and "A &amp; &lt;B&gt;" in page
    # Figures are those of the data, U = 3 u.
    row = rows[1 + found.names.index("r3c3")]
    u = found.to_dict()["balls"]["r3c3"]["x"]["standard_uncertainty"]
    assert float(row[4]) == pytest.approx(3e6 * u, rel=5e-3)
    assert float(row[1]) == pytest.approx(1e3 * found.to_dict()["balls"]["r3c3"]["x"]["value"])


def test_the_scale_is_told_to_three_digits(tmp_path: Path) -> None:
    found = certified(tmp_path)
    for value in (1.23456e-6, 0.0712345e-6, 12.3456e-6):
        words = replace(found, scale_uncertainty=value).facts["scale"]
        assert f" {float(f'{1e6 * value:.3g}'):g} µm/m" in words


def test_a_page_with_some_of_the_distances_says_so() -> None:
    found = of_simulated().certificate()
    # Of the eight balls of a square with three on each side.
    assert len(found.distances) == 28 and "Some of the" not in certificate_page(found)
    some = replace(found, distances=found.distances[:27])
    assert wording.SOME_OF_THE_DISTANCES in certificate_page(some)


def test_few_degrees_of_freedom_and_probability() -> None:
    found = of_simulated().certificate(coverage_factor=2.0)
    stated = replace(found, degrees_of_freedom=np.inf)
    assert stated.coverage_probability == pytest.approx(0.9545, abs=1e-4)
    assert 0.94 < found.coverage_probability < stated.coverage_probability
    few = replace(found, degrees_of_freedom=4.0)
    # Student's distribution, GUM table G.2: 2.87 gives 95.45 % of 4 degrees of freedom.
    assert replace(few, coverage_factor=2.87).coverage_probability == pytest.approx(
        0.9545, abs=3e-4
    )
    assert few.coverage_probability < 0.9


def test_reference_temperature() -> None:
    influence = {
        "kind": "temperature",
        "reference": "21 degC",
        "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "1 um/m/K"},
        "artefact_temperature": {"value": "20.4 degC", "standard_uncertainty": "0.05 degC"},
    }
    sections = {**IN_SPACE, "error_model": {"kind": "metric"}, "influences": [influence]}
    experiment = bp.experiment(sections)
    found = bp.fit(experiment, bp.simulate(experiment)).certificate(about=ABOUT)
    assert found.reference_temperature == 21.0 and wording.LENGTHS_ARE_THOSE in found.temperature
    assert of_simulated().certificate().reference_temperature is None
    # What is known of another plate, or of anything else, says nothing of this one.
    other = {**IN_SPACE["artefacts"]["plate"], "size": "300 mm"}
    positions = [
        *IN_SPACE["positions"],
        {**IN_SPACE["positions"][0], "name": "other", "artefact": "other"},
    ]
    positions[: len(PLACES)] = [{**one, "artefact": "plate"} for one in positions[: len(PLACES)]]
    of_two = {
        **sections,
        "artefacts": {**IN_SPACE["artefacts"], "other": other},
        "positions": positions,
        "calibration": [{**IN_SPACE["calibration"][0], "artefact": "plate"}],
    }
    for first, wanted in ((None, None), ("other", None), ("plate", 21.0)):
        heads = {"kind": "re-indexing", "standard_uncertainty": "0.1 um"}
        stated = [heads, *([] if first is None else [{**influence, "artefact": first}])]
        two = bp.experiment({**of_two, "influences": stated})
        told = bp.fit(two, bp.simulate(two)).certificate("plate")
        assert told.reference_temperature == wanted


UNCALIBRATED = {
    "scale unknown": {**IN_SPACE, "error_model": {"kind": "metric"}, "calibration": []},
    "scales of the machine": {
        **IN_PLANE,
        "error_model": {"kind": "metric", "scale": "split"},
        "calibration": [],
    },
}


@pytest.mark.parametrize("name", UNCALIBRATED)
def test_nothing_is_certified_without_a_calibration(name: str) -> None:
    sections: dict[str, Any] = dict(UNCALIBRATED[name])
    if name == "scale unknown":
        # One probe, as exact offsets of several would tell the scale.
        sections["positions"] = [one | {"probes": ["down"]} for one in sections["positions"][:3]]
        sections["probes"] = {"down": sections["probes"]["down"]}
    experiment = bp.experiment(sections)
    fit = bp.fit(experiment, bp.simulate(experiment))
    with pytest.raises(ExperimentError, match="calibra"):
        fit.certificate()


def test_a_ball_that_nothing_ties_to_the_others_is_left_out_and_told() -> None:
    experiment = bp.experiment({**IN_SPACE, "error_model": {"kind": "metric"}})
    readings = bp.simulate(experiment)
    # It is read in one position, of which nothing else is read.
    some = readings[(readings.ball == "r3c2") == (readings.position == "P1")]
    found = bp.fit(experiment, some).certificate()
    assert found.left_out == ("r3c2",) and "r3c2" not in found.names
    assert wording.NO_VALUE_IS_STATED in "\n".join(found.lines())
    assert np.isfinite(found.covariance).all()
    with pytest.raises(ExperimentError, match=wording.CO_ORDINATES_OF_UNDETERMINED_IN_THESE):
        bp.fit(experiment, some).certificate(datum=("r1c1", "r1c3", "r3c2"))


def test_exact_readings_do_not_make_exact_plates() -> None:
    experiment = bp.experiment({**IN_SPACE, "error_model": {"kind": "metric"}})
    fit = bp.fit(experiment, bp.simulate(experiment, exact=True), "estimated")
    with pytest.raises(ValueError, match=wording.NO_ESTIMATE_OF_THEIR_UNCERTAINTY):
        fit.certificate()


def test_more_balls_than_a_covariance_may_have_are_refused() -> None:
    many = {"plate": {"kind": "square", "balls": 200, "size": "380 mm"}}
    # One position, which is enough to ask.
    sections = {**IN_SPACE, "artefacts": many, "positions": IN_SPACE["positions"][:1]}
    experiment = bp.experiment({**sections, "error_model": {"kind": "metric"}})
    fit = replace(of_simulated(), experiment=experiment)
    with pytest.raises(ExperimentError, match=wording.BALLS_ARE_TOO_MANY_AT_MOST):
        fit.certificate()


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "in line": ({"datum": ("r1c1", "r1c2", "r1c3")}, "in line"),
    "two balls": ({"datum": ("r1c1", "r1c2")}, "name 3 different balls"),
    "one twice": ({"datum": ("r1c1", "r1c1", "r3c3")}, "name 3 different balls"),
    "unknown ball": ({"datum": ("r1c1", "r1c2", "r9c9")}, 'no ball "r9c9"'),
    "unknown plate": ({"plate": "plat"}, 'did you mean "plate"'),
    "unknown key": ({"about": {"datum": "x"}}, 'the certificate has no entry "datum"'),
    "factor": ({"coverage_factor": 0.0}, "coverage factor above 0"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_told(name: str) -> None:
    chosen, text = WRONG[name]
    with pytest.raises(ValueError, match=text):
        of_simulated().certificate(**chosen)


@pytest.mark.parametrize(
    ("about", "text"),
    [
        ({"country": "DE"}, "when the plate was measured"),
        ({"country": "DE", "date": "2026-13-01"}, "is no date"),
        ({"country": "DE", "date": "2026-11-03/2026-11-02"}, "ends before it begins"),
        ({"date": "2026-11-02"}, "country"),
        ({"date": "2026-11-02", "country": "Germany"}, "country"),
    ],
)
def test_a_digital_certificate_needs_what_it_states(about: dict[str, str], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        of_simulated().certificate(about=about).texts("plate.xml")
    with pytest.raises(ValueError, match="ends in .html"):
        of_simulated().certificate(about=about).texts("plate.pdf")


def test_names_of_balls_are_told_apart(tmp_path: Path) -> None:
    # Blanks separate the labels of a digital certificate; XML and spreadsheets have their own signs.
    names = ["a 1", "b<&>", "=c", 'd"', "e5"]
    places = {"a 1": (0, 0), "b<&>": (400, 0), "=c": (0, 400), 'd"': (400, 400), "e5": (200, 100)}
    balls = {name: [f"{x} mm", f"{y} mm"] for name, (x, y) in places.items()}
    plate = {"kind": "balls", "coordinates": balls}
    item = {"kind": "distances", "pairs": [["a 1", "b<&>"], ["=c", 'd"']]}
    sections = {
        **IN_SPACE,
        "artefacts": {"plate": plate},
        "error_model": {"kind": "metric"},
        "calibration": [{**item, "standard_uncertainty": "0.3 um"}],
    }
    experiment = bp.experiment(sections)
    found = bp.fit(experiment, bp.simulate(experiment)).certificate(about=ABOUT)
    assert list(found.names) == names
    for ending in (".xml", ".csv", ".html"):
        found.save(tmp_path / f"plate{ending}")
    for more in (
        {"values": "plate.xml"},
        {"values": "plate.csv", "covariance": "plate-covariance.csv"},
    ):
        again = bp.experiment(
            {**sections, "calibration": [{"kind": "coordinates", **more}]}, tmp_path
        )
        (calibration,) = again.calibration
        assert isinstance(calibration, CoordinateCalibration)
        assert np.abs(calibration.values - found.coordinates).max() < 1e-15


def test_datum_of_odd_layouts() -> None:
    def layout(*places: tuple[float, float, float]) -> BallLayout:
        return BallLayout(tuple("abcde"[: len(places)]), np.array(places))

    line = layout((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.4, 0.0, 0.0))
    assert chosen_datum(line, 3, ()).plane is None
    for wrong in (layout((0.0, 0.0, 0.0)), layout((0.0, 0.0, 0.0), (0.0, 0.0, 0.5))):
        with pytest.raises(ValueError):
            chosen_datum(wrong, 3, ())


# The order of elements below one another that the schema, version 3.1.2, asks for; those that are
# not here may be left out.
ORDER = {
    "digitalCalibrationCertificate": ["administrativeData", "measurementResults"],
    "coreData": [
        "countryCodeISO3166_1",
        "usedLangCodeISO639_1",
        "mandatoryLangCodeISO639_1",
        "uniqueIdentifier",
        "beginPerformanceDate",
        "endPerformanceDate",
        "performanceLocation",
    ],
    "item": ["name", "manufacturer", "identifications"],
    "contact": ["name", "eMail", "location"],
    "customer": ["name", "eMail", "location"],
    "measurementResult": ["name", "description", "results"],
    "realListXMLList": [
        "labelXMLList",
        "valueXMLList",
        "unitXMLList",
        "expandedUncXMLList",
        "ellipsoidalRegionXMLList",
    ],
    "ellipsoidalRegionXMLList": ["covarianceMatrix", "coverageFactor", "coverageProbability"],
}


def test_digital_certificate_has_the_order_of_the_schema() -> None:
    found = of_simulated().certificate(about=ABOUT)
    (text,) = found.texts("plate.xml").values()
    root = ElementTree.fromstring(text)
    assert root.attrib["schemaVersion"] == "3.1.2"
    seen = set()
    for element in root.iter():
        name = element.tag.partition("}")[2]
        if name in ORDER:
            seen.add(name)
            children = [one.tag.partition("}")[2] for one in element]
            assert children == [one for one in ORDER[name] if one in children]
            # Distances have no covariance of their own.
            optional = {"ellipsoidalRegionXMLList"}
            assert set(ORDER[name]) - set(children) <= optional
    assert seen == set(ORDER)
    space = "{https://ptb.de/si}"
    columns = root.findall(f".//{space}column")
    assert len(columns) == found.covariance.shape[0] == len(list(columns[0]))
    numbers = [[float(one.text) for one in c.iter(f"{space}value")] for c in columns]  # type: ignore[arg-type]
    assert np.abs(1e-6 * np.array(numbers) - found.covariance).max() == pytest.approx(0, abs=1e-28)


def test_lay_out_is_the_one_that_was_read(tmp_path: Path) -> None:
    # The dense reference and the certificate are about the same design.
    design = lay_out(uncertain(tmp_path))
    assert [design.balls.names[k] for k in range(9)] == BALLS
