"""What an experiment needs of an extension, which may be missing."""

from __future__ import annotations

from typing import Any

from ballplate.simulator.inputs.extensions import MissingExtensionError, service
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.problems import Problems


def needed_service(name: str, steps: Steps, problems: Problems) -> Any | None:
    """Return a service that what is written at `steps` needs, or report its absence."""
    try:
        return service(name)
    except MissingExtensionError as error:
        problems.add(steps, str(error))
        return None
