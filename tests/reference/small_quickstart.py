"""The first example with a smaller plate and fewer coefficients, for what does not depend on size: a
fit of it takes half the time.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import ballplate as bp
import yaml

PLATE = {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}
SMALL: dict[str, Any] = {
    "artefacts": {"plate": PLATE},
    "error_model": {"kind": "kinematic", "position_coefficients": 3, "rotation_coefficients": 2},
}


def small_quickstart(**changes: Any) -> bp.Experiment:
    """The example, with further sections changed."""
    return bp.quickstart().with_(SMALL | changes)


def in_lengths(text: str) -> str:
    """The quickstart with its places as lengths."""
    text = text.replace("30 %", "250 mm").replace("80 %", "750 mm")
    text = text.replace("2/9", "250 mm").replace("7/9", "750 mm")
    return re.sub(r"\b([xyz]): low", r"\1: 0 mm", re.sub(r"\b([xyz]): high", r"\1: 250 mm", text))


# The same changes one by one, with few points and without errors of the machine.
OF_ENTRIES: dict[str, Any] = {
    "artefacts.plate.balls": [3, 3],
    "error_model.position_coefficients": 3,
    "error_model.rotation_coefficients": 3,
    "evaluation.points": {"random": 20, "seed": 3},
    "true_machine": {"kind": "zero"},
}


def small_sections(
    points: int = 12, seed: int = 3, kept: bool = False, **changes: Any
) -> dict[str, Any]:
    """Its sections as a file has them, with three coefficients of each error, few points and
    further sections changed; with places `kept` as lengths.
    """
    text = (Path(__file__).parents[2] / "designs" / "quickstart.yaml").read_text(encoding="utf-8")
    told: dict[str, Any] = yaml.safe_load(in_lengths(text) if kept else text)
    told["artefacts"] = {"plate": dict(PLATE)}
    told["error_model"] |= {"position_coefficients": 3, "rotation_coefficients": 3}
    told["evaluation"]["points"] = {"random": points, "seed": seed}
    return told | changes
