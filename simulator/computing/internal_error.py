"""Error for a result that contradicts a proven property: a fault of the program, not of its
input.
"""

from __future__ import annotations


class InternalError(Exception):
    """The program has found an error in itself; the message states the contradiction."""
