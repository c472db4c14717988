"""Tables of stars beside stated offsets, against rotations that are searched for by another
library.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from ballplate.simulator.design.observations.star import Star
from ballplate.simulator.experiment._probes import doubt_of_table
from ballplate.simulator.experiment.loading import load
from scipy.spatial.transform import Rotation

from tests.experiment import wording

NAMES = ("down", "right", "left", "back", "front")
TIPS = np.array(
    [[0.0, 0.0, -0.05], [0.05, 0.0, 0.0], [-0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, -0.05, 0.0]]
)


def doubted(table: np.ndarray, offsets: np.ndarray = TIPS, place: bool = True) -> str:
    return doubt_of_table(Star(NAMES[: len(table)], table, 2e-7, place), offsets)


@pytest.mark.parametrize("place", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_a_table_in_any_axes_with_nominal_offsets_is_not_doubted(seed: int, place: bool) -> None:
    generator = np.random.default_rng(seed)
    near = TIPS + generator.uniform(-1.0, 1.0, TIPS.shape) * 1e-3
    turn = Rotation.random(random_state=seed).as_matrix()
    shift = 0.0 if place else generator.standard_normal(3)
    assert doubted(near @ turn.T + shift, place=place) == ""


@pytest.mark.parametrize("place", [True, False])
@pytest.mark.parametrize("pair", [(1, 2), (3, 4), (0, 1), (0, 4)])
@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_an_exchange_is_doubted(pair: tuple[int, int], noise: float, place: bool) -> None:
    table = TIPS + noise * np.random.default_rng(1).uniform(-1.0, 1.0, TIPS.shape)
    table[list(pair)] = table[list(pair[::-1])]
    assert "check which tip is which" in doubted(table, place=place)


def test_a_mirror_image_has_the_same_distances_and_is_doubted() -> None:
    offsets = TIPS * np.array([1.0, 1.2, 1.5, 1.9, 2.4])[:, None]
    assert doubted(-offsets, offsets)


def test_a_tip_that_is_longer_is_named_with_what_another_library_finds() -> None:
    table = TIPS.copy()
    table[0, 2] = -0.06
    turn, _ = Rotation.align_vectors(TIPS, table)
    worst = np.linalg.norm(TIPS - turn.apply(table), axis=1).max()
    found = doubted(table)
    assert f"up to {1e3 * worst:.1f} mm" in found and wording.MOST_OF_ALL in found
    moved = doubted(table, place=False)
    assert wording.MOST_OF_ALL in moved


def test_the_file_says_so_once_and_loads(tmp_path: Path) -> None:
    told = yaml.safe_load(Path("designs/quickstart.yaml").read_text("utf-8"))
    names = list(told["probes"])
    rows = [[name, *told["probes"][name]] for name in names]
    swapped = dict(zip(names, names, strict=True)) | {names[1]: names[2], names[2]: names[1]}
    told["stars"] = [{"standard_uncertainty": "0.2 um", "values": "star.csv"}]
    (tmp_path / "a.yaml").write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
    for exchange in (False, True):
        lines = ["probe,x_mm,y_mm,z_mm"]
        for name, *place in rows:
            texts = [text.removesuffix(" mm") for text in place]
            lines.append(",".join([swapped[name] if exchange else name, *texts]))
        (tmp_path / "star.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        (found,) = load(tmp_path / "a.yaml")
        assert len(found.doubts) == exchange
        if exchange:
            assert "stars[0].values" in found.doubts[0]
