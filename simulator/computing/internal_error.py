"""Error for a result that contradicts what is proven about it: a fault of the program, not of
its input.
"""

from __future__ import annotations


class InternalError(Exception):
    """The program has found a mistake in itself; the message says what contradicts what."""
