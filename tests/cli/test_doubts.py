"""What a file may say and hardly means is told on standard error, and changes neither results nor
status.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.machine_files.description import reference_functions
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

from tests.cli.walk import small_file

QUICKSTART = Path("designs/quickstart.yaml")


@pytest.mark.parametrize(("turns", "same"), [(4, 0), (-1, 3), (6, 2)])
def test_other_numbers_of_turns_are_refused_with_the_one_that_turns_as_far(
    tmp_path: Path, turns: int, same: int
) -> None:
    path, text = tmp_path / "e.yaml", Path("designs/planning/plate-pool.yaml").read_text()
    assert "quarter_turns: &turns [0, 1, 2, 3]" in text
    path.write_text(text.replace("[0, 1, 2, 3]", f"[0, {turns}]", 1))
    with pytest.raises(ExperimentError) as caught:
        load(path, planning=True)
    # The other groups have the same turns, by an alias.
    for k, message in enumerate(caught.value.messages):
        assert message.path == f"pool.candidates[{k}].quarter_turns[1]"
        assert message.text.endswith(f"write 0 to 3, such as {same}, which turns as far")


MACHINE = """\
title: m
arrangement: MB1
volume: [1 m, 1 m, 1 m]
{more}errors:
  {error}
"""


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (
            "EXZ: {polynomial: [2 um, 3 um, 1 um]}",
            "the straight line through its end points, from 2 µm to 6 µm,",
        ),
        (
            "EXZ: {polynomial: [0 um, 3 um]}",
            "the straight line through its end points, from 0 mm to 3 µm,",
        ),
        ("EXZ: {polynomial: [0 um, -7.1 um, 7.1 um]}", ""),
        ("EXZ: {polynomial: [1 um, 3 um], straightness: least squares}", ""),
        (
            "EXX: {polynomial: [5 um, 3 um]}",
            "5 µm is subtracted, because errors are zero at the reference point",
        ),
        ("EXZ: {bandwidth: 1 um}", ""),
    ],
)
def test_what_a_polynomial_loses_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], error: str, told: str
) -> None:
    """Just where the function differs from the polynomial as stated."""
    path = tmp_path / "m.yaml"
    path.write_text(MACHINE.format(error=error, more=""))
    assert main(["map", str(path), "--grid", "2,2,2"]) == 0
    err = capsys.readouterr().err
    expected = f"warning: {path}:5:{9 + len('polynomial: ')}: errors.{error[:3]}.polynomial: {told}"
    assert err.startswith(expected) if told else err == ""
    machine, t = load_machine(path), np.linspace(0, 1, 7)
    functions = reference_functions(machine)
    if functions and "least squares" not in error:
        (stated,) = (one.shape for one in machine.errors)
        assert stated is not None and hasattr(stated, "coefficients")
        as_stated = np.polynomial.polynomial.polyval(t, stated.coefficients)
        (function,) = functions.values()
        assert (np.abs(function.values(t)[:, 0] - as_stated).max() > 1e-9) == bool(told)


def test_an_experiment_tells_it_of_its_true_machine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = tmp_path / "m.yaml"
    machine.write_text(MACHINE.format(error="EXZ: {polynomial: [2 um, 3 um, 1 um]}", more=""))
    path = small_file(tmp_path / "e.yaml", true_machine={"kind": "machine", "file": "m.yaml"})
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().err.startswith(
        f"warning: {machine}:5:21: errors.EXZ.polynomial: the straight line"
    )
