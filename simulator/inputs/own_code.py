"""Calls of the user's own code, and the location of errors in it."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from .extensions import UnusableError
from .messages import in_one_line
from .number_arrays import Array
from .settings import shorten

# Packages that are not the user's own.
OTHERS = frozenset(
    {"ballplate", *sys.stdlib_module_names}
    | {"distributed", "filelock", "jinja2", "joblib", "matplotlib", "numpy", "pandas", "pyarrow"}
    | {"pydantic", "pydantic_core", "scipy", "tabulate", "threadpoolctl", "tqdm", "yaml", "dask"}
    | {"tornado"}
)


def own_frame(error: BaseException) -> traceback.FrameSummary | None:
    """Return the innermost frame of user code that an error came through, or None."""
    for frame, line in reversed([*traceback.walk_tb(error.__traceback__)]):
        package = str(frame.f_globals.get("__name__")).partition(".")[0]
        if package not in OTHERS:
            return traceback.FrameSummary(frame.f_code.co_filename, line, frame.f_code.co_name)
    return None


def error_text(error: BaseException, frame: traceback.FrameSummary | None) -> str:
    """Return an error with its file and line, in one line."""
    location = "" if frame is None else f" ({Path(frame.filename).name}, line {frame.lineno})"
    return f"{shorten(f'{type(error).__name__}: {error}', 200)}{location}"


class OwnCodeError(UnusableError):
    """User code has failed or returned an unusable value; the text has its location."""


@contextmanager
def running_own_code() -> Iterator[None]:
    """Keep user code from printing among the results and from ending the process."""
    with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
        before, os._exit = os._exit, _refused_exit
        try:
            yield
        finally:
            os._exit = before


def _refused_exit(status: int = 0) -> NoReturn:
    raise SystemExit(f"os._exit({status})")


def own_result(call: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a user's function.

    :raises OwnCodeError: it has failed.
    """
    try:
        with running_own_code():
            return call(*arguments)
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:
        frame = own_frame(error)
        where = _definition(call) if frame is None else _place(frame.filename, frame.lineno)
        name = getattr(call, "__name__", "") if frame is None else frame.name
        raise _failed(where, name, error_text(error, None)) from error


def own_array(
    call: Callable[..., Any],
    shape: tuple[int, ...],
    *arguments: Array,
    is_plausible: bool = True,
) -> Array:
    """Return the array (`shape`) of a user's function for arrays; finite for plausible ones.

    :raises OwnCodeError: it has failed, or returned another type, shape or number.
    """
    result = own_result(call, *arguments)
    fault = ""
    if not isinstance(result, np.ndarray):
        fault = f"returns {type(result).__name__}; an array of shape {shape} is needed"
    elif result.shape != shape:
        fault = f"returns the shape {result.shape}; {shape} is needed"
    elif result.dtype.kind not in "fiu":
        fault = f"returns values of type {result.dtype}; numbers are needed"
    elif is_plausible and not np.isfinite(result).all():
        fault = "returns values that are not finite numbers"
    if fault:
        raise _failed(_definition(call), getattr(call, "__name__", ""), fault)
    # A copy: the code may return the same array again.
    return np.array(result, float)


def _failed(where: str, name: str, text: str) -> OwnCodeError:
    return OwnCodeError(in_one_line(f"{where}: in {name}, code of your own: {text}"))


def _definition(call: Callable[..., Any]) -> str:
    code = getattr(call, "__code__", None)
    return type(call).__name__ if code is None else _place(code.co_filename, code.co_firstlineno)


def _place(file: str, line: int | None) -> str:
    return f"{file}:{line}"
