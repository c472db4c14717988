"""What a computation works with or into, and cannot use: a store, a cluster."""

from __future__ import annotations


class UnusableError(Exception):
    """Something cannot be used; the text says what, why, and what would help."""
