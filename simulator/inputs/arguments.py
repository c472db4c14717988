"""Checks of functions' arguments, with messages about unusable ones."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from .settings import hint, shorten


def ensure_whole(least: int, most: int | None = None, **arguments: object) -> None:
    """Refuse arguments, except None, that are no whole number from `least` to `most`.

    :raises TypeError: no whole number.
    :raises ValueError: too small or too large.

    >>> ensure_whole(1, workers=0)
    Traceback (most recent call last):
    ...
    ValueError: workers=0; give 1 at least
    """
    for name, value in arguments.items():
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | np.integer):
            raise TypeError(f"{name}={value!r}; give a whole number")
        if value < least:
            raise ValueError(f"{name}={value}; give {least} at least")
        if most is not None and value > most:
            raise ValueError(f"{name}={value}; give {most} at most")


def ensure_positive(expected: str, most: float | None = None, **arguments: object) -> None:
    """Refuse arguments, except None, that are no number above 0, up to `most`.

    :raises TypeError: no number.
    :raises ValueError: not above 0, or too large.

    >>> ensure_positive("a ratio above 0 and at most 1", 1.0, until=5)
    Traceback (most recent call last):
    ...
    ValueError: until=5; give a ratio above 0 and at most 1
    """
    for name, value in arguments.items():
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            raise TypeError(f"{name}={value!r}; give {expected}")
        if not 0.0 < value <= (float("inf") if most is None else most):
            raise ValueError(f"{name}={value}; give {expected}")


def ensure_one_of(choices: Sequence[str], **arguments: object) -> None:
    """Refuse arguments, except None, outside the choices.

    :raises ValueError: an unknown name.
    """
    for name, value in arguments.items():
        if value is not None and (not isinstance(value, str) or value not in choices):
            text = shorten(str(value))
            raise ValueError(f'{name}: "{text}" is unknown; {hint(text, choices)}')


def ensure_type(class_: type, expected: str, **arguments: object) -> None:
    """Refuse arguments, except None, of another type.

    :raises TypeError: another type.

    >>> ensure_type(str, "a text with a unit", target=0.5)
    Traceback (most recent call last):
    ...
    TypeError: target=0.5; give a text with a unit
    """
    for name, value in arguments.items():
        if value is not None and not isinstance(value, class_):
            raise TypeError(f"{name}={value!r}; give {expected}")


def ensure_path(name: str, argument: object) -> None:
    """Refuse an argument that is no path.

    :raises TypeError: no text and no path.
    """
    if not isinstance(argument, str | os.PathLike):
        raise TypeError(f"{name}={argument!r}; give the path of a file or folder")


def ensure_report(report: object) -> None:
    """Refuse an argument that is no function of steps.

    :raises TypeError: no function.
    """
    if not callable(report):
        raise TypeError(f"report={report!r}; give a function that takes a step, such as print")
