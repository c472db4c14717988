"""An artefact that an extension provides, a ring of balls: every command knows it, and the pairs of
balls that it names.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from ballplate import experiment
from ballplate.simulator.experiment.layout import lay_out

from tests.geometry import wording
from tests.reference import dense
from tests.reference.installed_extension import install, said_with
from tests.reference.small_quickstart import small_sections

BALLS, DIAMETER = 8, 0.3
DIAMETERS = [[f"b{i}", f"b{i + 4}"] for i in range(1, 5)]

SCRIPT = """
def refused(work):
    try:
        work()
    except bp.ExperimentError as error:
        return str(error)

base, readings = str(folder / "base.yaml"), str(folder / "r.csv")
start = bp.load(base)
said("simulate", base, "-o", readings, "--seed", "5")
layout = start.layouts["plate"]
print(json.dumps({
    "names": layout.names,
    "places": layout.coordinates.tolist(),
    "check": bp.check(start).to_dict(),
    "run": bp.run(start).to_dict(),
    "fit": json.loads(said("fit", base, readings, "--json")[1]),
    "pairs": bp.fit(start, bp.simulate(start), estimator="distances", pairs="diameters").to_dict(),
    "schema": json.loads(said("schema")[1]),
    "missing": said("check", folder / "missing.yaml")[2],
    "wrong set": refused(lambda: bp.load(folder / "wrong.yaml")),
    "wrong pairs": refused(
        lambda: bp.fit(start, bp.simulate(start), estimator="distances", pairs="corners")
    ),
    "twins": refused(lambda: bp.load(folder / "twins.yaml")),
}))
"""


def sections(artefact: dict[str, Any], pairs: Any = "diameters") -> dict[str, Any]:
    """The quickstart with another plate, and few coefficients and points."""
    certificate = {"kind": "distances", "pairs": pairs, "standard_uncertainty": "0.2 um"}
    return small_sections(20, 1, artefacts={"plate": artefact}, calibration=[certificate])


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What is said where the extension is installed."""
    folder = install(tmp_path_factory.mktemp("package"))
    work = folder / "work"
    work.mkdir()
    ring = {"kind": "ring", "balls": BALLS, "diameter": "300 mm"}
    missing = sections(ring)
    del missing["artefacts"]
    for name, given in {
        "base": sections(ring),
        "wrong": sections(ring | {"balls": 7}),
        "missing": missing,
        "twins": sections({"kind": "twins"}),
    }.items():
        text = yaml.safe_dump(given, allow_unicode=True)
        (work / f"{name}.yaml").write_text(text, encoding="utf-8")
    return said_with(folder, SCRIPT, work)


@pytest.fixture(scope="module")
def problem() -> dense.Problem:
    """The same with its balls and its pairs listed, for the dense computation."""
    angles = [2 * np.pi * i / BALLS for i in range(BALLS)]
    places = {
        f"b{i + 1}": [f"{500 * DIAMETER * (1 + float(f(angle)))!r} mm" for f in (np.cos, np.sin)]
        for i, angle in enumerate(angles)
    }
    listed = sections({"kind": "balls", "coordinates": places}, DIAMETERS)
    return dense.planned(lay_out(experiment(listed)), 3, 3)


def test_its_balls_are_along_a_circle(told: dict[str, Any]) -> None:
    assert told["names"] == [f"b{i}" for i in range(1, BALLS + 1)]
    places = np.array(told["places"])
    from_middle = places - places.mean(axis=0)
    np.testing.assert_allclose(np.linalg.norm(from_middle, axis=1), 0.5 * DIAMETER, rtol=1e-14)
    assert not places[:, 2].any()


def test_uncertainties_are_those_of_a_dense_computation(
    told: dict[str, Any], problem: dense.Problem
) -> None:
    expected, found = dense.standard_uncertainties(problem), told["run"]["quantities"]
    for symbol in ("U1", "U4", "U5", "U6"):
        assert found[symbol]["maximum"] == pytest.approx(expected[symbol].max(), rel=1e-7)
        assert found[symbol]["average"] == pytest.approx(expected[symbol].mean(), rel=1e-7)
    deficiency = dense.linearised(problem).deficiency
    assert told["check"]["rank_deficiency"] == told["run"]["rank_deficiency"] == deficiency


def test_fits_know_it_and_estimators_of_distances_take_its_pairs(told: dict[str, Any]) -> None:
    assert told["fit"]["status"] == "converged"
    assert told["pairs"]["pairs"] == len(DIAMETERS)
    known = "choose from: neighbours, diameters, all"
    assert wording.IS_NOT_DEFINED_2 in told["wrong pairs"]
    assert known in told["wrong pairs"]


def test_messages_and_the_schema_know_it(told: dict[str, Any]) -> None:
    schema = told["schema"]
    assert {"balls", "diameter", "kind"} <= set(schema["$defs"]["RingSettings"]["required"])
    pairs = schema["$defs"]["DistancesSettings"]["properties"]["pairs"]["oneOf"]
    assert any(one.get("type") == "string" and "enum" not in one for one in pairs)
    # The description of the key is the kernel's; a wrong kind is answered with all kinds.
    assert "bryan_gauge" in told["missing"]
    # With seven balls there are no diameters.
    assert wording.IS_NOT_DEFINED in told["wrong set"]
    assert "choose from: neighbours, all" in told["wrong set"]


def test_a_layout_that_contradicts_itself_is_refused_by_its_kind(told: dict[str, Any]) -> None:
    assert wording.KIND_HAS_A_WRONG in told["twins"]
