"""One thread of linear algebra: faster for the small matrices here, and the same bits on any machine.

The matrices of an elimination have some hundred columns. Handing them to several threads gains little on an idle
machine and loses a hundredfold on a busy one, where the threads wait for each other; and the order of summation,
with it the last bits of every result, would depend on their number.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


@cache
def _controller() -> ThreadpoolController:
    # SciPy brings a library of its own, which is found only once it is loaded.
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with one thread of linear algebra, and restore what was set before."""

    @wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> R:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*arguments, **named)

    return limited
