"""Settings that are equal but for rounding: what is said of a sweep is the same whichever way their
last digits fall.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.sweeps.answer import answer

from tests.extensions.sweeps.stores import axis, done, made_up_result

# Averages in micrometres by turns and length: opposite turns are alike, as of a design that is
# mirrored, and the smallest is that of four settings.
AVERAGES = np.array([[0.31, 0.29], [0.29, 0.37], [0.31, 0.29], [0.29, 0.37]])
FIRST = "turns 0; c 60 mm"


def results(path: Path, share: np.ndarray | None, seed: int | None):
    """The sweep with its shares within the target; of a seed each figure is one unit in the last
    place larger or smaller, or as it is.
    """
    axes = [
        axis("turns", list("0123"), [0.0, 1.0, 2.0, 3.0], "1"),
        axis("c", ["50 mm", "60 mm"], [0.05, 0.06], "m"),
    ]
    found = 1e-6 * AVERAGES
    if seed is not None:
        step = np.random.default_rng(seed).integers(-1, 2, found.shape)
        found = np.nextafter(found, found + step)

    def rows():
        for k, place in enumerate(product(range(4), range(2))):
            size = float(found[place])
            figures = {"U6_average_m": size, "U6_maximum_m": 2 * size, "U6_undetermined": 0.0}
            if share is not None:
                figures["U6_within_target"] = float(share[place])
            yield done(k, figures | {"rank_deficiency": 0.0, "observations": 40.0})

    return made_up_result(path, "ties", axes, rows())


@pytest.mark.parametrize(
    ("share", "first"),
    [
        (None, FIRST),
        (np.ones((4, 2)), FIRST),
        (np.full((4, 2), 0.5), FIRST),
        # Of the settings that meet the target none has the smallest average of all.
        (np.where(AVERAGES == 0.31, 1.0, 0.5), "turns 0; c 50 mm"),
    ],
    ids=["without", "all", "none", "some"],
)
def test_the_last_place_changes_neither_words_nor_order(tmp_path: Path, share, first) -> None:
    def said(name: str, seed: int | None) -> tuple:
        mine = results(tmp_path / f"{name}.sqlite", share, seed)
        told = answer(mine)
        assert first in " ".join(told.sentences)
        return told.sentences, told.best, told.case

    expected = said("exact", None)
    # By the averages, and of the same ones by case.
    by_average = np.argsort(AVERAGES.ravel(), kind="stable")
    if share is None or len(np.unique(share)) == 1:
        assert list(expected[1]) == by_average.tolist() == [1, 2, 5, 6, 0, 4, 3, 7]
    for seed in range(12):
        assert said(f"moved {seed}", seed) == expected
