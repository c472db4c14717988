"""What commands read and write that are walked through."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.cli._parsers import module_of
from ballplate.extensions.planning import campaign_choice

from tests.cli.walk import BALLS, DESIGN, FACE, PART, SPACE, WALK
from tests.extensions.planning.small_pool import TEXT as POOL
from tests.extensions.sweeps.stores import axis, done, made_up
from tests.reference.copies import copy_file, copy_tree


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All that the commands read."""
    folder = tmp_path_factory.mktemp("shelf")
    texts = {"design.yaml": DESIGN, "space.yaml": SPACE, "part.yaml": PART, "face.csv": FACE}
    for name, text in {**texts, "balls.csv": BALLS, "pool.yaml": POOL}.items():
        (folder / name).write_text(text, encoding="utf-8")
    sphere = "UNITS/MM\nFA(FIRST_A)=FEAT/SPHERE,CART,50,50,0,22\nENDFIL\n"
    (folder / "report.dmo").write_text(sphere, encoding="utf-8")
    axes = "axes: {repeatability: {path: machine.repeatability, values: [1 um, 2 um]}}"
    (folder / "sweep.yaml").write_text(f"title: two\nbase: design.yaml\n{axes}\n", encoding="utf-8")
    for name in ("drawn.yaml", "done.csv", "touched.csv"):
        (folder / name).write_text("is not read\n", encoding="utf-8")
    copy_file("designs/gilsinn/table-1.csv", folder / "points.csv")
    copy_file("designs/park/machines/measured-errors.yaml", folder / "machine.yaml")
    copy_tree("designs/park/machines/measured", folder / "measured")
    figures = {"rank_deficiency": 0.0, "as_expected": 1.0}
    figures |= {"U6_maximum_m": 2e-6, "U6_average_m": 1e-6}
    rows = [done(k, figures) for k in range(2)]
    sizes = axis("size", ["1 mm", "2 mm"], [1e-3, 2e-3], "m")
    made_up(folder / "store.sqlite", "made up", [sizes], rows).close()
    readings, certificate = folder / "readings.csv", folder / "certificate.csv"
    simulate = ["simulate", str(folder / "design.yaml"), "-o", str(readings)]
    assert main([*simulate, "--certificate", str(certificate)]) == 0
    (folder / "corners.csv").write_text("name,x_mm,y_mm\nA,50,50\nB,450,50\n", encoding="utf-8")
    fit = ["fit", str(folder / "design.yaml"), str(readings), "-o", str(folder / "map.yaml")]
    assert main(fit) == 0
    for name in ("second-map.yaml", "space-map.yaml"):
        shutil.copy(folder / "map.yaml", folder / name)
    # In the plane, where a model has few curves to be drawn.
    few = {"kind": "kinematic", "position_coefficients": 2, "rotation_coefficients": 1}
    own = bp.load(folder / "design.yaml").with_({"error_model": few})
    bp.write_map(bp.fit(own, bp.simulate(own)).to_map(), folder / "curved-map.yaml")
    return folder


@pytest.fixture
def files(shelf: Path, tmp_path: Path) -> Path:
    """A copy of them that may be destroyed."""
    return Path(shutil.copytree(shelf, tmp_path / "files"))


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """No command may begin its work."""

    def fail(options: argparse.Namespace) -> int:
        raise AssertionError(f"{options.command} has begun")

    for command in WALK:
        monkeypatch.setattr(module_of(command), "run", fail)


@pytest.fixture(scope="session")
def planned() -> list[Any]:
    """What the search of `plan` has found, once it has."""
    return []


@pytest.fixture
def planned_once(monkeypatch: pytest.MonkeyPatch, planned: list[Any]) -> None:
    """The search of `plan` is done once for all tests: what is tested is what comes after it."""
    search = campaign_choice.campaign

    def once(*arguments: Any) -> Any:
        planned[:] = planned or [search(*arguments)]
        return planned[0]

    monkeypatch.setattr(campaign_choice, "campaign", once)
