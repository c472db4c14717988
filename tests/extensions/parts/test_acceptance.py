"""Predicted and evaluated acceptance tests, against tests simulated one by one and closed forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.parts.acceptance_interface import acceptance
from ballplate.extensions.parts.acceptance_prediction import (
    by_design,
    by_map,
    drawn_errors,
    errors_root,
)
from ballplate.extensions.parts.acceptance_rules import Agreed, judged, length_plan
from ballplate.simulator.design import Volume
from ballplate.simulator.inputs import ExperimentError, LengthFunction
from numpy.typing import NDArray
from scipy.special import erf
from scipy.stats import studentized_range

from tests.reference import dense
from tests.reference.small_quickstart import small_quickstart

Real = NDArray[np.float64]
E0_SETS, E150_SETS = 35, 10


def corners_and_lengths() -> list[tuple[str, Real, Real]]:
    """Kinds of errors and both ends of all lengths in the cube of 1 m, written out by hand."""
    lines = [
        ("E0", [0, 0, 0], [1, 1, 1]),
        ("E0", [1, 0, 0], [0, 1, 1]),
        ("E0", [0, 1, 0], [1, 0, 1]),
        ("E0", [0, 0, 1], [1, 1, 0]),
        ("E0", [0, 0.5, 0.5], [1, 0.5, 0.5]),
        ("E0", [0.5, 0, 0.5], [0.5, 1, 0.5]),
        ("E0", [0.5, 0.5, 0], [0.5, 0.5, 1]),
        ("E150", [0.5, 0, 0], [0.5, 1, 1]),
        ("E150", [0.5, 1, 0], [0.5, 0, 1]),
    ]
    return [
        (kind, np.array(start, float), start + k * 0.132 * (np.array(end) - start))
        for kind, start, end in lines
        for k in range(1, 6)
    ]


class Machines:
    """Machines corrected by maps of a campaign: parameters that are wrong as the covariance of a
    dense Jacobian says, and lengths by the error function itself.
    """

    def __init__(self, experiment: bp.Experiment, coefficients: int) -> None:
        self.problem = dense.planned(bp.lay_out(experiment), coefficients, 2)
        spread = dense.spread(
            dense.jacobian(
                lambda step: dense.residuals(self.problem, step), self.problem.parameters
            )
        )
        self.root = spread.root[-len(self.problem.a) :]
        names = self.problem.design.probes.names
        lengths = corners_and_lengths()
        self.starts, self.ends = (np.array([each[k] for each in lengths]) for k in (1, 2))
        used = [names.index("down" if each[0] == "E0" else "right") for each in lengths]
        self.offsets = self.problem.design.probes.offsets[used]

    def errors(self, generator: np.random.Generator) -> Real:
        """Indicated less true lengths (m,) of a machine."""
        a = self.root @ generator.standard_normal(self.root.shape[1])
        first, last = (
            dense.corrected(self.problem, x, a, self.offsets) for x in (self.starts, self.ends)
        )
        indicated = np.linalg.norm(self.ends - self.starts, axis=1)
        return np.asarray(indicated - np.linalg.norm(last - first, axis=1))


def passes_one_by_one(
    machine: Real, lengths: Real, agreed: dict[str, float], rng: np.random.Generator
) -> bool:
    """One test as a laboratory does it."""
    gauge = rng.normal()
    outside = {"E0": 0, "E150": 0}
    for k, length in enumerate(lengths):
        kind = "E0" if k < E0_SETS else "E150"
        limit = agreed["A"] + agreed["B"] * length
        steady = machine[k] + gauge * (agreed["gauge"] + agreed["per_metre"] * length)

        def measure(steady: float = steady) -> list[float]:
            ends = rng.normal(0.0, agreed["point"], (3, 2))
            return [float(steady + second - first) for first, second in ends]

        three = measure()
        if kind == "E0" and max(three) - min(three) > agreed["mpl"]:
            return False
        wrong = sum(abs(error) > limit for error in three)
        if wrong > 1 or wrong and any(abs(error) > limit for error in measure()):
            return False
        outside[kind] += wrong
    return outside["E0"] <= 5 and outside["E150"] <= 2


@pytest.mark.parametrize(
    ("noise", "plate", "coefficients"),
    [(1.6, 600, 3), (0.8, 750, 3), (0.55, 700, 4), (0.2, 650, 5), (0.2, 750, 4)],
)
def test_chances_are_frequencies_of_tests_done_one_by_one(
    noise: float, plate: int, coefficients: int
) -> None:
    """Machines from hopeless to safe, of which repeatability, plates and errors differ."""
    experiment = small_quickstart(
        machine={"volume": 3 * ["1 m"], "repeatability": f"{noise} um"},
        artefacts={"plate": {"kind": "grid", "balls": [3, 3], "size": 2 * [f"{plate} mm"]}},
        error_model={
            "kind": "kinematic",
            "position_coefficients": coefficients,
            "rotation_coefficients": 2,
        },
    )
    machines = Machines(experiment, coefficients)
    parts = {"gauge": 0.1e-6, "per_metre": 0.2e-6, "point": 0.15e-6}
    agreed = {"A": 0.9e-6, "B": 0.54e-6, "mpl": 1.1e-6, **parts}
    found = acceptance(
        design=experiment,
        mpe="0.9 um + 0.54 um/m",
        mpl="1.1 um",
        probe="right",
        gauge="0.1 um + 0.2 um/m",
        point_repeatability="0.15 um",
    )
    chance, rng, count = found.chances["simple acceptance"], np.random.default_rng(8), 2000
    lengths = np.linalg.norm(machines.ends - machines.starts, axis=1)
    np.testing.assert_allclose(found.sets.lengths, lengths, rtol=1e-12)
    done = [passes_one_by_one(machines.errors(rng), lengths, agreed, rng) for _ in range(count)]
    share = (sum(done) + 1) / (count + 2)
    deviation = np.sqrt(share * (1 - share) * (1 / count + 1 / 20_000))
    assert abs(chance - np.mean(done)) <= 3.0 * deviation


def test_one_length_without_an_error_of_the_map() -> None:
    """Three errors within the limits; or two, and then three again."""
    agreed = Agreed(LengthFunction(1e-6), point=0.5e-6)
    errors = drawn_errors(np.zeros((1, 1)), np.ones(1), agreed, 100_000, 3)
    passes, _, _ = judged(errors, np.array([1e-6]), np.array(["E0"]))
    # The deviation of a length of two touched points is that of one times the root of two.
    within = erf(1.0 / (0.5 * np.sqrt(2.0)) / np.sqrt(2.0))
    expected = within**3 + 3.0 * within**2 * (1.0 - within) * within**3
    assert abs(passes.mean() - expected) < 3.0 * np.sqrt(expected * (1 - expected) / 100_000)
    # The range of three in units of that deviation, and limits that no error reaches.
    mpl, narrow = 2.0 * 0.5e-6 * np.sqrt(2.0), float(studentized_range.cdf(2.0, 3, np.inf))
    share = judged(errors, np.ones(1), np.array(["E0"]), mpl)[0].mean()
    assert abs(share - narrow) < 3.0 * np.sqrt(narrow * (1 - narrow) / 100_000)


def test_one_gauge_acts_on_all_lengths_together() -> None:
    """With nothing but the gauge, 35 lengths pass as often as one."""
    agreed = Agreed(LengthFunction(1e-6), gauge=LengthFunction(1e-6))
    errors = drawn_errors(np.zeros((35, 1)), np.ones(35), agreed, 100_000, 3)
    share = judged(errors, np.full(35, 1e-6), np.array(35 * ["E0"]))[0].mean()
    assert abs(share - erf(np.sqrt(0.5))) < 3.0 * np.sqrt(0.22 / 100_000)


@pytest.mark.parametrize(
    ("sets", "passes"),
    [
        (5 * [([0.9, -1.1, 0.2], [1.0, -1.0, 0.9])], True),
        (6 * [([0.9, -1.1, 0.2], [1.0, -1.0, 0.9])], False),
        ([([0.9, -1.1, 0.2], [0.0, 1.1, 0.0])], False),
        ([([1.1, -1.1, 0.2], [0.0, 0.0, 0.0])], False),
        ([([-1.0, 1.0, 1.0], [9.0, 9.0, 9.0])], True),
        ([([-1.0, 1.01, 0.0], [0.0, 0.0, 0.0])], False),
    ],
    ids=["five again", "six again", "again outside", "two outside", "none outside", "range"],
)
def test_what_is_measured_again_by_hand(sets: list[Any], passes: bool) -> None:
    errors = np.zeros((1, 35, 2, 3))
    errors[0, : len(sets)] = sets
    # An MPE of 1 µm, and an MPL of 2 µm but for the last but one.
    found = judged(1e-6 * errors, np.full(35, 1e-6), np.array(35 * ["E0"]), 2.0005e-6)
    assert found[0].tolist() == [passes]


def test_plan_in_a_plane_and_across_y() -> None:
    plane, ends = length_plan(Volume(np.zeros(2), np.array([0.8, 0.6])))
    assert plane.kinds.tolist() == 20 * ["E0"]
    assert ends[:, 9].tolist() == [[0.8, 0.0], pytest.approx([0.8 - 0.528, 0.396])]
    assert plane.lengths[[4, 9, 14, 19]] == pytest.approx([0.66, 0.66, 0.528, 0.396])
    space, ends = length_plan(Volume(-np.ones(3), np.ones(3)), 1)
    assert space.kinds.tolist() == 35 * ["E0"] + 10 * ["E150"]
    assert (ends[:, 35:, 1] == 0.0).all() and ends[0, 40].tolist() == [1.0, 0.0, -1.0]


def test_a_map_has_the_errors_of_its_campaign() -> None:
    experiment = small_quickstart()
    fitted = bp.fit(experiment, bp.simulate(experiment), sigma="given").to_map()
    _, ends = length_plan(fitted.volume, 0)
    probes = np.repeat([0, 1], [35, 10])
    of_map, of_design = (
        errors_root(one, ends, probes) for one in (by_map(fitted), by_design(experiment))
    )
    expected = of_design @ of_design.T
    np.testing.assert_allclose(of_map @ of_map.T, expected, atol=1e-3 * expected.max())


def table(path: Path, rows: list[str]) -> Path:
    path.write_text("\n".join(["direction,probe,length_mm,measured_mm", *rows]), encoding="utf-8")
    return path


X = [
    *(f"x,down,100,{100 + e}" for e in (0.0009, -0.0005, 0.0002)),
    *(f"x,down,300,{300 + e}" for e in (0.0013, 0.0011, 0.0015)),
    *(f"yz,long,100,{100 + e}" for e in (-0.0008, -0.001, -0.0009)),
]


def test_readings_by_hand(tmp_path: Path) -> None:
    """MPE 1.1 µm at 100 mm and 1.3 µm at 300 mm; R0 1.4 µm."""
    path = table(tmp_path / "lengths.csv", X)
    read = acceptance(readings=path, mpe="1 um + L/1000000", probe="long")
    assert read.sets.kinds.tolist() == ["E0", "E0", "E150"]
    np.testing.assert_allclose(read.low, [-5e-7, 1.1e-6, -1e-6], atol=1e-12)
    np.testing.assert_allclose(read.high, [9e-7, 1.5e-6, -8e-7], atol=1e-12)
    np.testing.assert_allclose(read.r0, [1.4e-6, 4e-7, 2e-7], atol=1e-12)
    assert read.chances == {"simple acceptance": 0.0}
    assert read.told[0] == "simple acceptance: to be measured three times again: E0 x 300 mm"
    assert "largest |E|/MPE of E0: 1.154" in read.told
    wide = acceptance(readings=path, mpe="2 um", mpl="1.3 um", probe="long")
    assert "R0" in wide.told[0] and not any(wide.chances.values())
    passing = acceptance(readings=path, mpe="1.6 um", gauge="0.1 um", mpl="1.4 um")
    assert list(passing.chances.values()) == [1.0, 0.0]
    told = json.loads(json.dumps(passing.to_dict()))
    assert told["chances"] == passing.chances and told["sets"][1]["R0"] == pytest.approx(4e-7)


def test_readings_measured_again(tmp_path: Path) -> None:
    """All three must then be within; two errors outside cannot be mended."""
    first = [f"x,down,300,{300 + e}" for e in (0.0013, 0.0011, 0.0015)]
    again = [f"x,down,300,{300 + e}" for e in (0.001, 0.0012, -0.0013)]
    for rows, words in (
        (first, "to be measured three times again: E0 x 300 mm"),
        (first + again, "all within the limits: 1 of 35 sets of E0"),
        (first + [*again[:2], "x,down,300,300.0014"], "outside: E0 x 300 mm"),
    ):
        path = table(tmp_path / "lengths.csv", rows)
        assert acceptance(readings=path, mpe="1.3 um").told[0] == f"simple acceptance: {words}"
    path = table(tmp_path / "lengths.csv", [first[2], *first[1:]] + again)
    with pytest.raises(ExperimentError, match="six rows, and not one of three is outside"):
        acceptance(readings=path, mpe="1.3 um")


def test_messages(tmp_path: Path) -> None:
    path = table(tmp_path / "lengths.csv", X[:2])
    with pytest.raises(ExperimentError, match=r"lengths.csv:3:.*2 measurements of this length"):
        acceptance(readings=path, mpe="1 um")
    with pytest.raises(ValueError, match="no point repeatability"):
        acceptance(design=small_quickstart(), mpe="1 um")
    with pytest.raises(ValueError, match='no probe "rigth"; did you mean "right"'):
        acceptance(design=small_quickstart(), mpe="1 um", point_repeatability="1 um", probe="rigth")
    place = {"plane": "z", "level": "300 mm", "corner": {"x": "0 mm", "y": "0 mm"}}
    few = small_quickstart(positions=[{"name": "low", **place, "probes": ["down"]}])
    with pytest.raises(ValueError, match="undetermined"):
        acceptance(design=few, mpe="1 um", point_repeatability="1 um")
