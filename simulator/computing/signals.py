"""Signals that end a command, and where its processes look for modules; the first module to be
loaded.
"""

from __future__ import annotations

# Exit status and what is told, by signal; SIGBREAK is Ctrl-Break on Windows.
ANSWERS = {
    "SIGINT": (130, "interrupted"),
    "SIGBREAK": (130, "interrupted"),
    "SIGTERM": (143, "terminated"),
}

# The variable with which Python does not look for modules in the current folder first.
SAFE_PATH = "PYTHONSAFEPATH"
