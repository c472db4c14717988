"""Signals that end a command; the first module to be loaded."""

from __future__ import annotations

# Exit status and what is told, by signal; SIGBREAK is Ctrl-Break on Windows.
ANSWERS = {
    "SIGINT": (130, "interrupted"),
    "SIGBREAK": (130, "interrupted"),
    "SIGTERM": (143, "terminated"),
}
