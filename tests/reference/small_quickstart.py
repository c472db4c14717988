"""The first example with a smaller plate and fewer coefficients, for what does not depend on size: a
fit of it takes half the time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import yaml

PLATE = {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}
SMALL: dict[str, Any] = {
    "artefacts": {"plate": PLATE},
    "error_model": {
        "kind": "kinematic",
        "position_coefficients": 3,
        "rotation_coefficients": 2,
    },
}


def small_quickstart(**changes: Any) -> bp.Experiment:
    """The example, with further sections changed."""
    return bp.quickstart().with_(SMALL | changes)


# The same changes one by one, with few points and without errors of the machine.
OF_ENTRIES: dict[str, Any] = {
    "artefacts.plate.balls": [3, 3],
    "error_model.position_coefficients": 3,
    "error_model.rotation_coefficients": 3,
    "evaluation.points": {"random": 20, "seed": 3},
    "true_machine": {"kind": "zero"},
}


def small_sections(points: int = 12, seed: int = 3, **changes: Any) -> dict[str, Any]:
    """Its sections as a file has them, with three coefficients of each error, few points and
    further sections changed.
    """
    text = (Path(__file__).parents[2] / "designs" / "quickstart.yaml").read_text(encoding="utf-8")
    told: dict[str, Any] = yaml.safe_load(text)
    told["artefacts"] = {"plate": PLATE}
    told["error_model"] |= {"position_coefficients": 3, "rotation_coefficients": 3}
    told["evaluation"]["points"] = {"random": points, "seed": seed}
    return told | changes
