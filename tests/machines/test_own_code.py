"""Errors in code of a user's own, after it was loaded and tried: told with their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.simulator.design.arrays import influence_shifts, nominal_state
from ballplate.simulator.design.influences.protocol import Disturbed, Influence, InfluenceParameter
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.unusable import UnusableError
from ballplate.simulator.machines.protocol import Array

from tests.machines.test_custom_model import EXPERIMENT, GOOD

# Checks call it with seven points.
SLIPS = {
    "raise RuntimeError(f'{len(x)} points')": "RuntimeError: ",
    "return np.linalg.solve(np.eye(2), x)": "ValueError: ",
    "return x[0].missing": "AttributeError: ",
    "raise OSError('gone')": "OSError: gone",
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_model_that_fails_after_it_was_tried_is_told_with_its_place(
    slip: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = f"late_{list(SLIPS).index(slip)}"
    start = "    def jacobian(self, x, a, p):\n"
    source = GOOD.replace(start, f"{start}        if len(x) != 7:\n            {slip}\n")
    (tmp_path / f"{name}.py").write_text(source)
    (tmp_path / "e.yaml").write_text(EXPERIMENT.replace("MODEL", f"{name}:build"))
    assert main(["run", str(tmp_path / "e.yaml")]) == 3
    told = capsys.readouterr().err
    line = source[: source.index(slip)].count("\n") + 1
    assert len(told.splitlines()) == 1, told
    assert f"{name}.py:{line}: in jacobian, code of your own: {SLIPS[slip]}" in told


def test_an_error_of_the_program_stays_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*_: object) -> None:
        raise RuntimeError("mistake")

    wrong.__code__ = wrong.__code__.replace(co_filename=lay_out.__code__.co_filename)
    monkeypatch.setattr("ballplate.results.checked_designs.lay_out", wrong)
    with pytest.raises(RuntimeError, match="mistake"):
        main(["run", "designs/quickstart.yaml"])


class Broken(Influence):
    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return ()

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        return at.missing  # type: ignore[attr-defined, no-any-return]


def test_shifts_that_fail_are_told_with_their_place() -> None:
    design = replace(lay_out(bp.quickstart()), influences=(Broken(),))
    state = nominal_state(design)
    with pytest.raises(UnusableError) as raised:
        influence_shifts(design, state, design.readings, state.balls[design.readings.ball])
    line = Broken.shifts.__code__.co_firstlineno + 1
    text = f"shifts of Broken has failed: AttributeError: 'Disturbed' object has no attribute 'missing' (test_own_code.py, line {line})"
    assert str(raised.value) == text
