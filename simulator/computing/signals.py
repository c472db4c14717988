"""Signals that ask a command to end, loaded before anything else is."""

from __future__ import annotations

# Exit status and what is told, by signal; SIGBREAK is Ctrl-Break on Windows.
ANSWERS = {
    "SIGINT": (130, "interrupted"),
    "SIGBREAK": (130, "interrupted"),
    "SIGTERM": (143, "terminated"),
}
