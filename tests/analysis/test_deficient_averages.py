"""A design that determines only some distances has no average of them, in any output."""

from __future__ import annotations

import io
import math

import ballplate as bp
import pandas
from ballplate.results import planned_uncertainty

# The first three points are in a plane that two of the positions determine, the last is not.
POINTS = [[250, 250, 300], [500, 250, 300], [750, 750, 300], [900, 100, 900]]
# Positions that are read, which leave something undetermined.
PART = (0, 1, 2)


def sections(read: tuple[int, ...]) -> dict[str, object]:
    points = [[f"{x} mm" for x in point] for point in POINTS]
    off = {f"positions[{k}].enabled": False for k in range(6) if k not in read}
    return {"evaluation.points": points, "target_uncertainty": "5 um", **off}


def design(read: tuple[int, ...]) -> bp.Experiment:
    return bp.quickstart().with_(sections(read))


def test_numbers_of_a_deficient_design() -> None:
    prediction = bp.run(design(PART))
    for symbol, quantity in prediction.quantities.items():
        if quantity.undetermined:
            assert math.isnan(quantity.average) and math.isnan(quantity.maximum), symbol
            assert not quantity.largest and not quantity.places and quantity.pair is None
        else:
            assert quantity.average > 0.0 and quantity.largest
    lengths = prediction["U6"]
    assert (lengths.undetermined, lengths.count) == (3, 6)
    assert planned_uncertainty(design(PART)).quantities["U6"] == lengths
    assert repr(prediction).endswith("U6 undetermined (3 of 6)>")
    row = prediction.to_frame().set_index("symbol").loc["U6"]
    assert math.isnan(row["average"]) and (row["undetermined"], row["count"]) == (3, 6)
    table = pandas.read_csv(io.StringIO(prediction.to_csv())).set_index("symbol")
    assert math.isnan(table.loc["U6", "average"]) and table.loc["U6", "undetermined"] == 3
    data = prediction.to_dict()["quantities"]["U6"]
    assert data["average"] is None and data["maximum"] is None and data["undetermined"] == 3
    (line,) = [line for line in prediction.lines() if line.startswith("U6 ")]
    assert line.split()[-5:] == ["-", "µm", "6", "(3", "undetermined)"]
    assert prediction.assumptions is None


def test_numbers_of_its_check() -> None:
    checked = bp.check(design(PART))
    frame = checked.to_frame()
    assert math.isnan(frame["U6 average, µm"][0]) and frame["U6 undetermined"][0] == 3
    assert any(line.endswith("; 3 of 6 distances undetermined") for line in checked.lines())
    assert checked.to_dict()["lengths"]["average"] is None


def test_reach_of_a_deficient_design() -> None:
    found = bp.reach(design(PART), "U6 average 5 um", ["repeatability"])
    assert not found.present.is_met and found.present.undetermined == 3
