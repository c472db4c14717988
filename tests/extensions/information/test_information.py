"""Information of errors that goes with positions, against a dense deletion of each position's rows."""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.results.residuals import POINTS
from numpy.typing import NDArray

from tests.oracle.campaigns import campaign_file, planned, random_file
from tests.reference import dense
from tests.reference.small_quickstart import small_quickstart, small_sections

Real = NDArray[np.float64]


class Deletion:
    """The whole Jacobian of a problem, by rows; those of lengths before their noise is known."""

    def __init__(self, problem: dense.Problem) -> None:
        self.problem, design = problem, problem.design
        readings, lengths = design.readings, dense.known(design, "length")
        whole = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
        of_plates = design.artefacts.is_plate[design.balls.artefact[readings.ball]]
        read = np.repeat(readings.position[of_plates], 3 * readings.repeats[of_plates])
        self.with_lengths = len(lengths.first) > 0
        if self.with_lengths:
            whole = whole[: len(whole) - len(problem.length_root)]
            offsets = design.probes.offsets[readings.probe]
            self.lengths = dense.jacobian(
                lambda step: dense.length_errors(
                    problem,
                    dense.corrected(
                        problem, problem.scales, dense.unpack(problem, step)[3], offsets
                    ),
                ),
                problem.parameters,
            )
            self.in_position = readings.position[lengths.first]
            self.covariance = dense.length_covariance(design)
        self.whole = whole
        self.of_distances = dense.jacobian(dense.quantities(problem)["U6"], problem.parameters)
        self.position = np.concatenate([read, np.full(len(whole) - len(read), -1)])

    def spread(self, position: int) -> dense.Spread:
        """The covariance of all parameters without a position, with all for -1."""
        rows = self.whole[(self.position != position) | (self.position < 0)]
        if self.with_lengths and (kept := self.in_position != position).any():
            values, vectors = np.linalg.eigh(self.covariance[np.ix_(kept, kept)])
            large = values > dense.FOLLOWS * values[-1]
            root = (vectors[:, large] / np.sqrt(values[large])).T
            rows = np.concatenate([rows, root @ self.lengths[kept]])
        return dense.spread(rows)

    def mean_squares(self, spread: dense.Spread) -> Real:
        """The mean variance of every error that has a parameter, along its axis."""
        found, t = [], np.linspace(0.0, 1.0, POINTS)
        start = self.problem.parameters - len(self.problem.a)
        for function in self.problem.functions:
            linear = np.zeros((len(t), self.problem.parameters))
            shape = t * (1.0 - t if function.zero_at_one else 1.0)
            columns = slice(start, start + function.free)
            if function.free:
                linear[:, columns] = dense.legendre(t, function.free) * shape[:, None]
                found.append(np.mean(spread.of(linear) ** 2))
            start += function.free
        return np.array(found)

    def average(self, spread: dense.Spread) -> float:
        """U6, NaN if any distance is undetermined."""
        return float(np.mean(spread.of(self.of_distances)))


def agree(path: Path) -> tuple[int, int]:
    """Compare a file with its dense deletions; return the numbers of cells with information, and of
    those in which the error is undetermined without the position.
    """
    found = bp.information(path)
    frame = bp.check(path).information
    deletion = Deletion(planned(path).problem)
    every = deletion.spread(-1)
    whole = deletion.mean_squares(every)
    own = np.array([error.standard_uncertainty for error in found.errors])
    np.testing.assert_allclose(own, np.sqrt(whole), rtol=1e-7)
    np.testing.assert_allclose(found.average, deletion.average(every), rtol=1e-7)
    assert list(frame.index) == [error.name for error in found.errors]
    assert list(frame.columns) == [position.name for position in found.positions]
    for k, position in enumerate(found.positions):
        spread = deletion.spread(k)
        without = deletion.mean_squares(spread)
        np.testing.assert_array_equal(np.isnan(found.others[:, k]), np.isnan(without))
        is_lost = np.isnan(without) & ~np.isnan(whole)
        np.testing.assert_array_equal(found.undetermined_without[:, k], is_lost)
        expected = np.where(is_lost, 1.0, 1.0 - whole / without)
        np.testing.assert_allclose(frame.to_numpy()[:, k], expected, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(position.average, deletion.average(spread), rtol=1e-7)
    return int(frame.notna().to_numpy().sum()), int(found.undetermined_without.sum())


@pytest.mark.parametrize("first", [0, *(pytest.param(k, marks=pytest.mark.long) for k in (10, 20))])
def test_information_is_that_of_a_dense_deletion(first: int, tmp_path: Path) -> None:
    """Of designs most of which leave errors undetermined, and of some of full rank."""
    cells = [agree(random_file(seed, tmp_path)) for seed in range(first, first + 8)]
    cells += [agree(campaign_file(seed, tmp_path)) for seed in (first // 10, first // 10 + 3)]
    assert sum(count for count, _ in cells) > 300 and sum(lost for _, lost in cells) > 30


EMPIRICAL = {"kind": "empirical", "terms": "quadratic"}
FREE = {"down": {"offset": ["0 mm", "0 mm", "-50 mm"], "reference": True}}


@pytest.mark.parametrize(
    "changes",
    [
        {"error_model": EMPIRICAL},
        {"probes": small_sections()["probes"] | FREE},
        {"influences": [{"kind": "sag", "artefact": "plate", "standard_uncertainty": "1 um"}]},
    ],
    ids=["functions of the volume", "reference probe", "sag"],
)
def test_information_is_that_of_files_without_the_position(changes: dict[str, object]) -> None:
    sections = small_sections(**changes)
    found = bp.information(bp.experiment(sections))
    assert len(found.errors) == (6 if "error_model" in changes else 18)
    for k, place in enumerate(sections["positions"]):
        others = [other for other in sections["positions"] if other is not place]
        fewer = bp.experiment({**sections, "positions": others})
        without = bp.information(fewer)
        u = [error.standard_uncertainty for error in without.errors]
        np.testing.assert_allclose(found.others[:, k], u, rtol=1e-8)
        # The same position as a candidate adds what goes with it.
        added = bp.information(
            fewer, added=[bp.experiment({**sections, "positions": [*others, place]})]
        )
        assert added.positions[-1].is_added and added.positions[-1].name == place["name"]
        np.testing.assert_allclose(added.information[:, -1], found.information[:, k], atol=1e-9)
        assert added.positions[-1].average == pytest.approx(found.average, rel=1e-9, nan_ok=True)


def test_an_error_names_the_motions_that_hide_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Without a plate across y, tilts of Z about X and the straightness of Z in X are hidden."""
    sections, path = small_sections(), tmp_path / "e.yaml"
    sections["positions"] = sections["positions"][:4]
    path.write_text(yaml.safe_dump(sections), encoding="utf-8")
    null, found = bp.check(path).verdict.null, bp.information(path)
    hidden = {
        error.name: error.hidden_by
        for error in found.errors
        if np.isnan(error.standard_uncertainty)
    }
    assert set(hidden) == {"EXZ", "EAZ"}
    for row, error in enumerate(found.errors):
        named = [k for k, one in enumerate(null) if error.name in {f.name for f in one.functions}]
        assert error.hidden_by == tuple(named)
        assert np.isnan(found.information[row]).all() == (error.name in hidden)
    assert main(["run", "--errors", str(path)]) == 1
    text = capsys.readouterr().out
    motions = "z high (0.854 µm), x low (0.3 µm along z, 1 µrad about y), x high (0.391 µm, 1 µrad"
    assert f"\nEXZ:\n  undetermined with motions of {motions} about y)\n" in text
    assert main(["run", "--errors", str(path), "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    row = [error["name"] for error in data["errors"]].index("EXZ")
    assert set(data["information"][row]) == {None}
    words = [data["directions"][k] for k in data["errors"][row]["hidden_by"]]
    assert data["hidden"][0] == {"errors": ["EXZ"], "directions": words}


def test_errors_of_a_model_without_curves_are_its_parameters() -> None:
    found = bp.information("designs/certified/two-dimensions.yaml")
    assert [error.name for error in found.errors] == ["alpha", "gamma"]
    assert not np.isnan(found.information).any()


def test_a_weak_error_names_weak_directions() -> None:
    found = bp.information(small_quickstart(target_uncertainty="0.01 um"))
    assert any(error.hidden_by for error in found.errors)
    assert all(words.startswith("weak with motions of ") for words in found.directions)
