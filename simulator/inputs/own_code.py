"""Code of a user's own, neither the program's nor that of its libraries: calls of it, and places of
errors in it.
"""

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
from numpy.typing import NDArray

from .messages import in_one_line
from .settings import shorten
from .unusable import UnusableError

# Packages that the program uses, by their folders.
LIBRARIES = frozenset(
    ("distributed", "filelock", "jinja2", "joblib", "matplotlib", "numpy", "pandas", "pyarrow")
    + ("pydantic", "pydantic_core", "scipy", "threadpoolctl", "tqdm", "yaml", "dask", "tornado")
)
# What ends a process at once, whoever wants to know.
EXIT = os._exit
# Folders of the standard library.
STANDARD = (Path(traceback.__file__).parent, Path(sysconfig.get_path("platstdlib")))


def own_frame(error: BaseException) -> traceback.FrameSummary | None:
    """The innermost place in a user's own code that an error came through; None without any."""
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


def told(error: BaseException, frame: traceback.FrameSummary | None) -> str:
    """An error with the place where it arose, in a line."""
    at = "" if frame is None else f" ({Path(frame.filename).name}, line {frame.lineno})"
    return f"{shorten(f'{type(error).__name__}: {error}', 200)}{at}"


class OwnCodeError(UnusableError):
    """Code of a user's own has failed, or returned what cannot be used; the text says where."""


@contextmanager
def running_own_code() -> Iterator[None]:
    """What code of a user's own may not do is prevented: mix what it prints with the results, and
    end the process as if all were well.
    """
    with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
        os._exit = _refused_exit
        try:
            yield
        finally:
            os._exit = EXIT


def _refused_exit(status: int = 0) -> NoReturn:
    raise SystemExit(f"os._exit({status})")


def own_result(call: Callable[..., Any], *arguments: Any) -> Any:
    """What a function of a user's own returns.

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
        raise _failed(where, name, told(error, None)) from error


def own_array(
    call: Callable[..., Any],
    shape: tuple[int, ...],
    *arguments: NDArray[np.float64],
    is_plausible: bool = True,
) -> NDArray[np.float64]:
    """The array of a shape that a function of a user's own returns for arrays; finite for plausible
    ones.

    :raises OwnCodeError: it has failed, or returned anything else.
    """
    given = own_result(call, *arguments)
    wrong = ""
    if not isinstance(given, np.ndarray):
        wrong = f"returns {type(given).__name__}; an array of shape {shape} is needed"
    elif given.shape != shape:
        wrong = f"returns the shape {given.shape}; {shape} is needed"
    elif given.dtype.kind not in "fiu":
        wrong = f"returns values of type {given.dtype}; numbers are needed"
    elif is_plausible and not np.isfinite(given).all():
        wrong = "returns values that are not finite numbers"
    if wrong:
        raise _failed(_definition(call), getattr(call, "__name__", ""), wrong)
    return np.asarray(given, float)


def _failed(where: str, name: str, text: str) -> OwnCodeError:
    return OwnCodeError(in_one_line(f"{where}: in {name}, code of your own: {text}"))


def _definition(call: Callable[..., Any]) -> str:
    code = getattr(call, "__code__", None)
    return type(call).__name__ if code is None else _place(code.co_filename, code.co_firstlineno)


def _place(file: str, line: int | None) -> str:
    return f"{file}:{line}"
