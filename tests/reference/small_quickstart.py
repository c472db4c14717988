"""The first example with a smaller plate and fewer coefficients, for what does not depend on size: a
fit of it takes half the time.
"""

from __future__ import annotations

from typing import Any

import ballplate as bp

SMALL: dict[str, Any] = {
    "artefacts": {"plate": {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}},
    "error_model": {
        "kind": "kinematic",
        "position_coefficients": 3,
        "rotation_coefficients": 2,
    },
}


def small_quickstart(**changes: Any) -> bp.Experiment:
    """The example, with further sections changed."""
    return bp.quickstart().with_(SMALL | changes)
