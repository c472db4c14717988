"""`fit --estimator` and `compare` as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate import experiment as made_of, fit, simulate
from ballplate.cli import main
from ballplate.extensions.estimators import distances
from ballplate.extensions.estimators.alternative_estimators import AlternativeName
from ballplate.extensions.estimators.distances import compare_estimators, count_terms
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.truth import true_machine

from tests.cli import wording
from tests.reference.small_quickstart import small_sections

QUICKSTART = "designs/quickstart.yaml"


@pytest.mark.parametrize("estimator", ["distances", "cresto", "kruth"])
def test_fit(estimator: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    readings = str(tmp_path / "r.csv")
    assert main(["simulate", QUICKSTART, "-o", readings]) == 0
    capsys.readouterr()
    assert main(["fit", QUICKSTART, readings, "--json"]) == 0
    full = json.loads(capsys.readouterr().out)["estimates"]
    assert main(["fit", QUICKSTART, readings, "--json", "--estimator", estimator]) == 0
    rival = json.loads(capsys.readouterr().out)
    assert (
        rival["estimator"] == estimator
        and rival["status"] == "converged"
        and rival["rank_deficiency"] == 0
    )
    differences = [
        value["value"] - full[name]["value"] for name, value in rival["estimates"].items()
    ]
    assert len(differences) == 69
    sizes = [full[name]["standard_uncertainty"] for name in rival["estimates"]]
    # Distances hardly show the roll of X and what goes with it: there a rival is some ten times
    # less certain.
    assert 0.1 < np.sqrt(np.mean(np.square(np.array(differences) / sizes))) < 20


def test_more_data_sets_add_to_those_before() -> None:
    design = bp.load("designs/npl/6.2.7.yaml", "5 x 5")
    few, more = (bp.compare(design, trials=trials).to_dict() for trials in (2, 4))
    assert few["rms"]["values"] == more["rms"]["values"][:2]
    assert more["trials"] == 4 and more["not_converged"] == []
    for share, value in more["rms"]["quantiles"].items():
        assert value == pytest.approx(np.quantile(more["rms"]["values"], float(share)))
    assert len(more["rms"]["quantiles"]) == 7


def test_repeats_of_a_length_standard_are_not_mistaken_for_other_readings() -> None:
    sections = small_sections()
    for one in (*sections["positions"], *sections["calibration"]):
        one["artefact"] = "plate"
    bar = {"kind": "two_spheres", "length": "400 mm", "role": "length_standard"}
    sections["artefacts"] = sections["artefacts"] | {"bar": bar}
    place = {"origin": ["300 mm", "200 mm", "300 mm"]}
    given = {"name": "bar", "artefact": "bar", "pose": place, "probes": ["down"], "repeats": 3}
    sections["positions"].insert(0, given)
    known = {"kind": "distances", "artefact": "bar", "pairs": "all"}
    sections["calibration"].insert(0, known | {"standard_uncertainty": "0.1 um"})
    found = compare_estimators(made_of(sections), 3).to_dict()
    assert found["not_converged"] == [] and max(found["maximum"]["values"]) < 5e-6


@pytest.mark.parametrize(
    ("estimator", "pair_set", "across_probes"),
    [("distances", "braced", True), ("cresto", "all", False), ("kruth", None, False)],
)
def test_more_terms_than_there_is_memory_for(
    monkeypatch: pytest.MonkeyPatch,
    estimator: AlternativeName,
    pair_set: str | None,
    across_probes: bool,
) -> None:
    """Refused is one term more than possible; what is counted are the terms that the estimators
    have.
    """
    (experiment,) = load(QUICKSTART)
    design = lay_out(experiment)
    terms = count_terms(experiment, design, estimator, pair_set, across_probes)
    given: Any = {"pairs": pair_set, "across_probes": across_probes}
    fitted = fit(experiment, simulate(experiment), estimator=estimator, **given)
    # Beside four certified distances, to which Cresto's estimator compares those read in each of ten
    # positions; Kruth's takes the mean length of each of 62 pairs away.
    beside = {"distances": 4, "cresto": 40, "kruth": 4 - 62}[estimator]
    assert fitted.solution.observations == terms + beside
    parameters = len(design.model.parameters)
    monkeypatch.setattr(
        "ballplate.extensions.estimators.distances.MOST_DERIVATIVES", terms * parameters
    )
    found = compare_estimators(experiment, 1, estimator, pair_set, across_probes, points=2)
    assert found.failed == () or estimator == "kruth"
    monkeypatch.setattr(
        "ballplate.extensions.estimators.distances.MOST_DERIVATIVES", terms * parameters - 1
    )
    with pytest.raises(ExperimentError) as caught:
        compare_estimators(experiment, 1, estimator, pair_set, across_probes, points=2)
    assert (
        str(caught.value)
        == f"{QUICKSTART}: artefacts: {estimator} with these pairs of balls has {terms} terms; at"
        f" most {terms - 1} are possible with {parameters} parameters: take fewer --pairs, such"
        " as corners, or fewer balls"
    )


@pytest.mark.parametrize(
    ("file", "variant", "estimator"),
    [
        (QUICKSTART, None, "distances"),
        ("designs/hocken_borchardt/dummy.yaml", "with scale", "reversal"),
    ],
)
def test_errors_against_the_true_machine_are_those_of_the_distances(
    file: str, variant: str | None, estimator: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bias and scatter over data sets, from the parameters that both estimators find."""
    (experiment,) = [one for one in load(Path(file)) if one.name == variant]
    design = lay_out(experiment)
    found: list[Any] = []
    original = distances._both_estimates

    def kept(*given: Any) -> Any:
        found.append(original(*given))
        return found[-1]

    monkeypatch.setattr(distances, "_both_estimates", kept)
    result = compare_estimators(experiment, 4, estimator, points=7)
    generator = np.random.default_rng(np.random.SeedSequence(experiment.seed, spawn_key=(0, 0)))
    volume, p = design.machine.volume, design.probes.offsets[design.evaluation.probe]
    ends = volume.lower + volume.size * generator.random((2, 7, design.dimension))
    machine = true_machine(experiment.true_machine, design.model, *volume.corners)

    def lengths(model: Any, a: Any) -> Any:
        places = [x + model.error(x, a, np.broadcast_to(p, x.shape)) for x in ends]
        return np.linalg.norm(places[0] - places[1], axis=1)

    true = lengths(machine.model, machine.a)
    for place, name in enumerate(("full", estimator)):
        errors = np.array([lengths(design.model, both[place]) - true for both in found])
        one = result.of_truth[name]
        np.testing.assert_allclose(one.bias, np.sqrt((errors.mean(axis=0) ** 2).mean()))
        scatter = np.sqrt(errors.var(axis=0, ddof=1).mean())
        np.testing.assert_allclose([one.scatter, one.chance], [scatter, scatter / 2.0])
        np.testing.assert_allclose(one.rms, np.sqrt((errors**2).mean()))
    assert result.to_dict()["against_truth"]["full"]["rms"] == result.of_truth["full"].rms
    assert wording.DISTANCES_AGAINST_THE_TRUE_MACHINES in "\n".join(result.lines())
