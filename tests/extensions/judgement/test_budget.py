"""The uncertainty budget: contributions of the sources, against a dense computation and against
fits with one stated value changed at a time.
"""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.certificates.certificate_files import certified_values, with_values
from ballplate.extensions.judgement.budget import BudgetFigure, UncertaintyBudget
from ballplate.extensions.judgement.source_sums import source_sums, sources_of
from ballplate.simulator.estimation.functions import corrected_points
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.judgement import wording
from tests.reference import dense
from tests.reference.small_quickstart import small_sections

TOP = Path(__file__).parents[3]


def small(**changed: Any) -> Experiment:
    """Nine balls in the six positions of the first example, and tasks."""
    told = small_sections()
    told["evaluation"] |= {
        "probe": "right",
        "tasks": [
            {"name": "U6", "from": ["50 mm", "200 mm", "90 mm"], "to": ["550 mm", "0 mm", "0 mm"]}
        ],
    }
    return bp.experiment(told | changed)


def sides(uncertainty: str, pairs: Any = "corner sides") -> dict[str, Any]:
    return {"kind": "distances", "pairs": pairs, "standard_uncertainty": uncertainty}


def shares(found: UncertaintyBudget, name: str, k: int = 0) -> dict[str, float]:
    """Contributions by source of the k-th figure of a name."""
    chosen = [one for one in found.figures if one.name == name][k]
    return dict(zip(found.sources, chosen.contributions, strict=True))


def test_contributions_are_those_of_a_dense_computation() -> None:
    """Readings by position, two items of calibration of the same kind, coordinates, and two bars whose
    readings and certificates share the rows: every figure is the root of the sum of squares of its
    derivatives by the source's own errors.
    """
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    poses = [
        {"origin": [f"{x} mm" for x in origin], "rotation": [f"{angle} deg" for angle in angles]}
        for origin, angles in (
            ((200, 400, 500), (0, 0, 0)),
            ((300, 200, 400), (0, 0, 75)),
            ((400, 500, 100), (0, -60, 20)),
        )
    ]
    placed = [
        {"name": f"bar {k}", "artefact": ("bar", "bar", "rod")[k], "pose": pose, "probes": ["down"]}
        for k, pose in enumerate(poses)
    ]
    experiment = small(
        artefacts={
            "plate": {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]},
            "bar": {"kind": "two_spheres", "length": "600 mm", "role": "length_standard"},
            "rod": {"kind": "two_spheres", "length": "500 mm", "role": "length_standard"},
        },
        positions=[one | {"artefact": "plate"} for one in told["positions"]] + placed,
        calibration=[
            sides("0.2 um") | {"artefact": "plate"},
            sides("0.7 um", [["r1c1", "r3c3"], ["r1c2", "r3c2"]]) | {"artefact": "plate"},
            sides("0.3 um", "all") | {"artefact": "bar"},
            sides("0.5 um", "all") | {"artefact": "rod"},
            {
                "kind": "coordinates",
                "artefact": "plate",
                "balls": ["r1c1", "r2c2"],
                "standard_uncertainty": "1 um",
            },
        ],
    )
    found = bp.budget(experiment, by="position")
    design = lay_out(experiment)
    problem = dense.planned(design, 3, 3)
    rows = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    size = np.linalg.norm(rows, axis=0)
    inverse = np.linalg.pinv(rows / size, rcond=1e-11) / size[:, None]
    readings = design.readings.select(design.plate_readings)
    ends = np.cumsum([3 * len(readings), 4 + 2, 6]).tolist()
    raw = inverse[:, ends[2] :] @ problem.length_root
    given = dense.known(design, "length")
    assert given.certificate.tolist() == [0, 0, 1]
    certificates = given.uncertainty * np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    noise = dense.length_covariance(design) - certificates.T @ certificates
    functions = dense.quantities(problem)
    for symbol in ("U4", "U6"):
        linear = dense.jacobian(functions[symbol], problem.parameters)
        by_row = (linear @ inverse) ** 2
        expected = {
            f"readings in {name}": by_row[:, : ends[0]][
                :, np.repeat(readings.position == k, 3)
            ].sum(1)
            for k, name in enumerate(design.positions.names[:6])
        }
        expected |= {
            "calibration[0]: distances of plate": by_row[:, ends[0] : ends[0] + 4].sum(1),
            "calibration[1]: distances of plate": by_row[:, ends[0] + 4 : ends[1]].sum(1),
            "calibration[4]: coordinates of plate": by_row[:, ends[1] : ends[2]].sum(1),
            "readings of length standards": np.einsum(
                "ma,ab,mb->m", linear @ raw, noise, linear @ raw
            ),
            "certificate of bar": (linear @ raw @ certificates[0]) ** 2,
            "certificate of rod": (linear @ raw @ certificates[1]) ** 2,
        }
        own = shares(found, symbol)
        assert set(own) == set(expected)
        for name, values in expected.items():
            assert own[name] == pytest.approx(np.sqrt(values.mean()), rel=1e-7), (symbol, name)
        whole = dense.linearised(problem).of(linear)
        total = next(one for one in found.figures if one.name == symbol)
        assert total.standard_uncertainty == pytest.approx(np.sqrt((whole**2).mean()), rel=1e-8)


def test_contributions_are_those_of_fits_with_other_values() -> None:
    """Each value that is stated changed by its standard uncertainty, and the readings fitted again:
    the changes of the task's length add in squares to the contributions.
    """
    right = {"offset": ["50 mm", "0 mm", "0 mm"], "standard_uncertainty": "2 um"}
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    experiment = small(
        calibration=[sides("0.2 um"), sides("0.7 um", [["r1c1", "r3c3"]])],
        priors=[
            {"parameter": "EXX[2]", "value": "0 um", "standard_uncertainty": "0.3 um"},
            {"parameter": "x low: rotation x", "value": "0 rad", "standard_uncertainty": "1 urad"},
        ],
        probes=told["probes"] | {"right": right},
        sigma="given",
    )
    readings = bp.simulate(experiment, seed=4)
    fit = bp.fit(experiment, readings)
    found = shares(bp.budget(fit), "U6", 1)
    stated = certified_values(experiment)
    values = np.array([one.value for one in stated])
    squares: dict[str, float] = {}
    length = fit.functions.choose(["task"]).values[0]
    for k, one in enumerate(stated):
        moved = values.copy()
        moved[k] += one.standard_uncertainty
        design = lay_out(with_values(experiment, moved))
        state = estimate(design, fit.observed.x).state
        given = design.tasks
        ends = corrected_points(design, state, given.points[0], given.probes[0])
        change = np.linalg.norm(ends[1] - ends[0]) - length
        source = {
            "calibration[0]": "calibration[0]: distances of plate",
            "calibration[1]": "calibration[1]: distances of plate",
            "probes.right": "offsets of probes",
            "priors[0]": "priors of the error model",
            "priors[1]": "priors of poses",
        }[one.item]
        squares[source] = squares.get(source, 0.0) + change**2
    assert len(squares) == 5
    for source, square in squares.items():
        # The fits stop a few picometres from where they go.
        assert found[source] == pytest.approx(np.sqrt(square), rel=1e-4, abs=1e-12), source
    u = fit.tasks[0].standard_uncertainty
    assert found["readings"] ** 2 + sum(squares.values()) == pytest.approx(u**2, rel=1e-4, abs=0.0)


def test_influence_quantities_are_sources() -> None:
    """An expansion whose stated value is wrong changes the task's length by its contribution."""
    influences = [
        {
            "kind": "temperature",
            "artefact_temperature": {"value": "21.5 degC", "standard_uncertainty": "0 mK"},
            "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "0.6 um/m/K"},
        }
    ]
    experiment = small(influences=influences, sigma="given")
    readings = bp.simulate(experiment, seed=4)
    fits = [
        bp.fit(
            experiment.with_({"influences[0].artefact_expansion.value": f"{value} um/m/K"}),
            readings,
        )
        for value in (11.5, 12.1, 10.9)
    ]
    task = [fit.functions.choose(["task"]).values[0] for fit in fits]
    found = shares(bp.budget(fits[0]), "U6", 1)
    assert found["influences[0]: temperature"] == pytest.approx(
        0.5 * abs(task[1] - task[2]), rel=1e-4
    )
    assert found["influences[0]: temperature"] > 1e-8


def test_sources_add_up_in_every_design() -> None:
    """The sums of all sources are the identity, whatever designs are: two dimensions, deficient
    ones, gauges with radii, unknown offsets of probes, stars, priors much tighter than readings.
    """
    for name in ("deficient", "unknown-offsets", "two-dimensions", "bryan-gauge", "weak"):
        for experiment in bp.load_all(TOP / f"designs/certified/{name}.yaml"):
            at = linearise(lay_out(experiment))
            found = source_sums(at, None, sources_of(at.design, experiment))
            assert np.abs(found.sums.sum(axis=0) - np.eye(at.rank)).max() < 1e-10, name
            assert all(np.linalg.eigvalsh(one).min() > -1e-10 for one in found.sums)


def test_a_fit_multiplies_by_its_sigma_and_says_of_few_degrees_of_freedom() -> None:
    experiment = small(sigma="estimated")
    readings = bp.simulate(experiment, seed=4)
    fit = bp.fit(experiment, readings)
    found = bp.budget(fit, by="axis")
    given = bp.budget(bp.fit(experiment, readings, sigma="given"), by="axis")
    assert found.sigma == fit.sigma != 1.0 and found.notes == ()
    assert found.to_dict()["of"] == "fit" and "budget of the fit;" in found.lines()[1]
    for one, other in zip(found.figures, given.figures, strict=True):
        assert one.contributions == pytest.approx(fit.sigma * np.array(other.contributions))
    assert found.to_dict()["figures"][0]["expanded_uncertainty"] == pytest.approx(
        2.0 * found.figures[0].standard_uncertainty
    )


def test_a_certificate_counts_whatever_is_said_of_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A certificate whose lengths are a millimetre off leaves residuals hundreds of times as large,
    and a table without a unit in its headings is the same table.
    """
    design = str(TOP / "designs" / "quickstart.yaml")
    table, plain, values = tmp_path / "r.csv", tmp_path / "plain.csv", tmp_path / "c.csv"
    assert main(["simulate", design, "-o", str(table), "--certificate", str(values)]) == 0
    plain.write_text(table.read_text().replace("_mm", "", 3))
    lines = values.read_text().splitlines()
    item, first, second, _ = lines[2].split(",")
    values.write_text("\n".join([*lines[:2], f"{item},{first},{second},751 mm", *lines[3:], ""]))
    told = {}
    capsys.readouterr()
    for name, options in (
        ("without", [str(table)]),
        ("with", [str(table), "--certificate", str(values)]),
        ("plain", [str(plain), "--unit", "mm", "--certificate", str(values)]),
    ):
        assert main(["run", "--budget", design, *options, "--json"]) == (name != "without")
        told[name] = json.loads(capsys.readouterr().out)
    assert told["with"] == told["plain"]
    assert told["with"]["sigma"] > 100.0 * told["without"]["sigma"]


@pytest.mark.parametrize(
    ("name", "by"),
    [
        ("quickstart", "position"),
        ("certified/three-planes", "probe"),
        ("certified/deficient", "axis"),
    ],
)
def test_text_and_table_say_what_the_data_say(name: str, by: Any) -> None:
    """Sources in the order of what they contribute, and their squares add up."""
    file = TOP / "designs" / f"{name}.yaml"
    found, whole = bp.budget(file, by=by), bp.run(file).quantities
    lines, told, rows = found.lines(), found.to_dict()["figures"], []
    names = [figure["figure"] for figure in told]
    ranking = "U4" if name.endswith("deficient") else "U6"
    assert names == ["U4", "U6", *(f"diagonal {k}" for k in (1, 2, 3, 4))] and len(lines) < 25
    assert lines[1] == (
        "uncertainty budget of the design, at zero machine error;"
        f" {wording.SOURCES_BY_THEIR_PART.replace('U6', ranking)}"
    )
    assert lines[5 + len(found.sources)].startswith("expanded, k = 2  ")
    shown = [line.split("  ")[0].strip() for line in lines[4 : 4 + len(found.sources)]]
    assert shown == list(found.sources) and len(shown) > 2
    parts = [one.contributions for one in found.figures if one.name == ranking][0]
    assert (np.diff(parts) <= 1e-6 * max(parts)).all()
    for k, figure in enumerate(told):
        u, column = figure["standard_uncertainty"], []
        for line in lines[4 : 6 + len(shown)]:
            column.append(re.split("  +", line)[1 + k])
        assert (u is None) == (figure["count"] == figure["undetermined"])
        counts = whole.get(figure["figure"], BudgetFigure("", "", 0.0, (), 1, 0))
        assert (figure["count"], figure["undetermined"]) == (counts.count, counts.undetermined)
        if u is None:
            assert set(column) == {"undetermined"}
            continue
        squares = [one["standard_uncertainty"] ** 2 for one in figure["contributions"]]
        assert (
            sum(squares) == pytest.approx(u**2, rel=1e-9, abs=0.0)
            and figure["expanded_uncertainty"] == 2.0 * u
        )
        assert list(map(float, column[-2:])) == pytest.approx([1e6 * u, 2e6 * u], rel=5e-4)
        for one, cell, square in zip(figure["contributions"], column, squares, strict=False):
            assert one["share_of_variance"] == pytest.approx(square / u**2)
            value, share = re.fullmatch(r"(\S+) \((\S+) %\)", cell).groups()  # type: ignore[union-attr]
            assert float(value) == pytest.approx(1e6 * square**0.5, rel=5.1e-3)
            off = abs(float(share) - 100.0 * square / u**2)
            assert off <= (0.5 if float(share) >= 1.0 else 0.5 * float(share))
            rows.append((figure["figure"], one["source"], square**0.5, square / u**2))
        left_out = f"; {figure['undetermined']} of {figure['count']} are undetermined and left out"
        (line,) = (line for line in lines if line.startswith(f"{figure['figure']}: "))
        assert line.endswith(left_out) == (figure["undetermined"] > 0)
    table = [
        list(row.values())
        for row in csv.DictReader(found.to_csv().splitlines())
        if row["share of variance"]
    ]
    assert [(*row[:2], *map(float, row[2:4])) for row in table] == [
        (*row[:2], *map(pytest.approx, row[2:])) for row in rows
    ]


def test_diagonals_are_those_of_the_volume() -> None:
    """They have the uncertainties of measuring tasks between the same places."""
    ends = [((0, 0, 0), (1, 1, 1)), ((1, 0, 0), (0, 1, 1)), ((0, 1, 0), (1, 0, 1))]
    ends += [((0, 0, 1), (1, 1, 0))]
    tasks = [
        {"name": f"{k}", "from": [f"{x} m" for x in start], "to": [f"{x} m" for x in end]}
        for k, (start, end) in enumerate(ends)
    ]
    told = small_sections()
    told["evaluation"] |= {"probe": "right", "tasks": tasks}
    found = bp.budget(bp.experiment(told))
    u = {one.name: (one.standard_uncertainty, one.contributions) for one in found.figures}
    for k, pair in enumerate(ends):
        assert u[f"diagonal {k + 1}"] == (pytest.approx(u[f"{k}"][0]), pytest.approx(u[f"{k}"][1]))
        (one,) = (one for one in found.figures if one.name == f"diagonal {k + 1}")
        words = ("(" + ", ".join(f"{1000 * x}" for x in end) + ")" for end in pair)
        assert one.description.endswith("from {} to {} mm".format(*words))
