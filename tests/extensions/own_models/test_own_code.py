"""Errors in code of a user's own, after it was loaded and tried: told with their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.simulator.design.influence_quantities import Disturbed, Influence, InfluenceParameter
from ballplate.simulator.design.measurement import influence_shifts, nominal_state
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.machines.protocol import Array


def test_an_error_of_the_program_stays_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*_: object) -> None:
        raise RuntimeError("mistake")

    wrong.__code__ = wrong.__code__.replace(co_filename=lay_out.__code__.co_filename)
    monkeypatch.setattr("ballplate.results.prediction.lay_out", wrong)
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
