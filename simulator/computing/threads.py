"""One thread of linear algebra: faster for the small matrices here, and the same bits on any
machine.

The matrices of an elimination have about a hundred columns. Several threads save little time on an
idle machine and lose a hundredfold on a busy one, where the threads wait for each other; and the
order of summation, with it the last bits of every result, would depend on their number.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from contextvars import ContextVar
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")

SCIPY = "scipy.linalg"

# What the outermost single-threaded function under way restores at its end.
_under_way: ContextVar[ExitStack | None] = ContextVar("_under_way", default=None)


@cache
def _controller(with_scipy: bool) -> ThreadpoolController:
    """The libraries that are loaded: SciPy brings one of its own."""
    return ThreadpoolController()


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with one thread of linear algebra, and restore the earlier setting.

    Functions that it calls import SciPy's linear algebra by `scipy_linalg`, if it is not loaded
    from the start.
    """

    @wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> R:
        if _under_way.get() is not None:
            return function(*arguments, **named)
        with ExitStack() as stack:
            stack.enter_context(_controller(SCIPY in sys.modules).limit(limits=1, user_api="blas"))
            token = _under_way.set(stack)
            try:
                return function(*arguments, **named)
            finally:
                _under_way.reset(token)

    return limited


def scipy_linalg() -> Any:
    """Return the module scipy.linalg, loaded on first use, and on one thread within a
    single-threaded function.
    """
    is_new = SCIPY not in sys.modules
    import scipy.linalg

    stack = _under_way.get()
    if is_new and stack is not None:
        stack.enter_context(_controller(True).limit(limits=1, user_api="blas"))
    return scipy.linalg
