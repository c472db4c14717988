"""Cells of a sweep share what their files have in common, and are what files of their own say."""

from __future__ import annotations

import re
from pathlib import Path

import ballplate as bp
import pandas
import pytest
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.extensions.sweeps.load import experiment_of, load_sweep
from ballplate.simulator.experiment.loading import load

from tests.extensions.sweeps.support import ROOT, small_sweep
from tests.reference.copies import copy_tree

QUICKSTART = (ROOT / "designs" / "quickstart.yaml").read_text(encoding="utf-8")


def test_cells_are_what_files_of_their_own_say(tmp_path: Path) -> None:
    sweep = load_sweep(small_sweep(tmp_path, 3))
    # In two orders, so that no cell's experiment depends on what was made before.
    for numbers in (range(4), reversed(range(4))):
        for number in numbers:
            size, balls = 700 + 200 * (number // 2), 4 + number % 2
            text = QUICKSTART.replace("balls: [5, 5]", f"balls: [{balls}, {balls}]")
            text = text.replace("size: [750 mm, 750 mm]", f"size: [{size} mm, {size} mm]")
            path = tmp_path / "own.yaml"
            path.write_text(text, encoding="utf-8")
            (own,) = load(path)
            assert fingerprint(experiment_of(sweep, number)) == fingerprint(own)
    assert load(path)[0].layouts["plate"].coordinates.max() == pytest.approx(0.7)


def test_an_experiment_stays_when_a_file_that_it_names_has_changed(tmp_path: Path) -> None:
    """What another experiment of the same tree reads later is that one's alone."""
    copy_tree(ROOT / "designs" / "park", tmp_path / "park")
    machine = tmp_path / "park" / "machines" / "npl-like.yaml"
    before = bp.load(tmp_path / "park" / "plate.yaml")
    readings = bp.simulate(before, seed=1)
    text = machine.read_text(encoding="utf-8")
    changed = re.sub("EXX: .*", "EXX: {polynomial: [0 um, 500 um]}", text, count=1)
    assert changed != text
    machine.write_text(changed, encoding="utf-8")
    after = before.with_(title="on the changed machine")
    pandas.testing.assert_frame_equal(bp.simulate(before, seed=1), readings)
    assert not bp.simulate(after, seed=1).equals(readings)
