"""Small campaigns with a plate whose balls have names by row and column."""

from __future__ import annotations

from typing import Any

CORNER = {"x": "50 mm", "y": "60 mm"}
PLACES: list[dict[str, Any]] = [
    {"plane": "z", "level": "100 mm", "corner": CORNER, "probes": ["down"]},
    {"plane": "z", "level": "400 mm", "corner": CORNER, "probes": ["down"]},
    {"plane": "z", "level": "250 mm", "corner": CORNER, "quarter_turns": 1, "probes": ["down"]},
    {"plane": "x", "level": "150 mm", "corner": {"y": "50 mm", "z": "50 mm"}, "probes": ["right"]},
    {
        "plane": "y",
        "level": "350 mm",
        "corner": {"z": "50 mm", "x": "50 mm"},
        "quarter_turns": 1,
        "probes": ["right"],
    },
]
IN_SPACE: dict[str, Any] = {
    "title": "a plate in space",
    "machine": {"volume": ["500 mm", "500 mm", "500 mm"], "repeatability": "0.3 um"},
    "probes": {"down": ["0 mm", "0 mm", "-50 mm"], "right": ["50 mm", "0 mm", "0 mm"]},
    "artefacts": {"plate": {"kind": "square", "balls": 3, "size": "380 mm"}},
    "positions": [{"name": f"P{k}", **place} for k, place in enumerate(PLACES)],
    "calibration": [{"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"}],
}
IN_PLANE: dict[str, Any] = {
    "title": "a plate in a plane",
    "machine": {"volume": ["500 mm", "600 mm"], "repeatability": "0.5 um"},
    "artefacts": {"plate": {"kind": "grid", "balls": [4, 3], "size": ["380 mm", "390 mm"]}},
    "positions": [{"name": f"Q{k}", "corner": CORNER, "quarter_turns": k} for k in range(3)],
    "calibration": [{"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"}],
}
