"""What `check` says of bars and gauges that leave scales or squareness open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from ballplate.results.checked_designs import check, predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.repair import wording

FOLDER = Path("designs/hurt_foss")
NO_LENGTH = (
    "no length is known (bar: length): the overall scale of the machine is undetermined until"
    " one is calibrated"
)
SHIPPED = {
    ("bar-bell", "length known"): (),
    ("bar-bell", "length unknown"): (NO_LENGTH,),
    ("bar-bell", "flat"): ("every bar lies parallel to the xy plane",),
    ("bar-bell", "one axis"): ("every bar lies along x",),
    ("bar-bell", "axes only"): ("the bars' directions are too few or too similar",),
    ("bryan-gauge", "radius known"): (),
    ("bryan-gauge", "radius unknown"): (NO_LENGTH.replace("bar: length", "gauge: radius"),),
    ("bryan-gauge", "two pivots"): (),
    ("bryan-gauge", "one height"): (
        "every location of the ball lies in a plane parallel to the xy plane",
    ),
    ("bryan-gauge", "one plane"): (
        "every location of the ball lies in a plane parallel to the xz plane",
    ),
}


def test_all_shipped_designs_are_told_of() -> None:
    files = sorted(FOLDER.glob("*.yaml"))
    assert {(path.stem, one.name) for path in files for one in load(path)} == set(SHIPPED)


@pytest.mark.parametrize(("file", "variant"), SHIPPED)
def test_shipped_designs(file: str, variant: str) -> None:
    experiment = {one.name: one for one in load(FOLDER / f"{file}.yaml")}[variant]
    verdict = check(experiment).verdict
    assert verdict.reasons == SHIPPED[file, variant]
    assert experiment.expected_rank_deficiency == verdict.deficiency


def with_bars(
    tmp_path: Path, directions: list[tuple[float, float]], **sections: object
) -> Experiment:
    """The shipped machine with bars at azimuths and elevations in degrees."""
    content = yaml.safe_load((FOLDER / "bar-bell.yaml").read_text(encoding="utf-8"))
    del content["variants"]
    content["machine"]["volume"] = {axis: ["-1 m", "1 m"] for axis in "xyz"}
    content["positions"] = [
        {
            "name": str(k),
            "pose": {
                "origin": ["0 m", "0 m", "0 m"],
                "rotation": ["0 deg", f"{-up} deg", f"{round_} deg"],
            },
        }
        for k, (round_, up) in enumerate(directions)
    ]
    path = tmp_path / "bars.yaml"
    path.write_text(yaml.safe_dump(content | sections), encoding="utf-8")
    (experiment,) = load(path)
    return experiment


def reason(tmp_path: Path, directions: list[tuple[float, float]], **sections: object) -> str:
    verdict = check(with_bars(tmp_path, directions, **sections)).verdict
    assert verdict.deficiency and len(verdict.reasons) == 1
    return verdict.reasons[0]


def test_bars_in_an_oblique_plane(tmp_path: Path) -> None:
    told = reason(tmp_path, [(45.0, up) for up in (0, 30, 60, 90, 120, 150)])
    assert told.startswith(wording.EVERY_BAR_LIES_PARALLEL_TO_THE_PLANE)


def test_other_models_are_told_the_same(tmp_path: Path) -> None:
    """Of the many errors that bars in a plane leave to a kinematic machine, the reason for scales
    and squareness.
    """
    directions = [(30.0 * k, 0.0) for k in range(6)]
    model = {"kind": "kinematic", "position_coefficients": 2, "rotation_coefficients": 1}
    told = reason(tmp_path, directions, error_model=model, true_machine={"kind": "zero"})
    assert told == SHIPPED["bar-bell", "flat"][0]


def test_planes_and_axes_are_told_without_a_length_or_without_scales(tmp_path: Path) -> None:
    upright = check(
        with_bars(tmp_path, [(0.0, 30.0 * k) for k in range(6)], calibration=[])
    ).verdict
    assert upright.deficiency == 4 and upright.reasons[0] == NO_LENGTH
    assert upright.reasons[1].startswith(wording.EVERY_BAR_LIES_PARALLEL_TO_THE_XZ)
    squareness = {
        "error_model": {"kind": "metric", "scale": "none"},
        "true_machine": {"kind": "zero"},
    }
    assert (
        reason(tmp_path, [(30.0 * k, 0.0) for k in range(6)], **squareness)
        == wording.EVERY_BAR_LIES_PARALLEL
    )


def test_bars_of_one_plane_at_two_angles(tmp_path: Path) -> None:
    told = reason(tmp_path, [(0.0, 45.0), (0.0, 135.0)])
    assert told == wording.EVERY_BAR_LIES_PARALLEL_TO_THE_XZ


def gauges(tmp_path: Path, few: int, many: int) -> str:
    """The reason of two gauges on pivots of their own, read in few and in many places at one
    height.
    """
    content = yaml.safe_load((FOLDER / "bryan-gauge.yaml").read_text(encoding="utf-8"))
    del content["variants"]
    places = {
        name: [[f"{k * 360 // count} deg", "30 deg"] for k in range(count)]
        for name, count in (("few", few), ("many", many))
    }
    content["artefacts"] = {
        name: {"kind": "bryan_gauge", "radius": "300 mm", "directions": own}
        for name, own in places.items()
    }
    content["positions"] = [
        {"name": name, "artefact": name, "pose": {"origin": ["500 mm", "400 mm", "100 mm"]}}
        for name in places
    ]
    content["calibration"] = [
        {"kind": "radius", "artefact": name, "standard_uncertainty": "0.5 um"} for name in places
    ]
    (tmp_path / "gauges.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    (told,) = check(load(tmp_path / "gauges.yaml")[0]).verdict.reasons
    return told


@pytest.mark.parametrize(("few", "many"), [(3, 3), (3, 4), (4, 3), (2, 9), (5, 5)])
def test_any_three_places_lie_in_a_plane_and_more_do_not(
    tmp_path: Path, few: int, many: int
) -> None:
    told = gauges(tmp_path, few, many)
    assert told.startswith(
        "the locations of the ball are too few or too similar"
        if max(few, many) == 3
        else "every location of the ball lies in a plane parallel to the xy plane"
    )


def test_nothing_is_said_where_plates_tell_what_bars_do_not(tmp_path: Path) -> None:
    """A plate with calibrated co-ordinates upright in the volume beside bars in the xy plane."""
    content = {
        "artefacts": {
            "bar": {"kind": "two_spheres", "length": "500 mm", "role": "length_standard"},
            "plate": {"kind": "grid", "balls": [3, 3], "size": ["400 mm", "400 mm"]},
        },
        "positions": [
            *(
                {"name": f"bar {k}", "artefact": "bar", "pose": {"origin": 3 * ["0 m"]}}
                for k in range(2)
            ),
            *(
                {
                    "name": f"{plane} plane",
                    "artefact": "plate",
                    "plane": plane,
                    "level": "100 mm",
                    "corner": {axis: "0 mm" for axis in "xyz" if axis != plane},
                }
                for plane in "xyz"
            ),
        ],
        "calibration": [
            {
                "kind": "distances",
                "artefact": "bar",
                "pairs": "all",
                "standard_uncertainty": "1 um",
            },
            {"kind": "coordinates", "artefact": "plate", "standard_uncertainty": "1 um"},
        ],
    }
    verdict = check(with_bars(tmp_path, [], **content)).verdict
    assert verdict.deficiency == 0 and verdict.reasons == ()
    # What a plate of unknown shape leaves open is not for want of bars.
    content["calibration"] = content["calibration"][:1]
    verdict = check(with_bars(tmp_path, [], **content)).verdict
    assert verdict.deficiency == 1 and verdict.reasons == ()


def test_the_overall_scale_with_an_unknown_length_is_what_the_plan_leaves_open() -> None:
    unknown = {one.name: one for one in load(FOLDER / "bryan-gauge.yaml")}["radius unknown"]
    found = predict(unknown)
    (direction,) = found.verdict.null
    assert [part.name for part in direction.functions] == ["scale x", "scale y", "scale z"]
    np.testing.assert_allclose(
        [part.peak for part in direction.functions], direction.functions[0].peak, rtol=1e-9
    )
    (radius,) = direction.lengths
    assert radius.name == "gauge: radius"
    assert radius.change / 0.3 == pytest.approx(direction.functions[0].peak, rel=1e-9)
    assert (
        found.quantities["U3 ratios"].undetermined == 3
        and found.quantities["U3 angles"].undetermined == 0
    )
