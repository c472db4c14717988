"""Commands, options and functions that have moved, with their successors."""

from __future__ import annotations

MOVED = {
    "ballplate budget": "ballplate run --budget",
    "ballplate curves": "ballplate map --curves",
    "ballplate diff --csv": "-o",
    "ballplate export": "ballplate sweep --export",
    "ballplate ladder": "ballplate models",
    "ballplate reliability": "ballplate run --reliability",
    "ballplate report": "ballplate sweep --report",
    "ballplate run --reliability --csv": "-o",
    "ballplate spline --coefficients": "-o",
    "ballplate validate --against": "ballplate diff FILE FILE --readings FIRST SECOND",
    "ballplate validate --other-plate": "ballplate diff, without --shared",
    "bp.cross_validate": "bp.diff",
    "bp.ladder": "bp.compare_models",
}
