"""A map as prior of a next campaign: the same as both campaigns evaluated together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.extensions.machine_files import sigmas_by_campaign as campaign_sigmas
from ballplate.extensions.machine_files.fitted_map import FittedMap
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from scipy import stats

from tests.extensions.machine_files import wording
from tests.extensions.machine_files.kinds import FREE, IN_SPACE, MODELS, model_of, write_files
from tests.reference.small_quickstart import small_quickstart

CALIBRATION = IN_SPACE["calibration"][0]
# Readings to far less than the machine's errors make everything linear.
SMALL = {"kind": "random", "position": "1 um", "rotation": "1 urad", "seed": 3}


class Campaigns:
    """Two campaigns of one machine with a plate each, and both as one experiment."""

    def __init__(self, kind: str, folder: Path, probes: dict[str, Any] | None = None) -> None:
        self.base = MODELS[kind][0]
        # Stated uncertainties in parts of the true ones.
        self.factor = 1.0
        self.folder = folder
        write_files(folder)
        truth = {"kind": "zero"} if kind == "python" else SMALL
        self.common = {
            "error_model": model_of(kind, folder),
            "sigma": "given",
            "true_machine": truth,
        }
        if probes is not None:
            self.common |= {"probes": probes}
        places = self.base["positions"]
        self.first = [{**one, "artefact": "A"} for one in places[1 if len(places) > 3 else 0 :]]
        self.second = [
            {**one, "name": f"again {one['name']}", "artefact": "B"}
            for k, one in enumerate(places)
            if k != 1
        ]
        self.joint = self.experiment("AB", [*self.first, *self.second])
        self.readings = bp.simulate(self.joint, 7)
        self.of_first = self.readings["position"].isin([one["name"] for one in self.first])

    def experiment(self, plates: str, positions: Any, **more: Any) -> bp.Experiment:
        sections = {
            **self.base,
            **self.common,
            "machine": self.base["machine"] | {"repeatability": f"{0.3 * self.factor} um"},
            "artefacts": {name: self.base["artefacts"]["plate"] for name in plates},
            "positions": positions,
            "calibration": [
                {**CALIBRATION, "artefact": name, "standard_uncertainty": f"{0.3 * self.factor} um"}
                for name in plates
            ],
        }
        return bp.experiment({**sections, **more}, self.folder)

    def map_of_first(self, date: str | None = None, **more: Any) -> FittedMap:
        fit = bp.fit(self.experiment("A", self.first, **more), self.readings[self.of_first])
        bp.write_map(fit.to_map(date), self.folder / "first.yaml")
        return fit.to_map()

    def fit_of_second(self, priors: Any = None, **more: Any) -> FittedMap:
        if priors is not None:
            more["priors"] = [{"kind": "map", "file": "first.yaml", **priors}]
        experiment = self.experiment("B", self.second, **more)
        return bp.fit(experiment, self.readings[~self.of_first]).to_map()

    def both(self, **more: Any) -> FittedMap:
        joint = self.experiment("AB", [*self.first, *self.second], **more)
        return bp.fit(joint, self.readings).to_map()


def determined(fitted: FittedMap, undetermined: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Estimates and covariance in metres, across directions that are undetermined."""
    null = undetermined / fitted.scale[:, None]
    across = np.linalg.qr(np.hstack([null, np.eye(len(null))]))[0][:, null.shape[1] :]
    covariance = fitted.covariance / np.outer(fitted.scale, fitted.scale)
    return across.T @ (fitted.estimates / fitted.scale), across.T @ covariance @ across


# Cheap ones in every run.
KINDS = [
    "metric",
    "plane",
    "machine file",
    *(
        pytest.param(kind, marks=pytest.mark.long)
        for kind in ("spatial metric", "kinematic", "empirical", "python")
    ),
]


@pytest.mark.parametrize("kind", KINDS)
def test_a_map_as_prior_equals_both_campaigns_together(kind: str, tmp_path: Path) -> None:
    campaigns = Campaigns(kind, tmp_path)
    first = campaigns.map_of_first()
    found, alone, right = campaigns.fit_of_second({}), campaigns.fit_of_second(), campaigns.both()
    assert found.undetermined.shape == right.undetermined.shape
    assert first.undetermined.shape[1] >= right.undetermined.shape[1]
    values, covariance = determined(found, right.undetermined)
    true_values, true_covariance = determined(right, right.undetermined)
    spread = np.sqrt(np.diagonal(true_covariance))
    assert (np.abs(values - true_values) < 1e-3 * spread).all()
    assert (np.abs(covariance - true_covariance) < 1e-3 * np.outer(spread, spread)).all()
    # The prior has told something: it is no mere copy of the second campaign.
    _, without = determined(alone, right.undetermined)
    assert np.diagonal(covariance).sum() < 0.9 * np.diagonal(without).sum()


@pytest.mark.parametrize("factor", [1.0 / 3.0, 1.0, 3.0])
@pytest.mark.parametrize(
    "kind", ["metric", "plane", pytest.param("spatial metric", marks=pytest.mark.long)]
)
def test_a_map_with_a_common_sigma_equals_both_campaigns_together(
    kind: str, factor: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the stated uncertainties, but for what is of second order: errors of a micrometre in
    half a metre.
    """
    monkeypatch.setattr(campaign_sigmas, "LEVEL", 0.0)
    campaigns = Campaigns(kind, tmp_path)
    campaigns.factor = factor
    first = campaigns.map_of_first(sigma="estimated")
    found, right = campaigns.fit_of_second({}, sigma="estimated"), campaigns.both(sigma="estimated")
    assert abs(first.sigma - 1.0 / factor) < 0.5 / factor
    assert found.degrees_of_freedom == right.degrees_of_freedom
    assert found.sigma == pytest.approx(right.sigma, rel=1e-8)
    assert found.sum_of_squares == pytest.approx(right.sum_of_squares, rel=2e-8)
    values, covariance = determined(found, right.undetermined)
    true_values, true_covariance = determined(right, right.undetermined)
    spread = np.sqrt(np.diagonal(true_covariance))
    assert (np.abs(values - true_values) < 1e-6 * spread).all()
    assert (np.abs(covariance - true_covariance) < 1e-6 * np.outer(spread, spread)).all()


def test_a_map_with_another_sigma_keeps_its_own(tmp_path: Path) -> None:
    """Two independent estimates, each with its own sigma, by the textbook."""
    campaigns = Campaigns("spatial metric", tmp_path)
    first = campaigns.map_of_first(sigma="estimated")
    campaigns.factor = 3.0
    alone = campaigns.fit_of_second(sigma="estimated")
    second = campaigns.experiment(
        "B", campaigns.second, sigma="estimated", priors=[{"kind": "map", "file": "first.yaml"}]
    )
    fit: Any = bp.fit(second, campaigns.readings[~campaigns.of_first])
    found = fit.to_map()
    known, own = np.linalg.inv(first.covariance), np.linalg.inv(alone.covariance)
    covariance = np.linalg.inv(known + own)
    values = covariance @ (known @ first.estimates + own @ alone.estimates)
    spread = np.sqrt(np.diagonal(covariance))
    assert (np.abs(found.estimates - values) < 1e-5 * spread).all()
    assert (np.abs(found.covariance - covariance) < 1e-5 * np.outer(spread, spread)).all()
    assert found.sigma == pytest.approx(alone.sigma, rel=1e-8)
    assert found.degrees_of_freedom == min(alone.degrees_of_freedom, first.degrees_of_freedom)
    (told,) = [line for line in fit.lines() if line.startswith("sigma of first.yaml")]
    ratio = (first.sigma / alone.sigma) ** 2
    p = 2.0 * stats.f.sf(ratio, first.degrees_of_freedom, alone.degrees_of_freedom)
    assert fit.to_dict()["campaigns"]["maps"][0]["p_value"] == pytest.approx(p)
    assert "they differ" in told and wording.AGAINST_A_LEVEL_OF_THE_MAP in told


@pytest.mark.parametrize("kind", ["plane", "spatial metric"])
def test_readings_that_leave_directions_open_have_the_freedom_of_a_fit_of_them(
    kind: str, tmp_path: Path
) -> None:
    """One position does not determine the machine without the map."""
    campaigns = Campaigns(kind, tmp_path)
    campaigns.map_of_first(sigma="estimated")
    positions = campaigns.second[:1]
    readings = campaigns.readings[campaigns.readings["position"] == positions[0]["name"]]
    priors = [{"kind": "map", "file": "first.yaml"}]
    known = campaigns.experiment("B", positions, sigma="estimated", priors=priors)
    told = bp.fit(known, readings).to_dict()["campaigns"]
    alone: Any = bp.fit(campaigns.experiment("B", positions, sigma="estimated"), readings)
    assert alone.verdict.deficiency > 0
    assert told["degrees_of_freedom_without_maps"] == alone.degrees_of_freedom > 0
    # To second order of the errors, by which a direction may be left open or not.
    assert told["sigma_without_maps"] == pytest.approx(alone.sigma, rel=1e-3)


def test_predictions_say_how_a_map_is_scaled(tmp_path: Path) -> None:
    """By its own sigma: the readings to come are taken at their stated uncertainties."""
    campaigns = Campaigns("spatial metric", tmp_path)
    campaigns.factor = 3.0
    first = campaigns.map_of_first(sigma="estimated")
    priors = [{"kind": "map", "file": "first.yaml"}]
    told = bp.run(campaigns.experiment("B", campaigns.second, priors=priors))
    assert any(
        line == f"prior first.yaml scaled with its sigma, {first.sigma:.4g}"
        for line in told.lines()
    )
    at = linearise(lay_out(campaigns.experiment("B", campaigns.second)))
    own = at.shared[at.layout.model] @ at.shared[at.layout.model].T
    covariance = np.linalg.inv(np.linalg.inv(first.covariance) + np.linalg.inv(own))
    at = linearise(told.design)
    found = at.shared[at.layout.model] @ at.shared[at.layout.model].T
    spread = np.sqrt(np.diagonal(covariance))
    assert (np.abs(found - covariance) < 1e-5 * np.outer(spread, spread)).all()


def test_estimated_offsets_of_probes_count_where_they_are_kept(tmp_path: Path) -> None:
    unknown = FREE | {"right": {"offset": FREE["right"]["offset"], "unknown": True}}
    campaigns = Campaigns("spatial metric", tmp_path, FREE)
    campaigns.map_of_first()
    right = campaigns.both()
    # What was known of the offset beforehand is in the map, and counts once.
    kept = campaigns.fit_of_second({"offsets": True}, probes=unknown)
    spread = right.standard_uncertainties()
    assert len(spread) == 9
    assert (np.abs(kept.estimates - right.estimates) < 1e-3 * spread).all()
    assert np.allclose(kept.standard_uncertainties(), spread, rtol=1e-3)
    forgotten = campaigns.fit_of_second({}, probes=unknown)
    assert (forgotten.standard_uncertainties()[6:] > 1.2 * spread[6:]).all()


@pytest.mark.parametrize(
    ("stated", "years"),
    [
        pytest.param({"inflation": 2.5}, 0.0, marks=pytest.mark.long),
        pytest.param({"drift_per_year": "0.4 um", "years": 2.0}, 2.0, marks=pytest.mark.long),
        ({"drift_per_year": "0.4 um", "date": "2027-11-22", "inflation": 1.5}, 365.0 / 365.25),
    ],
)
def test_age_enlarges_what_the_map_tells(stated: Any, years: float, tmp_path: Path) -> None:
    campaigns = Campaigns("spatial metric", tmp_path)
    first, alone = campaigns.map_of_first("2026-11-22"), campaigns.fit_of_second()
    found = campaigns.fit_of_second(stated)
    # Two independent estimates, by the textbook.
    drifted = np.diag((0.4e-6 * years * first.scale) ** 2)
    known = np.linalg.inv(stated.get("inflation", 1.0) ** 2 * first.covariance + drifted)
    own = np.linalg.inv(alone.covariance)
    covariance = np.linalg.inv(known + own)
    values = covariance @ (known @ first.estimates + own @ alone.estimates)
    spread = np.sqrt(np.diagonal(covariance))
    assert (np.abs(found.estimates - values) < 1e-3 * spread).all()
    assert (np.abs(found.covariance - covariance) < 1e-3 * np.outer(spread, spread)).all()


CASES = {
    "volume": (
        {"machine": IN_SPACE["machine"] | {"volume": ["500 mm", "500 mm", "600 mm"]}},
        "its volume is 0 mm to 500 mm in z, but machine.volume is 0 mm to 600 mm",
    ),
    "model": (
        {"error_model": {"kind": "empirical"}},
        "is of another error model (parameters differ",
    ),
    "age": (
        {"priors": [{"kind": "map", "file": "first.yaml", "drift_per_year": "1 um"}]},
        "needs the time between both campaigns",
    ),
    "no date": (
        {
            "priors": [
                {
                    "kind": "map",
                    "file": "first.yaml",
                    "drift_per_year": "1 um",
                    "date": "2027-01-01",
                }
            ]
        },
        "the map states no date",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_prior_that_does_not_fit_is_refused(case: str, tmp_path: Path) -> None:
    more, text = CASES[case]
    campaigns = Campaigns("spatial metric", tmp_path)
    campaigns.map_of_first()
    priors = {"priors": [{"kind": "map", "file": "first.yaml"}]}
    with pytest.raises(bp.ExperimentError) as refusal:
        lay_out(campaigns.experiment("B", campaigns.second, **{**priors, **more}))
    assert text in str(refusal.value)
    assert "priors[0]" in str(refusal.value)


def test_a_map_without_scatter_is_no_prior(tmp_path: Path) -> None:
    campaigns = Campaigns("spatial metric", tmp_path)
    exact = campaigns.experiment("A", campaigns.first, sigma="estimated")
    fitted = bp.fit(exact, bp.simulate(exact, exact=True)).to_map()
    bp.write_map(fitted, tmp_path / "first.yaml")
    with pytest.raises(bp.ExperimentError, match=wording.STATES_NO_UNCERTAINTY):
        campaigns.fit_of_second({})
    assert wording.AGREE_WITH_ITS_MODEL_BUT in bp.correct(fitted, [[0.1, 0.1, 0.1]]).notes[0]


def test_stored_cells_know_maps_by_their_content(tmp_path: Path) -> None:
    campaigns = Campaigns("spatial metric", tmp_path)
    fitted = campaigns.map_of_first()

    def told(**truth: Any) -> str:
        more = {"true_machine": {"kind": "map", "file": "first.yaml", **truth}}
        return fingerprint(campaigns.experiment("B", campaigns.second, **more))

    before = told()
    assert before == told() != told(draw=1)
    bp.write_map(replace(fitted, values=1.01 * fitted.values), tmp_path / "first.yaml")
    assert told() != before


def test_readings_that_count_twice_are_told(tmp_path: Path) -> None:
    """A map as prior knowledge of a fit to the readings that it comes from, or to some of them."""
    plain = small_quickstart()
    first, second = (bp.simulate(plain, seed) for seed in (1, 2))
    fit = bp.fit(plain, first)
    bp.write_map(fit.to_map(), tmp_path / "map.yaml")  # type: ignore[attr-defined]
    known = plain.with_({"priors": [{"kind": "map", "file": str(tmp_path / "map.yaml")}]})

    def told(table: pandas.DataFrame) -> list[str]:
        return [text for text in bp.fit(known, table).cautions if "count twice" in text]

    assert told(second) == []
    assert "(z low, z high, x low, x high, y low, y high)" in told(first.sample(frac=1.0))[0]
    both = second.copy()
    both.loc[both["position"] == "x high"] = first.loc[first["position"] == "x high"]
    assert wording.FITTED_HERE_TOO in told(both)[0]
    # They do: twice the information leaves 0.7 of the uncertainty, but for what certificates do.
    rows = [one.quantities["U6"].average / one.sigma for one in (fit, bp.fit(known, first))]  # type: ignore[attr-defined]
    assert rows[1] == pytest.approx(rows[0] / np.sqrt(2.0), rel=0.05)
    # A map that rests on another one is no independent campaign either.
    later = bp.fit(known, second).to_map()  # type: ignore[attr-defined]
    bp.write_map(later, tmp_path / "later.yaml")
    found = bp.diff(tmp_path / "map.yaml", tmp_path / "later.yaml", grid=2)
    assert found.in_common == "some" and found.is_changed is None
    apart = bp.fit(plain, second).to_map()  # type: ignore[attr-defined]
    assert bp.diff(tmp_path / "map.yaml", apart, grid=2).is_changed is False
