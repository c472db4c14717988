"""A map carries the lack of fit of its fit, and whatever takes the map repeats it.

Readings have one probe off by more and more, which the error model cannot follow: S^2 over the
degrees of freedom goes through both limits.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas
import pytest
import yaml
from ballplate.cli import main
from ballplate.results.residuals import LIMIT

from tests.extensions.machine_files import wording
from tests.reference.small_quickstart import SMALL, small_quickstart

# By how much one probe's readings are wrong, in metres, and what that is.
SHIFTS = {"clean": 0.0, "significant": 5e-6, "beyond": 1e-3}
VERDICTS = {"clean": "not significant", "significant": "significant", "beyond": "beyond the limit"}


@cache
def fit(name: str, **options: Any) -> bp.Fit:
    experiment = small_quickstart()
    readings = bp.simulate(experiment)
    wrong = readings["probe"] == "front"
    assert wrong.any() and not wrong.all()
    readings.loc[wrong, "x_mm"] += 1e3 * SHIFTS[name]
    return bp.fit(experiment, readings, **options)


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Map files of each verdict."""
    folder = tmp_path_factory.mktemp("maps")
    found = {name: folder / f"{name}.yaml" for name in VERDICTS}
    for name in SHIFTS:
        bp.write_map(fit(name).to_map(), found[name])
    (folder / "points.csv").write_text("name,x_mm,y_mm,z_mm\na,100,100,100\nb,600,500,400\n")
    return found


def squares_of(result: bp.Fit) -> float:
    """S^2 over its degrees of freedom, of the residuals of readings and certified values."""
    return result.to_dict()["sum_of_squares"] / result.degrees_of_freedom


def test_the_three_verdicts_are_those_of_the_sum_of_squares() -> None:
    """The test's level by its normal approximation, which is far from either case."""
    freedom = fit("clean").degrees_of_freedom
    level = 1.0 + 3.09 * np.sqrt(2.0 / freedom)
    for name, low, high in (
        ("clean", 0.0, level - 0.05),
        ("significant", level + 0.05, LIMIT**2),
        ("beyond", LIMIT**2, np.inf),
    ):
        assert low < squares_of(fit(name)) < high
        lack = fit(name).to_map().lack_of_fit
        assert lack is not None and lack.times == pytest.approx(squares_of(fit(name)))
        assert fit(name).too_large == lack.is_significant == (name != "clean")
        assert bool(fit(name).complaint) == lack.is_beyond_limit == (name == "beyond")


@pytest.mark.parametrize("factor", [0.3, 3.0, 20.0])
def test_uncertainties_stated_wrong_are_no_failure(factor: float) -> None:
    """Scatter `factor` times what is stated has at most a warning, whatever the factor."""
    experiment = small_quickstart()
    scattered = experiment.with_({"machine.repeatability": f"{0.2 * factor} um"})
    result = bp.fit(experiment, bp.simulate(scattered))
    assert result.sigma == pytest.approx(factor, rel=0.25)
    assert result.too_large == (factor > 1.0) and not result.complaint


def test_a_target_is_not_simply_met_beyond_the_limit() -> None:
    """With sigma as given U6 is that of the plan, however large the residuals."""
    caveat = "of which nothing can be relied on: lack of fit is beyond the limit"
    for name in ("clean", "beyond"):
        result = fit(name, sigma="given")
        assert result.quantities["U6"].within_target == 1.0
        (line,) = (one for one in result.lines() if one.startswith("within the target"))
        assert ("100 % of U6" in line) and (caveat in line) == (name == "beyond")
        page = result.page()
        assert "within the target" in page and page.count(caveat) == 2 * (name == "beyond")


def test_a_reversal_has_the_verdict_of_multiple_redundancy() -> None:
    """Real readings, stated to a microinch, twelve times what they scatter; and a slip of 10 mil."""
    folder = bp.quickstart().source.parent / "hocken_borchardt"
    experiment = bp.load(folder / "real.yaml", "with scale")
    readings = pandas.read_csv(folder / "real-readings.csv")
    for slip, words in ((0.0, ""), (0.01, "beyond the limit")):
        readings.loc[3, "x_in"] += slip
        found = bp.fit(experiment, readings, estimator="reversal")
        assert words in found.complaint and bool(words) == bool(found.complaint)


OF_MAPS = [
    ["correct", "MAP", "points.csv"],
    ["map", "MAP", "--grid", "2,2,2"],
    ["diff", "MAP", "clean.yaml"],
]


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        *((given, "beyond") for given in OF_MAPS),
        # The words of the others are of the same line.
        *((OF_MAPS[0], name) for name in VERDICTS if name != "beyond"),
    ],
    ids=lambda given: given if isinstance(given, str) else " ".join(given[:1] + given[2:3]),
)
def test_every_command_repeats_it(
    arguments: list[str],
    name: str,
    maps: dict[str, Path],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(maps[name].parent)
    if not Path("clean.yaml").exists():
        bp.write_map(fit("clean").to_map(), "clean.yaml")
    given = [f"{name}.yaml" if one == "MAP" else one for one in arguments]
    assert main(given) in (0, 1)
    told = capsys.readouterr()
    lines = [one for one in told.out.splitlines() if one.startswith("lack of fit of")]
    assert re.search(rf": {VERDICTS[name]}( \(|$)", lines[0])
    assert (wording.IN_THE_FIT in told.err) == (name in ("significant", "beyond"))
    if name == "beyond":
        assert main([*given, "--json"]) in (0, 1)
        assert VERDICTS[name] in json.dumps(json.loads(capsys.readouterr().out))


@pytest.mark.parametrize("role", ["priors", "true_machine"])
def test_an_experiment_repeats_that_of_its_map(role: str, maps: dict[str, Path]) -> None:
    for name in VERDICTS:
        stated = {"kind": "map", "file": str(maps[name])}
        change = {role: [stated] if role == "priors" else stated}
        doubts = [one for one in small_quickstart(**change).doubts if "in the fit of" in str(one)]
        assert len(doubts) == (name in ("significant", "beyond"))


def test_a_map_that_is_written_again_carries_it(
    maps: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = bp.load_map(maps["beyond"])
    bp.write_map(before, "new.yaml")
    assert bp.load_map("new.yaml").lack_of_fit == before.lack_of_fit
    # By hand it is not taken off.
    text = maps["beyond"].read_text()
    Path("edited.yaml").write_text(re.sub("^lack_of_fit:.*\n", "", text, flags=re.MULTILINE))
    with pytest.raises(bp.ExperimentError, match="lack_of_fit: missing"):
        bp.load_map("edited.yaml")


def test_the_exit_status_of_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    experiment = small_quickstart()
    stated = yaml.safe_load(Path(bp.quickstart().source).read_text()) | SMALL
    Path("design.yaml").write_text(yaml.safe_dump(stated))
    for name in ("clean", "beyond"):
        readings = bp.simulate(experiment)
        readings.loc[readings["probe"] == "front", "x_mm"] += 1e3 * SHIFTS[name]
        readings.to_csv("readings.csv", index=False)
        status = main(["fit", "design.yaml", "readings.csv", "-o", f"{name}.yaml"])
        told = capsys.readouterr().err
        assert status == (name == "beyond") and Path(f"{name}.yaml").exists()
        assert ("S^2 is" in told) == (name != "clean")
        assert (wording.LACK_OF_FIT_IS_BEYOND in told) == (name == "beyond")
