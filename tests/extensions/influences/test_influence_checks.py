"""Classes of influence quantities that do not keep to their protocol are refused in words, each for
the one thing that is wrong with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.influence_quantities import (
    DesignParts,
    Disturbed,
    Influence,
    InfluenceParameter,
)
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.sections import InfluenceSettings
from ballplate.simulator.inputs.messages import ExperimentError


@dataclass(frozen=True)
class Long(Influence):
    """Styli longer by `value`, with something changed."""

    value: float
    changed: dict[str, Any]

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        right = InfluenceParameter("styli", "1", self.value, 1e-5, 0.05)
        own = {k: v for k, v in self.changed.items() if k in right.__dataclass_fields__}
        return (replace(right, **own),)

    def shifts(self, at: Disturbed) -> tuple[np.ndarray, np.ndarray]:
        slope = -at.offsets[:, :, None] * self.changed.get("factor", 1.0)
        if "transposed" in self.changed:
            slope = slope.swapaxes(0, 1)
        return -self.value * at.offsets + self.changed.get("more", 0.0), slope


class LongSettings(InfluenceSettings):
    kind: Literal["long"] = "long"
    value: float = 1e-4
    changed: ClassVar[dict[str, Any]] = {}

    def influence(self, design: DesignParts) -> Long:
        return Long(self.value, self.changed)


def laid_out(**changed: Any) -> Any:
    class Odd(LongSettings):
        pass

    Odd.changed = changed
    return lay_out(replace(bp.quickstart(), influences=(Odd(),)))


def test_what_is_right_is_laid_out() -> None:
    (one,) = laid_out().influence_parameters
    assert one.value == 1e-4


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"unit": "furlong"}, 'has the unit "furlong"; give one of m, rad'),
        ({"uncertainty": -1e-5}, "has the uncertainty -1e-05; give 0 for a constant"),
        ({"uncertainty": np.nan}, "has the uncertainty nan"),
        ({"effect": 0.0}, "has the effect 0; give what a unit of it moves"),
        ({"effect": np.inf}, "has the effect inf"),
        ({"position": 6}, "is of position 6; give an index below 6"),
        ({"name": ""}, "has no name"),
        ({"more": np.inf}, "shifts has values that are not finite"),
        ({"more": np.zeros((2, 1, 1))}, "shifts of 7 readings has the shape (2, 7, 3)"),
        ({"transposed": True}, "has the shape (3, 7, 1); it must be (7, 3, 1)"),
        ({"factor": np.nan}, "the derivative of shifts has values that are not finite"),
    ],
)
def test_what_is_wrong_is_told(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(ExperimentError) as caught:
        laid_out(**changed)
    assert "influences[0]: the class Odd: " in str(caught.value)
    assert words in str(caught.value)
