"""Ball centres, part co-ordinates and corrected readings: what they are is said, or found where the
readings tell it, and never found where they do not.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pandas
import pytest
import yaml
from ballplate.extensions.laboratory.offsets_applied import judge_offsets
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.readings.reading_files import read_readings
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from tests.extensions.laboratory import wording

DESIGN = "designs/quickstart.yaml"
AXES = ["x_mm", "y_mm", "z_mm"]
OFFSETS = {
    "down": (0.0, 0.0, -50.0),
    "right": (50.0, 0.0, 0.0),
    "left": (-50.0, 0.0, 0.0),
    "back": (0.0, 50.0, 0.0),
    "front": (0.0, -50.0, 0.0),
}


@pytest.fixture(scope="module")
def readings() -> pandas.DataFrame:
    return bp.simulate(DESIGN)


@pytest.fixture(scope="module")
def plain(readings: pandas.DataFrame) -> pandas.DataFrame:
    return pandas.DataFrame(bp.fit(DESIGN, readings).rows())


def centres(
    readings: pandas.DataFrame, offsets: dict[str, tuple[float, ...]] = OFFSETS
) -> pandas.DataFrame:
    found = readings.copy()
    found[AXES] = readings[AXES] + np.array([offsets[probe] for probe in readings["probe"]])
    return found


def in_parts(centred: pandas.DataFrame, seed: int) -> pandas.DataFrame:
    """Centres in another co-ordinate system in each position."""
    found, generator = centred.copy(), np.random.default_rng(seed)
    for k, name in enumerate(centred["position"].unique()):
        own = (centred["position"] == name).to_numpy()
        turn = Rotation.random(random_state=seed + k).as_matrix()
        shift = generator.uniform(-300.0, 300.0, 3)
        found.loc[own, AXES] = (centred.loc[own, AXES].to_numpy() - shift) @ turn
    return found


def worst(found: bp.Fit, plain: pandas.DataFrame) -> tuple[float, float]:
    """Largest difference of machine parameters in standard uncertainties, and of distances between
    balls in metres.
    """
    frame = pandas.DataFrame(found.rows())
    assert list(frame["parameter"]) == list(plain["parameter"])
    of_machine = (plain["kind"] == "machine").to_numpy()
    apart = (frame["value"] - plain["value"]).abs() / plain["standard uncertainty"]
    balls = [
        pdist(one[one["kind"] == "ball"]["value"].to_numpy().reshape(-1, 3))
        for one in (frame, plain)
    ]
    return float(apart[of_machine].max()), float(np.abs(balls[0] - balls[1]).max())


def test_stated_ball_centres_give_the_estimates_of_scale_readings(
    readings: pandas.DataFrame, plain: pandas.DataFrame
) -> None:
    machine, balls = worst(bp.fit(DESIGN, centres(readings), coordinates="ball centres"), plain)
    assert machine < 1e-5 and balls < 1e-11


def test_ball_centres_that_nobody_states_are_found(readings: pandas.DataFrame) -> None:
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(DESIGN, centres(readings))
    (message,) = refused.value.messages
    assert "coordinates: ball centres" in message.text and "50 mm" in message.text


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ("ball centres", "as ball centres, which is stated;"),
        ("part", "as ball centres, which part co-ordinates are, and part is stated;"),
    ],
)
def test_what_is_stated_is_told_as_it_was_stated(
    readings: pandas.DataFrame, stated: str, said: str
) -> None:
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(DESIGN, readings, coordinates=stated)
    assert said in str(refused.value)


@pytest.mark.parametrize("stated", ["ball centres", "part"])
def test_scale_readings_that_are_called_ball_centres_are_found(
    readings: pandas.DataFrame, stated: str
) -> None:
    with pytest.raises(bp.ExperimentError, match="write coordinates: scale readings"):
        bp.fit(DESIGN, readings, coordinates=stated)


def test_part_coordinates_of_one_position_given_as_another(
    readings: pandas.DataFrame, tmp_path: Path
) -> None:
    """A copy under another name is told with both names; as many readings with one digit that
    differs are not, nor positions that were measured.
    """
    (experiment,) = load(Path(DESIGN))
    settings = experiment.with_readings({"coordinates": "part"}).readings
    parts = in_parts(centres(readings), 7)
    path, design = tmp_path / "part.csv", lay_out(experiment)

    def doubts(table: pandas.DataFrame) -> str:
        table.to_csv(path, index=False)
        return " ".join(read_readings(path, design, settings=settings).doubts)

    assert wording.TO_THE_LAST_DIGIT not in doubts(parts)
    one, other = (parts["position"] == name for name in ("z low", "z high"))
    copied = parts.copy()
    copied.loc[other, AXES] = parts.loc[one, AXES].to_numpy()
    assert list(copied.loc[one, "ball"]) == list(copied.loc[other, "ball"])
    said = doubts(copied)
    assert wording.POSITIONS_AND_HAVE_THE_SAME_READINGS in said
    assert said.count(wording.TO_THE_LAST_DIGIT) == 1
    copied.loc[copied.index[other][0], "x_mm"] += 1e-4
    assert wording.TO_THE_LAST_DIGIT not in doubts(copied)


def test_offsets_of_the_controller(readings: pandas.DataFrame, plain: pandas.DataFrame) -> None:
    """The measuring program's offsets are not those of the plan: only they were applied."""
    others = {name: tuple(1.01 * x + 0.2 for x in offset) for name, offset in OFFSETS.items()}
    stated = {name: [f"{x!r} mm" for x in offset] for name, offset in others.items()}
    experiment = bp.load(DESIGN).with_(
        readings={"coordinates": "ball centres", "offsets_in_controller": stated}
    )
    machine, balls = worst(bp.fit(experiment, centres(readings, others)), plain)
    assert machine < 1e-5 and balls < 1e-11


def design_with(probes: list[list[str]], offsets: dict[str, tuple[float, ...]]) -> bp.Experiment:
    """The quick start with other probes in its positions."""
    content = yaml.safe_load(Path(DESIGN).read_text(encoding="utf-8"))
    content["probes"] = {name: [f"{x} mm" for x in offset] for name, offset in offsets.items()}
    for position, own in zip(content["positions"], probes, strict=True):
        position["probes"] = own
    content["machine"]["volume"] = {axis: ["-100 mm", "1.2 m"] for axis in "xyz"}
    return bp.experiment(content)


# Probes of the six positions → whether these tell ball centres from scale readings.
PROBES = {
    "two in four positions": (
        [["down"]] * 2 + [["right", "left"]] * 2 + [["back", "front"]] * 2,
        True,
    ),
    "two in one position": ([["down"]] * 3 + [["right", "left"]] + [["back"], ["front"]], True),
    "one in each": ([["down"], ["down"], ["right"], ["left"], ["back"], ["front"]], False),
    "the same in all": ([["down"]] * 6, False),
}


@pytest.mark.parametrize("name", PROBES)
@pytest.mark.parametrize("applied", [False, True])
def test_ball_centres_are_told_where_a_position_has_two_probes_and_only_there(
    name: str, applied: bool
) -> None:
    probes, tells = PROBES[name]
    experiment = design_with(probes, OFFSETS)
    found = bp.simulate(experiment, seed=4)
    found = centres(found) if applied else found
    if not tells:
        doubts = [text for text in bp.fit(experiment, found).warnings if "do not tell" in text]
        assert len(doubts) == 1 and "coordinates: scale readings" in doubts[0]
        kind = "ball centres" if applied else "scale readings"
        said = bp.fit(experiment, found, coordinates=kind).warnings
        assert not [text for text in said if "do not tell" in text]
    elif applied:
        with pytest.raises(bp.ExperimentError, match="coordinates: ball centres"):
            bp.fit(experiment, found)
    else:
        assert not [text for text in bp.fit(experiment, found).warnings if "do not tell" in text]


@pytest.mark.parametrize("difference", [0.01, 0.2, 1.0, 40.0])
def test_the_verdict_is_right_or_none_however_little_offsets_differ(difference: float) -> None:
    """The machine's own errors of some micrometres hide differences of ten, and nothing else."""
    offsets = {name: (0.0, 0.0, -50.0) for name in OFFSETS} | {
        "left": (difference, 0.0, -50.0),
        "front": (0.0, difference, -50.0),
    }
    experiment = design_with(PROBES["two in four positions"][0], offsets)
    design = lay_out(experiment)
    for applied in (False, True):
        found = bp.simulate(experiment, seed=5)
        index = {name: k for k, name in enumerate(OFFSETS)}
        probe = np.array([index[name] for name in found["probe"]])
        x = 1e-3 * found[AXES].to_numpy() + applied * design.probes.offsets[probe]
        verdict = judge_offsets(design, design.readings.expanded(), x)
        right = ("scale readings", "ball centres")[applied]
        assert verdict.right in ((right,) if difference > 0.1 else (right, None)), verdict


def test_offsets_of_the_wrong_sign_are_told_as_that(readings: pandas.DataFrame) -> None:
    probes = {name: [f"{-x} mm" for x in offset] for name, offset in OFFSETS.items()}
    with pytest.raises(bp.ExperimentError, match=wording.CORRECT_THE_SIGNS_OF_THE_OFFSETS):
        bp.fit(bp.load(DESIGN).with_(probes=probes), readings)


def test_part_co_ordinates_give_the_same_machine(
    readings: pandas.DataFrame, plain: pandas.DataFrame
) -> None:
    """To 0.05 standard uncertainties, where the plate stood as planned."""
    found = bp.fit(DESIGN, in_parts(centres(readings), 6), coordinates="part")
    machine, balls = worst(found, plain)
    assert machine < 0.05 and balls < 1e-9
    assert any(wording.PLACED_BY_THE_NOMINAL_POSES in text for text in found.remarks)


def test_part_co_ordinates_that_nobody_states_are_no_readings(
    readings: pandas.DataFrame,
) -> None:
    """Of one probe in each position every system of co-ordinates fits; it is doubted then."""
    for seed in range(2):
        with pytest.raises(bp.ExperimentError) as refused:
            bp.fit(DESIGN, in_parts(centres(readings), 10 * seed))
        assert "part" in str(refused.value), str(refused.value)
    experiment = design_with(PROBES["one in each"][0], OFFSETS)
    found = centres(bp.simulate(experiment, seed=4))
    turned = found.copy()
    own = (found["position"] == "x low").to_numpy()
    middle = found.loc[own, AXES].to_numpy().mean(axis=0)
    turn = Rotation.from_rotvec([0.0, 0.0, np.pi / 3]).as_matrix()
    turned.loc[own, AXES] = (found.loc[own, AXES].to_numpy() - middle) @ turn + middle
    doubts = bp.fit(experiment, turned, coordinates="ball centres").warnings
    assert any("x low" in text and "turned by 60 degrees" in text for text in doubts), doubts


# Errors that the machine's correction takes off: e(x) of x + e(x).
MAP = """\
title: correction
arrangement: MB2
volume: {x: [-100 mm, 1.1 m], y: [-100 mm, 1.1 m], z: [-100 mm, 1.1 m]}
errors:
  EXX: {polynomial: [0 um, 12 um]}
  EYX: {polynomial: [0 um, 0 um, 9 um]}
"""


@pytest.mark.parametrize("kind", ["scale readings", "ball centres"])
def test_a_correction_is_taken_off(
    kind: str, readings: pandas.DataFrame, plain: pandas.DataFrame, tmp_path: Path
) -> None:
    """Readings that a correction was added to by its closed form."""
    (tmp_path / "map.yaml").write_text(MAP, encoding="utf-8")
    along = (readings["x_mm"].to_numpy() + 100.0) / 1200.0
    corrected = readings.copy()
    corrected["x_mm"] += 0.012 * along
    # A straightness error is from the line through its ends.
    corrected["y_mm"] += 0.009 * along * (along - 1.0)
    corrected = centres(corrected) if kind == "ball centres" else corrected
    experiment = bp.load(DESIGN).with_(
        readings={"coordinates": kind, "compensation": {"file": str(tmp_path / "map.yaml")}}
    )
    found = bp.fit(experiment, corrected)
    machine, balls = worst(found, plain)
    assert machine < 1e-4 and balls < 1e-11
    assert any("was subtracted" in text for text in found.remarks)
    # With the correction on, what is left is estimated, and that is said.
    on = bp.fit(
        bp.load(DESIGN).with_(readings={"coordinates": kind, "compensation": "on"}), corrected
    )
    assert worst(on, plain)[0] > 1.0 and any(
        wording.THE_ERRORS_THAT_IT_LEAVES in t for t in on.remarks
    )


def test_readings_that_are_the_same_are_all_of_one_kind() -> None:
    """Readings of nothing agree as anything; they are not told to be ball centres."""
    found = bp.simulate(DESIGN)
    found[AXES] = 100.0
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(DESIGN, found)
    assert "ball centres" not in str(refused.value)


def test_readers_agree_on_several_tables(readings: pandas.DataFrame, tmp_path: Path) -> None:
    """Paths, data frames and files that the experiment names are the same readings."""
    design = lay_out(bp.load(DESIGN))
    halves = [readings.iloc[:100], readings.iloc[100:]]
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for half, path in zip(halves, paths, strict=True):
        half.to_csv(path, index=False)
    one = bp.fit(DESIGN, readings)
    assert [bp.fit(DESIGN, halves).sigma, bp.fit(DESIGN, paths).sigma] == [one.sigma] * 2
    named = bp.load(DESIGN).with_(readings={"files": [str(path) for path in paths]})
    assert bp.fit(named).sigma == one.sigma
    assert len(read_readings(paths, design).marks) == len(readings)


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_balls_do_not_place_part_co_ordinates(
    readings: pandas.DataFrame, count: int
) -> None:
    """Nor do they tell how the plate stood; the other positions still are fitted."""
    own = readings["position"] == "z high"
    few = pandas.concat([readings[~own], readings[own].iloc[:count]])
    assert bp.fit(DESIGN, few).warnings == ()
    with pytest.raises(bp.ExperimentError, match=wording.TOO_FEW_BALLS_WERE_READ):
        bp.fit(DESIGN, centres(few), coordinates="part")


UNITS = {
    "inches that are read as millimetres": 1 / 25.4,
    "centimetres that are read as millimetres": 0.1,
}


@pytest.mark.parametrize("what", UNITS)
@pytest.mark.parametrize("kind", ["ball centres", "part"])
@pytest.mark.parametrize("controller", [None, OFFSETS])
def test_a_wrong_unit_of_centres_is_told_once(
    readings: pandas.DataFrame,
    kind: str,
    what: str,
    controller: dict[str, tuple[float, ...]] | None,
) -> None:
    """Whatever the controller applied: its offsets are in the wrong unit, too."""
    applied = (
        OFFSETS
        if controller is None
        else {name: tuple(1.02 * value + 0.3 for value in one) for name, one in OFFSETS.items()}
    )
    table = centres(readings, applied)
    table = in_parts(table, 4) if kind == "part" else table
    (experiment,) = load(DESIGN)
    stated = {name: [f"{value} mm" for value in one] for name, one in applied.items()}
    settings = {"coordinates": kind} | ({"offsets_in_controller": stated} if controller else {})
    experiment = experiment.with_(readings=settings)
    wrong = table.assign(**{axis: table[axis] * UNITS[what] for axis in AXES})
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(experiment, wrong)
    (message,) = refused.value.messages
    assert what in message.text and wording.OTHERWISE_THE_NAMES_OF_BALLS in message.text
    assert ", or lengths" not in message.text and ", or if" not in message.text
    assert bp.fit(experiment, table).converged


@pytest.mark.parametrize("kind", ["ball centres", "part"])
def test_wrong_names_of_centres_are_no_wrong_unit(readings: pandas.DataFrame, kind: str) -> None:
    table, generator = centres(readings), np.random.default_rng(12)
    table = in_parts(table, 5) if kind == "part" else table
    for name in table["position"].unique():
        own = table["position"] == name
        table.loc[own, "ball"] = generator.permutation(table.loc[own, "ball"].to_numpy())
    (experiment,) = load(DESIGN)
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(experiment.with_(readings={"coordinates": kind}), table)
    assert len(refused.value.messages) > 1
    assert all("lengths are in" not in one.text for one in refused.value.messages)
