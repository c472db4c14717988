"""Certificates in files: tables, covariances and DCCs as laboratories have them, and wrong ones."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.observations.coordinates import CoordinateCalibration
from ballplate.simulator.design.observations.distances import DistanceCalibration
from ballplate.simulator.experiment.named_files import named_by
from ballplate.simulator.inputs.messages import ExperimentError

from tests.observations import wording
from tests.observations.test_joint_values import BALLS, Real, covariance_file, written
from tests.reference import certificates as dcc
from tests.reference.small_quickstart import small_sections

PAIRS = [("r1c1", "r1c3"), ("r3c1", "r3c3"), ("r1c1", "r3c1"), ("r1c3", "r3c3")]
MM = ["600.0004", "599.9998", "600.0011", "600.0007"]
# Expanded, k = 2, in micrometres.
U = ["0.4", "0.5", "0.3", "0.7"]
VALUES = np.array([float(one) for one in MM]) / 1e3
STANDARD = np.array([float(one) for one in U]) / 2e6
MATRIX = [
    ["0.0400", "0.0100", "0.0050", "0.0050"],
    ["0.0100", "0.0625", "0.0050", "0.0050"],
    ["0.0050", "0.0050", "0.0225", "0.0100"],
    ["0.0050", "0.0050", "0.0100", "0.1225"],
]
COVARIANCE = np.array([[float(one) for one in row] for row in MATRIX]) * 1e-12
SQUARED = "\\micro\\metre\\tothe{2}"
LABELS = ["-".join(pair) for pair in PAIRS]
IN_MM = [f"{float(one) / 1e3:.7f}" for one in U]


def item(**more: Any) -> dict[str, Any]:
    return {"kind": "distances", "pairs": [list(pair) for pair in PAIRS], **more}


def found(folder: Path, text: str, **more: Any) -> DistanceCalibration:
    (folder / "c.xml").write_text(text, encoding="utf-8")
    (one,) = written(folder, item(values="c.xml", **more)).calibration
    assert isinstance(one, DistanceCalibration)
    return one


def covariance_of(one: DistanceCalibration | CoordinateCalibration) -> Real:
    """What a root says of the covariance."""
    assert one.root is not None
    root = one.root.drawn(np.eye(len(one.root.own)))
    return np.asarray(root.T @ root)


def singles(uncertain: Any, version: str = "3.1.2") -> str:
    """A quantity for each distance."""
    each = zip(PAIRS, MM, IN_MM, strict=True)
    data = "".join(
        dcc.quantity(dcc.real("", mm, "\\milli\\metre", uncertain(u)), f"Distance {a} to {b}")
        for (a, b), mm, u in each
    )
    return dcc.certificate(dcc.result(data), version)


def of_list(**more: str) -> str:
    content = "".join(
        dcc.real_in_list(name, value, dcc.expanded(u))
        for name, value, u in zip(LABELS, MM, IN_MM, strict=True)
    )
    return dcc.certificate(dcc.result(dcc.quantity(dcc.listed(content, "\\milli\\metre", **more))))


METRES = [f"{float(one) / 1e3:.7f}" for one in MM]
IN_METRES = [f"{float(one) / 1e6:.10f}" for one in U]
# Beside a list without labels, in a list of quantities, texts in the same order.
UNLABELLED = dcc.quantity(dcc.spaced([], MM, "\\milli\\metre", IN_MM), "distance")
CHARACTERS = "<dcc:charsXMLList>{names}</dcc:charsXMLList>"
BESIDE = f"<dcc:list>{dcc.quantity(CHARACTERS, 'balls')}{UNLABELLED}</dcc:list>"
TWO_COLUMNS = "".join(
    dcc.quantity(CHARACTERS.format(names=" ".join(pair[k] for pair in PAIRS)), name)
    for k, name in enumerate(("from", "to"))
)
RELATIVE = (
    "<dcc:relativeUncertainty><dcc:relativeUncertaintyXmlList><si:valueXMLList>3.3e-7"
    "</si:valueXMLList><si:unitXMLList>\\one</si:unitXMLList></dcc:relativeUncertaintyXmlList>"
    "</dcc:relativeUncertainty>"
)
RELATIVE_ALONE = dcc.quantity(dcc.spaced(LABELS, MM, "\\milli\\metre", []) + RELATIVE)
SPELLINGS = {
    "texts beside a list": dcc.certificate(dcc.result(BESIDE.format(names=" ".join(LABELS)))),
    "two texts beside a list": dcc.certificate(
        dcc.result(f"<dcc:list>{TWO_COLUMNS}{UNLABELLED}</dcc:list>")
    ),
    "single reals": singles(dcc.expanded),
    "single reals, D-SI 2.2": singles(dcc.expanded_later),
    "single reals, standard": singles(lambda u: dcc.standard_later(f"{float(u) / 2:.8f}")),
    "single reals, interval": singles(lambda u: dcc.interval("600", f"{float(u) / 2:.8f}")),
    "a list": of_list(),
    "a list with a covariance": of_list(covariance=dcc.region(MATRIX, SQUARED)),
    "spaced": dcc.certificate(
        dcc.result(dcc.quantity(dcc.spaced(LABELS, MM, "\\milli\\metre", IN_MM)))
    ),
    "spaced, metres": dcc.certificate(
        dcc.result(dcc.quantity(dcc.spaced(LABELS, METRES, "\\metre", IN_METRES)))
    ),
    "spaced, D-SI 2.2": dcc.certificate(
        dcc.result(dcc.quantity(dcc.spaced_later(LABELS, MM, "\\milli\\metre", IN_MM)))
    ),
    "spaced with a covariance": dcc.certificate(
        dcc.result(
            dcc.quantity(
                dcc.spaced(
                    LABELS,
                    MM,
                    "\\milli\\metre",
                    [],
                    dcc.region(MATRIX, SQUARED, "ellipsoidalRegionXMLList"),
                )
            )
        )
    ),
    "spaced with a covariance, D-SI 2.2": dcc.certificate(
        dcc.result(
            dcc.quantity(
                dcc.spaced(LABELS, MM, "\\milli\\metre", IN_MM, dcc.region_later(MATRIX, SQUARED))
            )
        )
    ),
}


@pytest.mark.parametrize("name", SPELLINGS)
def test_a_certificate_is_read_in_every_spelling(tmp_path: Path, name: str) -> None:
    one = found(tmp_path, SPELLINGS[name])
    np.testing.assert_allclose(one.values, VALUES, rtol=1e-15)
    np.testing.assert_allclose(one.standard_uncertainties, STANDARD, rtol=1e-12)
    assert (one.root is not None) == ("covariance" in name)
    if one.root is not None:
        np.testing.assert_allclose(covariance_of(one), COVARIANCE, rtol=0, atol=1e-26)


def test_co_ordinates_are_lists_by_axis(tmp_path: Path) -> None:
    places = np.array([[300.0 * (k // 3), 300.0 * (k % 3), 0.0] for k in range(9)])
    moved = places + 1e-3 * np.sin(np.arange(27.0)).reshape(9, 3)
    axes = "".join(
        dcc.quantity(
            dcc.spaced(BALLS, [f"{v:.7f}" for v in moved[:, k]], "\\milli\\metre", ["0.0003"]),
            f"coordinate {axis}",
        )
        for k, axis in enumerate("XYZ")
    )
    (tmp_path / "c.xml").write_text(
        dcc.certificate(dcc.result(f"<dcc:list>{axes}</dcc:list>")), encoding="utf-8"
    )
    (one,) = written(tmp_path, {"kind": "coordinates", "values": "c.xml"}).calibration
    assert isinstance(one, CoordinateCalibration)
    np.testing.assert_allclose(one.values, np.round(moved, 7) / 1e3, rtol=0, atol=1e-15)
    np.testing.assert_allclose(one.standard_uncertainties, 1.5e-7, rtol=1e-12)
    (plane,) = written(
        tmp_path, {"kind": "coordinates", "values": "c.xml", "axes": ["x", "y"], "balls": "corners"}
    ).calibration
    assert plane.values.shape == (4, 2)  # type: ignore[attr-defined]


def test_an_uncertainty_that_is_stated_does_without_a_relative_one(tmp_path: Path) -> None:
    text = dcc.certificate(dcc.result(RELATIVE_ALONE))
    one = found(tmp_path, text, standard_uncertainty="0.3 um")
    np.testing.assert_allclose(one.values, VALUES, rtol=1e-15)
    np.testing.assert_allclose(one.standard_uncertainties, 3e-7, rtol=1e-12)


def test_it_is_told_what_was_taken(tmp_path: Path) -> None:
    data = dcc.quantity(dcc.spaced(LABELS, MM, "\\milli\\metre", IN_MM))
    other = dcc.quantity(dcc.real("flatness", "0.0004", "\\milli\\metre"))
    text = dcc.certificate(
        dcc.result(other, "Flatness") + dcc.result(data, "Sides", "s1"), temperature="22.5"
    )
    (tmp_path / "c.xml").write_text(text, encoding="utf-8")
    experiment = written(tmp_path, item(values="c.xml"))
    (note,) = experiment.notes
    assert 'DCC 3.1.2, result "Sides" (id s1): 4 values, k = 2; temperature 22.5 °C' in note
    assert any("states a temperature of 22.5 °C" in doubt for doubt in experiment.doubts)
    assert not any(
        "temperature" in one for one in written(tmp_path, item(standard_uncertainty="1 um")).doubts
    )


def test_a_result_is_chosen_by_name_id_or_kind(tmp_path: Path) -> None:
    results = "".join(
        dcc.result(
            dcc.quantity(
                dcc.spaced(LABELS, [f"{float(v) + k:.4f}" for v in MM], "\\milli\\metre", IN_MM)
            ),
            name,
            identifier,
            kinds,
        )
        for k, (name, identifier, kinds) in enumerate(
            [("Before", "b", "x_before"), ("After", "a", "x_after x_final")]
        )
    )
    text = dcc.certificate(results)
    for name, offset in [("Before", 0), ("b", 0), ("After", 1), ("a", 1), ("x_final", 1)]:
        one = found(tmp_path, text, result=name)
        np.testing.assert_allclose(one.values, VALUES + 1e-3 * offset, rtol=1e-14)
    words = refusal(tmp_path, text)
    assert wording.RESULTS_HAVE_THESE_VALUES in words
    assert wording.SAY_WHICH_WITH_RESULT in words
    assert wording.NO_RESULT_IS_CALLED in refusal(tmp_path, text, result="Later")


NOMINAL, ERRORS_UM = ["600"] * 4, [f"{1e3 * (float(v) - 600):.4f}" for v in MM]
# What a list of the good practice's form has: reference type, values, unit, uncertainties in it.
NAMED = dcc.quantity(CHARACTERS.format(names=" ".join(LABELS)))
MILLI, MICRO = "\\milli\\metre", "\\micro\\metre"
NOMINALS = ("basic_nominalValue", NOMINAL, MILLI, [])
MEASURED = ("basic_measuredValue", MM, MILLI, IN_MM)
UNSURE = ("basic_measuredValue", MM, MILLI, [])
ERRORS = ("basic_measurementError", ERRORS_UM, MICRO, U)
REFERENCES = ("basic_referenceValue", NOMINAL, MILLI, IN_MM)
RELATIVE_ERRORS = ("basic_measurementError", ["1e-6"] * 4, "\\one", [])
GRADES = ("basic_conformity", ["1"] * 4, "\\one", [])

Side = tuple[str, list[str], str, list[str]]


def side_by_side(*sides: Side) -> str:
    """Quantities of a list, told apart by their reference types; texts beside them name values."""
    data = "".join(
        dcc.quantity(dcc.spaced([], values, unit, u)).replace(
            "<dcc:quantity>", f'<dcc:quantity refType="{kind}">'
        )
        for kind, values, unit, u in sides
    )
    return dcc.certificate(dcc.result(f"<dcc:list>{NAMED}{data}</dcc:list>"))


SIDES_TOLD = {
    "nominal, measured, error": ((NOMINALS, MEASURED, ERRORS), "(measured), k = 2"),
    "in another order": ((GRADES, ERRORS, MEASURED, NOMINALS), "(measured), k = 2"),
    "the error's uncertainty": (
        (NOMINALS, UNSURE, ERRORS),
        "(measured, with uncertainties of errors), k = 2",
    ),
    "nominal and error": ((NOMINALS, ERRORS), "(nominal plus error), k = 2"),
    "reference and error": ((REFERENCES, ERRORS), "(reference plus error), k = 2"),
    "two lists": ((("x_first", MM, MILLI, IN_MM), GRADES), "4 values, k = 2"),
}


@pytest.mark.parametrize("name", SIDES_TOLD)
def test_of_quantities_side_by_side_the_measured_ones_are_read(tmp_path: Path, name: str) -> None:
    sides, expected = SIDES_TOLD[name]
    one = found(tmp_path, side_by_side(*sides))
    np.testing.assert_allclose(one.values, VALUES, rtol=0, atol=1e-12)
    np.testing.assert_allclose(one.standard_uncertainties, STANDARD, rtol=1e-9)
    (note,) = written(tmp_path, item(values="c.xml")).notes
    assert expected in note


def test_the_covariance_of_errors_is_that_of_lengths(tmp_path: Path) -> None:
    region = dcc.region(MATRIX, SQUARED, "ellipsoidalRegionXMLList")
    text = side_by_side(NOMINALS, ERRORS)
    at = text.rindex("</si:realListXMLList>")
    one = found(tmp_path, text[:at] + region + text[at:])
    np.testing.assert_allclose(covariance_of(one), COVARIANCE, rtol=0, atol=1e-26)


def test_lengths_with_each_quantity_by_itself(tmp_path: Path) -> None:
    """A list for each distance, which names it, in place of one list of each quantity."""
    data = "".join(
        f"<dcc:list>{dcc.named(name)}"
        + "".join(
            dcc.quantity(content).replace("<dcc:quantity>", f'<dcc:quantity refType="{kind}">')
            for kind, content in (
                ("basic_nominalValue", dcc.real("", "600", MILLI)),
                ("basic_measuredValue", dcc.real("", mm, MILLI, dcc.expanded(u))),
            )
        )
        + "</dcc:list>"
        for name, mm, u in zip(LABELS, MM, IN_MM, strict=True)
    )
    one = found(tmp_path, dcc.certificate(dcc.result(data)))
    np.testing.assert_allclose(one.values, VALUES, rtol=1e-15)


def test_nominal_values_never_stand_in_for_unread_ones(tmp_path: Path) -> None:
    """A measured value or an error in a unit that is none of length."""
    odd = ("basic_measuredValue", MM, "\\kelvin", IN_MM)
    assert "is no length" in problems_of(tmp_path, side_by_side(NOMINALS, odd))
    assert "is no length" in problems_of(tmp_path, side_by_side(NOMINALS, RELATIVE_ERRORS))
    wrong = ("basic_measuredValue", ["six", *MM[1:]], MILLI, IN_MM)
    assert '"six" is not a number' in problems_of(tmp_path, side_by_side(NOMINALS, wrong))


@pytest.mark.parametrize("side", ["basic_measuredValue", "basic_measurementError"])
def test_a_list_with_fewer_or_more_values_than_labels_is_refused(tmp_path: Path, side: str) -> None:
    for values in (MM[:1], [*MM, "1"]):
        text = side_by_side(NOMINALS, (side, values, MILLI, []))
        assert "has no measured value, only a nominal one" in problems_of(tmp_path, text)
        # Who asks for nominal values gets them.
        chosen = {"quantity": "basic_nominalValue", "standard_uncertainty": "1 um"}
        np.testing.assert_array_equal(found(tmp_path, text, **chosen).values, 0.6)


def test_nominal_values_alone_are_taken_only_when_chosen(tmp_path: Path) -> None:
    with_uncertainties = ("basic_nominalValue", NOMINAL, MILLI, IN_MM)
    text = side_by_side(with_uncertainties)
    for words in (refusal(tmp_path, text), problems_of(tmp_path, side_by_side(NOMINALS))):
        assert 'only a nominal one; write quantity: "basic_nominalValue" if' in words
    one = found(tmp_path, text, quantity="basic_nominalValue")
    np.testing.assert_array_equal(one.values, 0.6)


def problems_of(folder: Path, text: str) -> str:
    with pytest.raises(ExperimentError) as caught:
        found(folder, text, standard_uncertainty="1 um")
    return str(caught.value)


def test_other_quantities_are_chosen_by_a_key(tmp_path: Path) -> None:
    other = ("x_before", [f"{float(v) + 1:.4f}" for v in MM], MILLI, IN_MM)
    text = side_by_side(("x_after", MM, MILLI, IN_MM), other, REFERENCES)
    words = refusal(tmp_path, text)
    assert "r1c1–r1c3 has several values, in lines " in words.splitlines()[0]
    assert '"x_after", "x_before", "basic_referenceValue"' in words
    for name, offset in (("x_after", 0.0), ("x_before", 1e-3)):
        one = found(tmp_path, text, quantity=name)
        np.testing.assert_allclose(one.values, VALUES + offset, rtol=1e-14)
    nominal = found(tmp_path, side_by_side(NOMINALS, MEASURED), quantity="basic_nominalValue",
                    standard_uncertainty="1 um")  # fmt: skip
    np.testing.assert_array_equal(nominal.values, 0.6)
    # Nominal, reference and error: of which of the two it is the error is not stated.
    several = side_by_side(NOMINALS, REFERENCES, ERRORS)
    assert "choose those of one quantity" in refusal(tmp_path, several)
    wrong = refusal(tmp_path, text, quantity="x_later")
    assert 'no quantity is called "x_later"' in wrong and '"x_after", "x_before"' in wrong
    with pytest.raises(ExperimentError, match="applies only to values in a DCC"):
        written(tmp_path, item(standard_uncertainty="1 um", quantity="x_after"))


def refusal(folder: Path, text: str, **more: Any) -> str:
    """The one message about a certificate."""
    with pytest.raises(ExperimentError) as caught:
        found(folder, text, **more)
    (message,) = caught.value.messages
    return str(message)


SPACED = SPELLINGS["spaced"]
WRONG_CERTIFICATES = {
    "k missing": (
        SPELLINGS["a list"].replace("<si:coverageFactor>2</si:coverageFactor>", "", 1),
        "has an expanded uncertainty without a coverage factor",
    ),
    "k is zero": (
        SPELLINGS["a list"].replace("coverageFactor>2<", "coverageFactor>0<", 1),
        'r1c1–r1c3 has the coverage factor "0"; it must be above 0',
    ),
    "a unit of time": (
        SPACED.replace("\\milli\\metre", "\\milli\\second"),
        'r1c1–r1c3 is no length: the unit "\\milli\\second" is not a unit of a length',
    ),
    "other balls": (
        SPACED.replace("r1c1", "a").replace("r3c3", "b"),
        "no result has values for these balls",
    ),
    "one missing": (
        SPACED.replace("r1c1-r1c3", "r1c1-r1c2"),
        'result "Lengths" has no value of r1c1–r1c3',
    ),
    "no labels": (
        re.sub("<si:labelXMLList>.*?</si:labelXMLList>", "", SPACED),
        "its values have no names",
    ),
    "a pair twice": (
        SPACED.replace("r3c1-r3c3 ", "r1c3-r1c1 ")
        .replace("r1c1-r3c1", "r3c3-r3c1 r1c1-r3c1")
        .replace(MM[3], f"{MM[3]} {MM[3]}")
        .replace(IN_MM[3], f"{IN_MM[3]} {IN_MM[3]}"),
        "r1c1–r1c3 has several values, in lines",
    ),
    "another version": (
        SPACED.replace('"3.1.2"', '"1.8.5"'),
        'schemaVersion is "1.8.5"; versions 2.x',
    ),
    "no certificate": ("<a/>", "its first element is <a>"),
    "a document type": (
        SPACED.replace("?>", '?><!DOCTYPE a [<!ENTITY b "c">]>', 1),
        "a document type (<!DOCTYPE …>) is not read",
    ),
    "an asymmetric covariance": (
        SPELLINGS["a list with a covariance"].replace("0.0100", "0.0300", 1),
        'not symmetric: "value 1" with "value 2" is 0.01 µm², vice versa 0.03 µm²',
    ),
    "a covariance of expanded uncertainties": (
        of_list(
            covariance=dcc.region([[f"{4 * float(v):.4f}" for v in row] for row in MATRIX], SQUARED)
        ),
        "is one of the two expanded?",
    ),
    "a covariance too small": (
        of_list(covariance=dcc.region([row[:3] for row in MATRIX[:3]], SQUARED)),
        "for 4 values; it must be square",
    ),
    "an uncertainty missing": (
        SPELLINGS["a list"].replace(dcc.expanded(IN_MM[1]), "", 1),
        "states no uncertainty of r3c1–r3c3, and of others it does",
    ),
    "a unit to a high power": (
        SPACED.replace("\\milli\\metre", "\\metre\\tothe{99999999}"),
        "is not a unit of a length",
    ),
    "a relative uncertainty": (
        dcc.certificate(dcc.result(RELATIVE_ALONE)),
        'add "standard_uncertainty", or values with their uncertainties',
    ),
    "a covariance in lengths": (
        of_list(covariance=dcc.region(MATRIX, "\\micro\\metre")),
        "is not a unit of the square of a length",
    ),
}


@pytest.mark.parametrize("name", WRONG_CERTIFICATES)
def test_a_wrong_certificate_is_refused(tmp_path: Path, name: str) -> None:
    text, words = WRONG_CERTIFICATES[name]
    (tmp_path / "c.xml").write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        written(tmp_path, item(values="c.xml"))
    assert words in str(caught.value)
    assert re.search(r"(c\.xml|e\.yaml):\d+:\d+: ", str(caught.value))


def table(*rows: str) -> str:
    return "\n".join(rows) + "\n"


HEADER = "ball_1,ball_2,distance_mm"
LINES = [f"{a},{b},{mm}" for (a, b), mm in zip(PAIRS, MM, strict=True)]


def with_columns(header: str, cells: list[str]) -> str:
    return table(f"{HEADER},{header}", *(f"{a},{b}" for a, b in zip(LINES, cells, strict=True)))


@pytest.mark.parametrize(
    ("text", "more"),
    [
        (with_columns("standard_uncertainty_nm", [f"{5e8 * float(u) / 1e6:g}" for u in U]), {}),
        (with_columns("expanded_uncertainty_um,k", [f"{u},2" for u in U]), {}),
        (with_columns("expanded_uncertainty_um,k", [f"{1.5 * float(u)!r},3" for u in U]), {}),
        (with_columns("expanded_uncertainty_um", U), {"coverage_factor": 2}),
        (table(HEADER, *LINES), {"covariance": "m.csv"}),
    ],
)
def test_a_table_has_uncertainties_of_each_value(
    tmp_path: Path, text: str, more: dict[str, Any]
) -> None:
    (tmp_path / "v.csv").write_text(text, encoding="utf-8")
    covariance_file(
        tmp_path / "m.csv", [" ".join(p) for p in PAIRS], 1e12 * COVARIANCE, "covariance_um2"
    )
    (one,) = written(tmp_path, item(values="v.csv", **more)).calibration
    assert isinstance(one, DistanceCalibration)
    np.testing.assert_allclose(one.values, VALUES, rtol=1e-15)
    np.testing.assert_allclose(one.standard_uncertainties, STANDARD, rtol=1e-12)


EXPANDED = with_columns("expanded_uncertainty_um,k", [f"{u},2" for u in U])
WRONG_TABLES: dict[str, tuple[str, dict[str, Any], str]] = {
    "no k": (
        with_columns("expanded_uncertainty_um", U),
        {},
        "has no coverage factor; add a column k",
    ),
    "unclear": (
        EXPANDED.replace("expanded_uncertainty_um", "U_um"),
        {},
        '"U_um" does not say which uncertainty it is',
    ),
    "k of a standard one": (
        EXPANDED.replace("expanded_uncertainty", "standard_uncertainty"),
        {},
        "has a coverage factor k and no expanded uncertainty",
    ),
    "negative": (EXPANDED.replace("0.4,2", "-0.4,2"), {}, "an uncertainty is below zero"),
    "both": (
        EXPANDED,
        {"standard_uncertainty": "0.2 um"},
        "v.csv states uncertainties; remove one",
    ),
    "none": (table(HEADER, *LINES), {}, 'missing; add "standard_uncertainty"'),
    "a factor of nothing": (EXPANDED, {"coverage_factor": 0}, "above 0"),
    "two kinds": (
        with_columns(
            "expanded_uncertainty_um,standard_uncertainty_um,k", [f"{u},{u},2" for u in U]
        ),
        {},
        "states an uncertainty twice",
    ),
}


@pytest.mark.parametrize("name", WRONG_TABLES)
def test_a_wrong_table_is_refused(tmp_path: Path, name: str) -> None:
    text, more, words = WRONG_TABLES[name]
    (tmp_path / "v.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        written(tmp_path, item(values="v.csv", **more))
    assert words in str(caught.value)


MATRIX_FILE = table(
    ",".join(["covariance_um2", *(" ".join(p) for p in PAIRS)]),
    *(",".join([" ".join(p), *row]) for p, row in zip(PAIRS, MATRIX, strict=True)),
)
WRONG_MATRICES = {
    "asymmetric": (
        MATRIX_FILE.replace("0.0100", "0.0300", 1),
        'm.csv:2:1: .*not symmetric: "r1c1 r1c3" with "r3c1 r3c3" is 0.03 µm², vice versa'
        " 0.01 µm²;",
    ),
    "indefinite": (
        MATRIX_FILE.replace("0.0050", "0.0299"),
        "is no covariance: its correlations have a negative eigenvalue",
    ),
    "beyond one": (MATRIX_FILE.replace("0.0100", "0.9000"), "are correlated by more than 1"),
    "a negative variance": (
        MATRIX_FILE.replace("0.0400", "-0.0400"),
        'the variance of "r1c1 r1c3" is negative',
    ),
    "no unit": (
        MATRIX_FILE.replace("covariance_um2", "covariance"),
        'the first cell is "covariance"',
    ),
    "a unit of length": (MATRIX_FILE.replace("um2", "um"), "has no unit of area"),
    "other values": (
        MATRIX_FILE.replace("r1c1 r1c3", "r1c1 r1c2"),
        '"r1c1 r1c2" names no value of this item',
    ),
    "another order": (
        MATRIX_FILE.replace("r1c1 r1c3", "r9", 1),
        "name rows and columns in the same order",
    ),
    "not square": (table(*MATRIX_FILE.splitlines()[:-1]), "4 columns and 3 rows"),
    "a correlation with nothing": (
        table(
            ",".join(["correlation", *(" ".join(p) for p in PAIRS)]),
            *(
                ",".join([" ".join(p), *map(str, row)])
                for p, row in zip(PAIRS, np.eye(4).tolist(), strict=True)
            ),
        ),
        'a correlation needs "standard_uncertainty"',
    ),
}


@pytest.mark.parametrize("name", WRONG_MATRICES)
def test_a_wrong_covariance_is_refused(tmp_path: Path, name: str) -> None:
    text, words = WRONG_MATRICES[name]
    (tmp_path / "m.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        written(tmp_path, item(covariance="m.csv"))
    assert re.search(words if "asymmetric" in name else re.escape(words), str(caught.value))


def test_a_length_standard_has_no_covariance(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text(MATRIX_FILE, encoding="utf-8")
    plate = {
        "kind": "grid",
        "balls": [3, 3],
        "size": ["600 mm", "600 mm"],
        "role": "length_standard",
    }
    with pytest.raises(ExperimentError, match=wording.LENGTHS_ARE_READ_AS_INDEPENDENT):
        written(tmp_path, item(covariance="m.csv"), artefacts={"plate": plate})


def test_exact_lengths_of_a_standard_are_the_limit_of_small_ones(tmp_path: Path) -> None:
    plate = {"kind": "grid", "balls": [3, 3], "size": ["600 mm", "600 mm"]}
    figures = []
    for u in ("0 um", "0.00001 um"):
        for how in ("included", "ignored"):
            experiment = standards(tmp_path, plate, u, how)
            figures.append(bp.run(experiment).to_dict()["quantities"]["U6"]["average"])
    assert figures[:2] == pytest.approx(figures[2:], rel=1e-6)


def standards(folder: Path, plate: dict[str, Any], uncertainty: str, repeatability: str) -> Any:
    """A plate, and a bar that is read in one place."""
    found = small_sections()
    bar = {"kind": "two_spheres", "length": "500 mm", "role": "length_standard"}
    places = [one | {"artefact": "plate"} for one in found["positions"]]
    pose = {"origin": ["300 mm", "300 mm", "300 mm"], "rotation": ["0 deg", "0 deg", "30 deg"]}
    places.append({"name": "bar", "artefact": "bar", "pose": pose, "probes": ["down"]})
    lengths = {"kind": "distances", "pairs": "all", "standard_uncertainty": "1 um"}
    calibration = [
        {**lengths, "artefact": "plate", "pairs": "corner sides"},
        {**lengths, "artefact": "bar", "repeatability": repeatability}
        | {"standard_uncertainty": uncertainty},
    ]
    return written(folder, *calibration, artefacts={"plate": plate, "bar": bar}, positions=places)


def test_a_sweep_takes_all_files_of_a_certificate_along(tmp_path: Path) -> None:
    (tmp_path / "v.csv").write_text(table(HEADER, *LINES), encoding="utf-8")
    (tmp_path / "m.csv").write_text(MATRIX_FILE, encoding="utf-8")
    (tmp_path / "c.xml").write_text(SPACED, encoding="utf-8")
    written(tmp_path, item(values="v.csv", covariance="m.csv"), item(values="c.xml"))
    files = {path.name for path in named_by(tmp_path / "e.yaml")}
    assert files == {"v.csv", "m.csv", "c.xml"}
