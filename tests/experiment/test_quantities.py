"""Quantities: exact values, messages, round trips."""

import json
import math
import re
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from ballplate.simulator.inputs.quantities import (
    LARGEST,
    SMALLEST,
    LengthFunction,
    QuantityError,
    exact_number,
    parse_angle,
    parse_length,
    parse_length_function,
    parse_positive_length,
    parse_ratio,
)
from ballplate.simulator.inputs.quantity_types import Length, Ratio, TargetFunction
from ballplate.simulator.inputs.units import LENGTH_UNITS, format_length, typed_length
from hypothesis import given, settings, strategies as st
from pydantic import TypeAdapter

from tests.experiment import wording


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("750 mm", 0.75),
        ("0.2 um", 2e-7),
        ("0.2 µm", 2e-7),
        ("0.2 μm", 2e-7),
        ("1 m", 1.0),
        ("12.5 in", 0.3175),
        ("3 nm", 3e-9),
        ("-.5e1mm", -0.005),
        (" 7.  cm ", 0.07),
    ],
)
def test_lengths_are_the_nearest_floats(text: str, metres: float) -> None:
    assert parse_length(text) == metres


def test_angles_and_ratios() -> None:
    assert parse_angle("90 deg") == math.pi / 2
    assert parse_angle("180 deg") == math.pi
    assert parse_angle("5 urad") == 5e-6
    assert parse_angle("1e-6 rad") == 1e-6
    assert parse_angle("2 arcsec") == pytest.approx(2 * math.pi / 648000, rel=1e-15)
    assert parse_angle("60 arcmin") == parse_angle("1 deg")
    assert parse_ratio("5 ppm") == 5e-6
    assert parse_ratio("0.1 %") == 1e-3
    assert parse_ratio("1.2 um/m") == 1.2e-6


@given(
    st.decimals(allow_nan=False, allow_infinity=False, min_value=-(10**9), max_value=10**9),
    st.sampled_from(sorted(LENGTH_UNITS)),
)
def test_any_length_is_rounded_once(number: object, unit: str) -> None:
    if re.search(r"[eE][+-]?\d{4,}", str(number)):
        return
    metres = Fraction(str(number)) * LENGTH_UNITS[unit]
    if metres and not SMALLEST <= abs(metres) <= LARGEST:
        with pytest.raises(QuantityError, match=wording.BEYOND_WHAT_CAN_BE_COMPUTED):
            parse_length(f"{number} {unit}")
        return
    assert parse_length(f"{number} {unit}") == float(metres)


@given(st.floats(-1e3, 1e3).filter(lambda length: length == 0 or abs(length) > 1e-17))
def test_formatted_lengths_are_read_again(length: float) -> None:
    for text in (format_length(length), typed_length(length)):
        assert parse_length(text) == pytest.approx(length, rel=1e-8, abs=1e-18)
    assert typed_length(length).isascii()


@given(st.text(max_size=30))
@settings(max_examples=40)
def test_no_text_breaks_the_parsers(text: str) -> None:
    for parse in (
        parse_length,
        parse_angle,
        parse_ratio,
        parse_positive_length,
        parse_length_function,
    ):
        try:
            parse(text)
        except QuantityError as error:
            assert str(error)


def test_length_function_at_lengths() -> None:
    function = parse_length_function("0.5 um + L/1e+6")
    np.testing.assert_allclose(function.at([[0.0], [2.0]]), [[0.5e-6], [2.5e-6]], rtol=1e-15)
    assert parse_length_function("1e+1 um + L / 1000000").constant == 1e-5
    assert parse_length_function("0.3 um") == LengthFunction(3e-7, 0.0)
    assert parse_length_function("0 um + L/20000").at(1.0) == 5e-5


@given(st.integers(1, 10**7), st.integers(1, 10**5), st.sampled_from([0.0, 0.3, 2.0]))
def test_the_forms_of_a_growing_length_are_the_same(
    nanometres: int, divisor: int, length: float
) -> None:
    # A um + L/K with L in mm and the result in um grows by 1000/K um for each metre.
    by_hand = 1e-9 * nanometres + 1e-3 / divisor * length
    constant = f"{nanometres / 1000}"
    if divisor <= 10:
        with pytest.raises(QuantityError, match=wording.PER_METRE_OF_LENGTH):
            parse_length_function(f"{constant} um + {1e3 / divisor!r} um/m")
        return
    slope = repr(1e3 / divisor)
    for text in (
        f"{constant} um + {slope} um/m",
        f"{constant} µm+{slope} ppm",
        f"{constant} um + L/{divisor}e3",
    ):
        assert float(parse_length_function(text).at(length)) == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("divisor", ["400", "11", "10000", "5e3"])
def test_a_data_sheet_is_not_read_in_metres(divisor: str) -> None:
    with pytest.raises(QuantityError) as caught:
        parse_length_function(f"0.9 um + L/{divisor}")
    told = str(caught.value)
    assert f"grows by {1e6 / float(divisor):.4g} um/m, since L is in metres" in told
    # What is advised is what the data sheet means: at one metre 1000 / divisor micrometres more
    # than at none.
    advised = parse_length_function(told.split('write "')[1].removesuffix('"'))
    assert float(advised.at(1.0) - advised.at(0.0)) == pytest.approx(1e-6 * 1000 / float(divisor))
    assert advised.constant == 9e-7


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("750", '"750" has no unit; write for example "750 mm" or "750 um"'),
        pytest.param(10**309, f'"{10**309}" has no unit; write for example "1', id="no float"),
        (1e-6, '"1e-06" has no unit; write "1e-06 m" if it is in m'),
        (
            "0.4 um (k=2)",
            '"0.4 um (k=2)" is an expanded uncertainty; write the standard one, "0.2 um"',
        ),
        (
            "1 µm ( k = 2.5 )",
            '"1 µm ( k = 2.5 )" is an expanded uncertainty; write the standard one, "0.4 um"',
        ),
        ("750 mn", '"750 mn" has the unknown unit "mn"; did you mean "m'),
        (
            "1 parsecs",
            '"1 parsecs" has the unknown unit "parsecs"; known: m, dm, cm, mm, um, nm, pm, in',
        ),
        ("5 deg", '"5 deg" is an angle; a length is expected, for example "750 mm"'),
        ("0,2 mm", '"0,2 mm" has a decimal comma; write a decimal point, for example "0.2 mm"'),
        ("long", '"long" is not a length; write for example "750 mm"'),
        (float("nan"), 'nan is not a finite length; write for example "750 mm"'),
        ("1e999 mm", '"1e999" is beyond what can be computed with; write a number of usual size'),
        (True, 'expected a length, found true; write for example "750 mm"'),
        (None, 'expected a length, found nothing; write for example "750 mm"'),
    ],
)
def test_messages_of_lengths(value: object, message: str) -> None:
    with pytest.raises(QuantityError) as caught:
        parse_length(value)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("0 um", '"0 um" must be above zero; give a small one, such as 1 nm'),
        ("-1 um", '"-1 um" must be above zero; write for example "0.2 um"'),
        (
            "L/1000",
            (
                '"L/1000" is not a length that grows with L; write for example "0.5 um +'
                ' L/1000000", with L in metres, or "0.9 um + 2.5 um/m"'
            ),
        ),
        (
            "-1 um + L/1000",
            '"-1 um + L/1000" has a negative part; write for example "0.5 um + L/1000000"',
        ),
        (
            "1 um + -2 ppm",
            '"1 um + -2 ppm" has a negative part; write for example "0.5 um + L/1000000"',
        ),
        ("1 um + 100 ppm", '"1 um + 100 ppm" grows by 100 um/m; give less than 100 um/m'),
        (
            "1 um + L/1e19",
            '"1 um + L/1e19" grows too slowly; leave out the growth, or give 1e-18 m/m or more',
        ),
        ("1 um + 2 mm", '"2 mm" is a length; a ratio is expected, for example "5 ppm"'),
        ("0 um + 0 ppm", '"0 um + 0 ppm" must be above zero; give a small one, such as 1 nm'),
        (
            "1 um + L/0",
            (
                '"1 um + L/0" has a negative part or divides by zero; write for example "0.5 um +'
                ' L/1000000"'
            ),
        ),
        ("0.5 + L/1000", '"0.5" has no unit; write for example "0.5 mm" or "0.5 um"'),
    ],
)
def test_messages_of_length_functions(value: object, message: str) -> None:
    with pytest.raises(QuantityError) as caught:
        parse_length_function(value)
    assert str(caught.value) == message


def test_ratio_needs_a_unit() -> None:
    with pytest.raises(QuantityError, match=wording.HAS_NO_UNIT_WRITE):
        parse_ratio("5e-6")


def test_exact_number_refuses_other_texts() -> None:
    assert exact_number("500.0003") == Fraction(5000003, 10000)
    for text in ("", "1_000", "0x10", "inf", "1 2", "9" * 1000):
        with pytest.raises(QuantityError):
            exact_number(text)


@pytest.mark.parametrize("quantity", [Length, Ratio, TargetFunction])
def test_json_schema_agrees_with_the_parser(quantity: Any) -> None:
    schema = TypeAdapter(quantity).json_schema()
    assert json.dumps(schema) and schema["type"] == "string"
    for example in schema["examples"]:
        assert re.search(schema["pattern"], example)
        TypeAdapter(quantity).validate_python(example)
    assert not re.search(schema["pattern"], "750")
