"""Messages for a computation that runs out of memory."""

from __future__ import annotations

from argparse import Namespace

from ballplate.simulator.computing.memory import want_of_memory

from .interruption import named_paths

# What makes a command's work smaller.
SMALLER = {
    "check": "leave positions or parameters out",
    "run": "give fewer evaluation.points, leave positions out, or use fewer --workers",
    "plan": "offer fewer candidates, give fewer evaluation.points, or use fewer --workers",
    "reach": "give fewer evaluation.points, leave positions out, or use fewer --workers",
    "run --reliability": "give fewer evaluation.points, or leave positions out",
    "simulate": "plan fewer readings",
    "fit": "leave readings or evaluation.points out",
    "compare": "leave positions out, or use fewer --workers",
    "sweep": "use fewer --workers, or make the experiments smaller",
    "sweep --export": "export to CSV, and fewer experiments",
    "sweep --report": "report fewer experiments",
    "map": "take a coarser --grid",
    "spline": "give fewer points",
}


def no_memory(error: BaseException, options: Namespace) -> str | None:
    """Return the message for an error from lack of memory, here or in a worker."""
    name = options.command
    named = [path for key, path in named_paths(options) if key in ("files", "file", "store")]
    place = ", ".join(map(str, named)) or f"ballplate {name}"
    smaller = SMALLER.get(name, "close other programs")
    # Worker processes that the system has ended; loading the class for it would take memory.
    if any(kind.__name__ == "BrokenProcessPool" for kind in type(error).__mro__):
        return (
            f"{place}: a worker process of {name} was ended from outside, as a rule because memory"
            f" ran short; {smaller}"
        )
    want = want_of_memory(error)
    return None if want is None else f"{place}: {name} {want}; {smaller}"
