"""Error of a store, cluster or other object that a computation cannot use."""

from __future__ import annotations


class UnusableError(Exception):
    """An object cannot be used; the text has fact, reason and remedy."""
