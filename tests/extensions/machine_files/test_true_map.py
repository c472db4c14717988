"""A map as the true machine of an experiment."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest

from tests.extensions.machine_files.kinds import MODELS, experiment_of, fit_of, write_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("true")
    write_files(found)
    return found


# Cheap ones in every run.
KINDS = [
    kind if kind in ("metric", "plane", "table") else pytest.param(kind, marks=pytest.mark.long)
    for kind in MODELS
    if kind != "estimated probe"
]


@pytest.mark.parametrize("kind", KINDS)
def test_error_free_readings_of_a_map_give_it_back(kind: str, folder: Path) -> None:
    fitted = fit_of(kind, folder).to_map()
    bp.write_map(fitted, folder / "map.yaml")
    experiment = experiment_of(
        kind, folder, true_machine={"kind": "map", "file": "map.yaml"}, sigma="given"
    )
    again = bp.fit(experiment, bp.simulate(experiment, exact=True)).to_map()
    # Across what nothing determines.
    null = again.undetermined / again.scale[:, None]
    apart = (again.estimates - fitted.estimates) / again.scale
    assert np.abs(apart - null @ (null.T @ apart)).max() < 1e-12


@pytest.mark.long
def test_machines_are_drawn_within_the_covariance(folder: Path) -> None:
    fitted = fit_of("spatial metric", folder).to_map()
    bp.write_map(fitted, folder / "drawn.yaml")
    drawn = []
    for seed in range(50):
        experiment = experiment_of(
            "spatial metric",
            folder,
            true_machine={"kind": "map", "file": "drawn.yaml", "draw": seed},
        )
        corners = experiment.machine.volume.corners
        drawn.append(experiment.true_machine.true_machine(fitted.model, *corners).a)
    apart = np.linalg.solve(np.linalg.cholesky(fitted.covariance), (drawn - fitted.values).T)
    # Each is chi-squared of 50 with a standard deviation of 10, each mean normal with 1/7.
    assert (np.abs((apart**2).sum(axis=1) - 50.0) < 5 * 10.0).all()
    assert (np.abs(apart.mean(axis=1)) < 5 / 7).all()
    assert (np.abs(np.corrcoef(apart) - np.eye(6)) < 5 / 7).all()


def test_a_true_machine_of_another_volume_or_dimension_is_refused(folder: Path) -> None:
    bp.write_map(fit_of("plane", folder).to_map(), folder / "plane.yaml")
    truth = {"kind": "map", "file": "plane.yaml"}
    with pytest.raises(bp.ExperimentError, match="true_machine.file: is of 2 axes"):
        experiment_of("kinematic", folder, true_machine=truth)
    larger = {"volume": ["500 mm", "700 mm"], "repeatability": "0.5 um"}
    with pytest.raises(bp.ExperimentError, match="in y, but machine.volume is 0 mm to 700 mm"):
        experiment_of("plane", folder, true_machine=truth, machine=larger)
    smaller = {"volume": ["480 mm", "520 mm"], "repeatability": "0.5 um"}
    inside = experiment_of("plane", folder, true_machine=truth, machine=smaller)
    assert bp.fit(inside, bp.simulate(inside)).converged
