"""Constrained splines from Python."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ballplate.arguments import (
    SIGMAS,
    PathLike,
)
from ballplate.simulator.inputs import ensure_one_of, ensure_path, ensure_type

if TYPE_CHECKING:
    from .curve_result import FittedCurve


def spline(
    file: PathLike,
    x: str | None = None,
    y: str | None = None,
    points: str | None = None,
    sigma: Literal["estimated", "given"] | None = None,
    powers: Literal["local", "global"] = "local",
    **wanted: Any,
) -> FittedCurve:
    """A spline with prescribed values and slopes through the measured errors of a CSV file.

    `x` and `y` are columns, and `points` names those that are used. What curve is `wanted` is said
    as by the options of `ballplate spline`: order, every, knots, start, end, boundary, straight,
    start_value, start_slope, end_value, end_slope, at, periodic, period, uncertainty and evaluate,
    in texts with units.

    >>> import ballplate as bp
    >>> table = "designs/gilsinn/table-1.csv"
    >>> bp.spline(table, "arc_length", "finish_error", "12-32", start_slope="0")
    <FittedCurve of table-1: 21 points, 7 free coefficients>
    """
    from .curve_options import Asked, OptionError, ensure_asked
    from .curve_result import error_curve

    ensure_path("file", file)
    ensure_type(str, "the name of a column", x=x, y=y)
    ensure_type(str, 'names of points such as "12-32"', points=points)
    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_one_of(("local", "global"), powers=powers)
    ensure_asked(wanted)
    try:
        return error_curve(Path(file), x, y, points, Asked(**wanted), sigma, powers)
    except OptionError as error:
        # Options are arguments here.
        named = re.sub(r"--([a-z]+)-?([a-z]*)", _argument, str(error))
        raise ValueError(named) from None


def _argument(option: re.Match[str]) -> str:
    """The name of an argument for that of an option."""
    return "_".join(filter(None, option.groups()))
