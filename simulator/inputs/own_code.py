"""Calls of user code, and the location of errors in it."""

from __future__ import annotations

import os
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from .messages import in_one_line
from .number_arrays import Array
from .settings import shorten
from .unusable import UnusableError

# Packages that the program uses, by their folders.
LIBRARIES = frozenset(
    ("distributed", "filelock", "jinja2", "joblib", "matplotlib", "numpy", "pandas", "pyarrow")
    + (
        "pydantic",
        "pydantic_core",
        "scipy",
        "tabulate",
        "threadpoolctl",
        "tqdm",
        "yaml",
        "dask",
        "tornado",
    )
)
# Folders of the standard library.
STANDARD = (Path(traceback.__file__).parent, Path(sysconfig.get_path("platstdlib")))


def own_frame(error: BaseException) -> traceback.FrameSummary | None:
    """Return the innermost frame of user code that an error came through, or None."""
    program = {
        getattr(module, "__file__", None)
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] == "ballplate"
    }
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = frame.filename
        if not file.startswith("<") and file not in program and not _is_library(file):
            return frame
    return None


def _is_library(file: str) -> bool:
    parts = Path(file).parts
    for folder in ("site-packages", "dist-packages"):
        if folder in parts[:-1]:
            # By the innermost one: virtual environments may be inside each other.
            inner = len(parts) - 1 - parts[::-1].index(folder)
            return parts[inner + 1].removesuffix(".py") in LIBRARIES
    return any(Path(file).is_relative_to(folder) for folder in STANDARD)


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
