"""Constrained splines from Python."""

from __future__ import annotations

from argparse import ArgumentError, ArgumentParser
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.arguments import PathLike
from ballplate.simulator.inputs import ensure_path, hint

if TYPE_CHECKING:
    from .curve_result import FittedCurve


def spline(file: PathLike, **wanted: Any) -> FittedCurve:
    """A spline with prescribed values and slopes through the measured errors of a CSV file.

    What curve is `wanted` is said as by the options of `ballplate spline`: x, y, points, every,
    knots, start, end, start_value, start_slope, end_value, end_slope and powers, in texts with
    units.

    :raises TypeError: another name.
    :raises ValueError: a value that the command refuses.

    >>> import ballplate as bp
    >>> table = "designs/gilsinn/table-1.csv"
    >>> bp.spline(table, y="finish_error", points="12-32", start_slope="0")
    <FittedCurve of table-1: 21 points, 7 free coefficients>
    """
    from .curve_result import error_curve
    from .spline_command import add_curve

    ensure_path("file", file)
    parser = ArgumentParser(exit_on_error=False)
    add_curve(parser)
    defaults = vars(parser.parse_args([]))
    arguments = []
    for name, value in wanted.items():
        if name not in defaults:
            raise TypeError(f'"{name}" is unknown; {hint(name, defaults)}')
        if value is not None:
            arguments.append(f"--{name.replace('_', '-')}={value}")
    try:
        return error_curve(Path(file), parser.parse_args(arguments))
    except ArgumentError as error:
        # Options are arguments here.
        name = str(error.argument_name).lstrip("-").replace("-", "_")
        raise ValueError(f"{name}: {error.message}") from None
